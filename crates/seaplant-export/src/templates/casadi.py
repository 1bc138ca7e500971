@REMARKS@
"""A plant model for CasADi; see the comments above for source, units, frames and uncertainty.

`plant()` gives f(x, u, p) -> xdot as a casadi.Function: x (13,) is north, east, down [m],
quaternion w, x, y, z from body to world, velocity over ground in body axes [m/s, rad/s]; u (6,) is
X, Y, Z [N], K, M, N [N m]; p holds the coefficients and the current north, east, down [m/s].
`PARAMETERS` is p in still water. Of axes that the plant does not have, translations keep their
velocity, and rotations their angle: p, q and r of those follow from the others, and are not read
from x. `acados_model()` gives an AcadosModel where acados is installed.
"""

import casadi as ca
import numpy as np

NAMES = @NAMES@
"""The coefficients, in the order of THETA."""

THETA = np.array([@THETA@])
"""Their values, SI."""

PARAMETERS = np.concatenate([THETA, np.zeros(3)])
"""p: the coefficients, and a current of zero."""

OWN = [@AXES@]
"""The places of the axes that the plant has, among surge, sway, heave, roll, pitch, yaw."""


def mass(theta):
    """M, rigid body plus added mass (6, 6); zero where the plant has no entry."""
    mass = ca.SX.zeros(6, 6)
@MASS@    return mass


def forces(theta, nu, down):
    """C(M, nu) nu + damping + restoring (6,), on the left of M nu' + n = tau."""
    p = mass(theta) @ nu
    n = ca.vertcat(
        ca.cross(nu[3:], p[:3]), ca.cross(nu[:3], p[:3]) + ca.cross(nu[3:], p[3:])
    )
@FORCES@    return n


def hold(nu, down):
    """nu (6,) with p, q and r of rotations that the plant does not have that hold their angles."""
    nu = ca.SX(nu)
@HELD@    return nu


def from_world(q):
    """The matrix that takes a vector from the world to the body."""
    w, x, y, z = ca.vertsplit(q / ca.norm_2(q))
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        ca.horzcat(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        ca.horzcat(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )


def symbols():
    """x, u, p and xdot as expressions."""
    x, u = ca.SX.sym("x", 13), ca.SX.sym("u", 6)
    p = ca.SX.sym("p", len(NAMES) + 3)
    theta, current = p[: len(NAMES)], p[len(NAMES) :]
    q = x[3:7]
    rotation = from_world(q)
    nu = hold(x[7:], rotation[:, 2])
    water = rotation @ current
    relative = ca.SX(nu)
    turning = ca.cross(nu[3:], water)
    for k in OWN:
        if k < 3:
            relative[k] -= water[k]
    right = u - forces(theta, relative, rotation[:, 2])
    rate = ca.SX.zeros(6)
    rate[OWN] = ca.solve(mass(theta)[OWN, OWN], right[OWN])
    for k in OWN:
        if k < 3:
            # In body axes a constant current turns.
            rate[k] -= turning[k]
    w, a, b, c = ca.vertsplit(q)
    p_, q_, r_ = ca.vertsplit(nu[3:])
    attitude = 0.5 * ca.vertcat(
        -a * p_ - b * q_ - c * r_,
        w * p_ + b * r_ - c * q_,
        w * q_ + c * p_ - a * r_,
        w * r_ + a * q_ - b * p_,
    )
    return x, u, p, ca.vertcat(rotation.T @ nu[:3], attitude, rate)


def plant():
    """f(x, u, p) -> xdot."""
    x, u, p, xdot = symbols()
    return ca.Function("plant", [x, u, p], [xdot], ["x", "u", "p"], ["xdot"])


def acados_model():
    """The plant for acados; its parameter_values are PARAMETERS."""
    from acados_template import AcadosModel

    model = AcadosModel()
    model.name = "seaplant_plant"
    model.x, model.u, model.p, model.f_expl_expr = symbols()
    model.xdot = ca.SX.sym("xdot", 13)
    model.f_impl_expr = model.xdot - model.f_expl_expr
    return model
@ACTUATORS@
