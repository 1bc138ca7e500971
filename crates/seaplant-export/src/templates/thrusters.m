function [state, tau] = seaplant_thrusters(state, inputs, h, supply_v)
% The force and moment of all thrusters from their inputs, with lag, delay and reverse ratio.
%
%   state = seaplant_thrusters([], inputs)           thrusters whose inputs have always been these
%   [state, tau] = seaplant_thrusters(state, inputs, h, supply_v)
%                                                    tau = [X Y Z K M N]' [N, N m] for the next h
%                                                    seconds, over which the inputs are held
%
% Steps of 0.02 s or less follow a lag. supply_v [V] is read only by curves of several voltages; 0 if
% left out. A propeller follows its delayed input by lag ds/dt = input - s; thrust in reverse is that
% of the curve times the ratio; the force of all thrusters on an axis follows theirs by its own lag.
%
% Inputs:
@INPUTS@%
% Runs in MATLAB and Octave by itself, beside seaplant_plant.m.
%
% Inputs with which propellers stand still: [@NEUTRAL@]'
%
@REMARKS@

% The wrench of one newton of each thruster, a row each.
allocation = [ ...
@ALLOCATION@    ];
% Between inputs and thrust, by axis, lags also by thruster, as fitted; 0, 0, 0 and 1 where nothing
% was found.
lag_s = [ ...
@LAG@    ];
force_lag_s = [@FORCE_LAG@];
delay_s = [@DELAY@];
reverse_ratio = [@RATIO@];

if nargin < 4, supply_v = 0; end
inputs = inputs(:);
if isempty(state)
    state = struct('now', 0, 'since', 0, 'inputs', inputs, 'speed', repmat(inputs, 1, 6), ...
                   'force', []);
    tau = [];
    return
end
state.since(end + 1) = state.now;
state.inputs(:, end + 1) = inputs;
tau = zeros(6, 1);
force = zeros(6, 1);
for axis = 1:6
    at = find(state.since <= state.now + 0.5 * h - delay_s(axis), 1, 'last');
    if isempty(at), at = 1; end
    goal = state.inputs(:, at);
    behind = state.speed(:, axis) - goal;
    fade = arrayfun(@(lag) left(0.5 * h, lag), lag_s(axis, :)');
    middle = goal + behind .* fade;
    state.speed(:, axis) = goal + behind .* fade .^ 2;
    pushed = 0;
    for k = 1:numel(inputs)
        f = thrust(k, middle(k), supply_v);
        if f < 0, f = reverse_ratio(axis) * f; end
        pushed = pushed + allocation(k, axis) * f;
    end
    slower = 0;
    if ~isempty(state.force), slower = state.force(axis) - pushed; end
    tau(axis) = pushed + slower * left(0.5 * h, force_lag_s(axis));
    force(axis) = pushed + slower * left(h, force_lag_s(axis));
end
state.force = force;
state.now = state.now + h;
% Inputs older than every delay are forgotten.
oldest = find(state.since <= state.now - max(delay_s), 1, 'last');
if ~isempty(oldest) && oldest > 1
    state.since(1:oldest - 1) = [];
    state.inputs(:, 1:oldest - 1) = [];
end
end

function x = left(seconds, lag_s)
% What is left of a difference after so long behind a lag.
x = 0;
if lag_s > 0, x = exp(-seconds / lag_s); end
end

function f = thrust(k, input, supply_v) %#ok<INUSD>
% Thrust of one thruster [N].
switch k
@CASES@end
end

function f = power(forward, reverse, exponent, deadband, neutral, x) %#ok<DEFNU>
s = max(0, abs(x - neutral) - deadband) ^ exponent;
f = forward * s;
if x < neutral, f = -reverse * s; end
end

function y = interpolated(x, points, values) %#ok<DEFNU>
% Straight lines between points, and what stands at the ends beyond them.
y = interp1(points, values, min(max(x, points(1)), points(end)));
end
