function [xdot, U, M] = seaplant_plant(x, tau, V_c, beta_c, theta)
% [xdot, U, M] = seaplant_plant(x, tau, V_c, beta_c) in the style of the MSS toolbox.
%
%   x      = [u v w p q r x y z phi theta psi]': velocity over ground in body axes [m/s, rad/s],
%            position north, east, down [m], Euler angles [rad]
%   tau    = [X Y Z K M N]': force and moment on the body [N, N m]
%   V_c    speed of the current [m/s], beta_c the heading it goes to [rad]; both 0 if left out
%   theta  the coefficients, if others than those below
%   xdot   dx/dt,  U speed [m/s],  M the mass matrix, rigid body plus added mass
%
% Runs in MATLAB and Octave by itself. Of axes that the plant does not have, translations keep their
% velocity, and rotations their angle: p, q and r of those follow from the others, and are not read
% from x. At a pitch of 90 degrees Euler angles have no rate.
%
@REMARKS@
if nargin < 3, V_c = 0; end
if nargin < 4, beta_c = 0; end
if nargin < 5
    theta = [ ...
@THETA@        ];
end
own = [@AXES@];
nu = x(1:6); nu = nu(:);
tau = tau(:);
phi = x(10); the = x(11); psi = x(12);
R = [cos(psi)*cos(the), -sin(psi)*cos(phi)+cos(psi)*sin(the)*sin(phi), sin(psi)*sin(phi)+cos(psi)*cos(phi)*sin(the);
     sin(psi)*cos(the), cos(psi)*cos(phi)+sin(phi)*sin(the)*sin(psi), -cos(psi)*sin(phi)+sin(the)*sin(psi)*cos(phi);
     -sin(the), cos(the)*sin(phi), cos(the)*cos(phi)];
water = R' * [V_c * cos(beta_c); V_c * sin(beta_c); 0];
moved = zeros(6, 1);
for k = own(own <= 3)
    moved(k) = water(k);
end
down = R(3, :)';
@HELD@over_ground = nu;
nu = nu - moved;

M = zeros(6);
@MASS@
% C(M, nu) nu by Kirchhoff's equations.
p = M * nu;
n = [cross(nu(4:6), p(1:3)); cross(nu(1:3), p(1:3)) + cross(nu(4:6), p(4:6))];
% Damping and restoring.
@FORCES@
rate = zeros(6, 1);
right = tau - n;
rate(own) = M(own, own) \ right(own);
% In body axes a constant current turns.
turning = [cross(over_ground(4:6), water); zeros(3, 1)];
rate(own) = rate(own) - turning(own);

T = [1, sin(phi)*tan(the), cos(phi)*tan(the);
     0, cos(phi), -sin(phi);
     0, sin(phi)/cos(the), cos(phi)/cos(the)];
xdot = [rate; R * over_ground(1:3); T * over_ground(4:6)];
U = norm(over_ground(1:3));
end
