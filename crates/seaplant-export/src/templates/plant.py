@REMARKS@
"""A plant model in NumPy; see the comments above for source, units, frames and uncertainty.

State x (13,): north, east, down [m]; quaternion w, x, y, z from body to world; velocity over ground
in body axes u, v, w [m/s], p, q, r [rad/s]. Input tau (6,): X, Y, Z [N], K, M, N [N m].
Current (3,): velocity of the water north, east, down [m/s]. Of axes that the plant does not have,
translations keep their velocity, and rotations their angle: p, q and r of those follow from the
others, and are not read from x.
"""

import numpy as np

NAMES = @NAMES@
"""The coefficients, in the order of THETA."""

THETA = np.array([@THETA@])
"""Their values, SI."""

COVARIANCE = @COVARIANCE@
"""Their covariance; None if it is not known."""

OWN = np.array([@OWN@], dtype=bool)
"""Which of surge, sway, heave, roll, pitch, yaw the plant has."""


def mass(theta=THETA):
    """M, rigid body plus added mass (6, 6); zero where the plant has no entry."""
    mass = np.zeros((6, 6))
@MASS@    return mass


def forces(nu, down, theta=THETA):
    """C(M, nu) nu + damping + restoring (6,), on the left of M nu' + n = tau.

    `nu` (6,) is relative to the water; `down` (3,) is the world's down in body axes.
    """
    p = mass(theta) @ nu
    n = np.concatenate(
        [np.cross(nu[3:], p[:3]), np.cross(nu[:3], p[:3]) + np.cross(nu[3:], p[3:])]
    )
@FORCES@    return n


def acceleration(nu, down, tau, theta=THETA):
    """nu'_r (6,) on the plant's axes, zero on others."""
    rate = np.zeros(6)
    right = (np.asarray(tau, dtype=float) - forces(nu, down, theta))[OWN]
    rate[OWN] = np.linalg.solve(mass(theta)[np.ix_(OWN, OWN)], right)
    return rate


def to_body(q, world):
    """Takes a vector from the world to the body."""
    w, x, y, z = np.asarray(q) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
        ]
    ) @ np.asarray(world, dtype=float)


def hold(nu, down):
    """nu (6,) with p, q and r of rotations that the plant does not have that hold their angles."""
    nu = np.array(nu, dtype=float)
@HELD@    return nu


def derivative(x, tau, current=(0.0, 0.0, 0.0), theta=THETA):
    """dx/dt (13,), as scipy.integrate.solve_ivp takes it: lambda t, x: derivative(x, tau)."""
    x = np.asarray(x, dtype=float)
    q = x[3:7]
    down = to_body(q, (0.0, 0.0, 1.0))
    nu = hold(x[7:], down)
    water = to_body(q, current)
    relative = nu.copy()
    relative[:3] -= np.where(OWN[:3], water, 0.0)
    rate = acceleration(relative, down, tau, theta)
    # In body axes a constant current turns.
    rate[:3] -= np.where(OWN[:3], np.cross(nu[3:], water), 0.0)
    position = to_body((q[0], -q[1], -q[2], -q[3]), nu[:3])
    w, (a, b, c), (p, s, r) = q[0], q[1:], nu[3:]
    attitude = 0.5 * np.array(
        [-a * p - b * s - c * r, w * p + b * r - c * s, w * s + c * p - a * r, w * r + a * s - b * p]
    )
    return np.concatenate([position, attitude, rate])


def step(x, tau, h, current=(0.0, 0.0, 0.0), theta=THETA):
    """x after one classical Runge-Kutta step of h seconds; 0.02 s or less follow roll and pitch."""
    a = derivative(x, tau, current, theta)
    b = derivative(x + 0.5 * h * a, tau, current, theta)
    c = derivative(x + 0.5 * h * b, tau, current, theta)
    d = derivative(x + h * c, tau, current, theta)
    x = x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    x[3:7] /= np.linalg.norm(x[3:7])
    x[7:] = hold(x[7:], to_body(x[3:7], (0.0, 0.0, 1.0)))
    return x


def draws(count, seed):
    """Coefficients (count, p) as uncertain as they are, for bands around a prediction."""
    if COVARIANCE is None:
        raise ValueError("the covariance of these coefficients is not known")
    return np.random.default_rng(seed).multivariate_normal(THETA, COVARIANCE, count)
@ACTUATORS@
