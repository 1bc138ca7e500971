

THRUSTERS = [
@THRUSTERS@]

ALLOCATION = np.array(
    [
@ALLOCATION@    ]
)
"""The wrench of one newton of each thruster, a row each."""

NEUTRAL = [@NEUTRAL@]
"""Inputs with which propellers stand still."""

LAG_S = np.array(
    [
@LAG@    ]
)
FORCE_LAG_S = np.array([@FORCE_LAG@])
DELAY_S = np.array([@DELAY@])
REVERSE_RATIO = np.array([@RATIO@])
"""Between inputs and thrust, by axis, lags also by thruster, as fitted; 0, 0, 0 and 1 where nothing
was found."""


def power(forward, reverse, exponent, deadband, neutral, x):
    s = ca.fmax(0.0, ca.fabs(x - neutral) - deadband) ** exponent
    return ca.if_else(x < neutral, -reverse * s, forward * s)


def interpolated(x, points, values):
    """Straight lines between points, and what stands at the ends beyond them."""
    y = values[0]
    for a, b, low, high in zip(points[:-1], points[1:], values[:-1], values[1:], strict=True):
        y = y + (high - low) / (b - a) * ca.fmin(ca.fmax(x - a, 0.0), b - a)
    return y


CURVES = [
@CURVES@]


def pushed(speed, axis, volts):
    """The force of all thrusters on an axis."""
    force = 0.0
    for k, curve in enumerate(CURVES):
        thrust = curve(speed[k], volts)
        force += ALLOCATION[k, axis] * ca.if_else(
            thrust < 0.0, REVERSE_RATIO[axis] * thrust, thrust
        )
    return force


def actuated():
    """f(z, u, p) -> zdot, tau: the plant behind its thrusters.

    z is x (13,), the inputs that propellers have reached (6 n,: those of surge, of sway, ...) and
    lagging forces (6,). u (6 n,) has for each axis the inputs of n thrusters DELAY_S ago: a delay is no
    differential equation, and is the caller's. p is PARAMETERS with the supply voltage [V] behind it.
    """
    x, wrench, p, xdot = symbols()
    n = len(THRUSTERS)
    speed, force, u = ca.SX.sym("s", 6 * n), ca.SX.sym("f", 6), ca.SX.sym("u", 6 * n)
    volts = ca.SX.sym("supply_v")
    turning, rising, tau = ca.SX.zeros(6 * n), ca.SX.zeros(6), ca.SX.zeros(6)
    for axis in range(6):
        reached = u[axis * n : (axis + 1) * n]
        for k, lag in enumerate(LAG_S[axis]):
            if lag > 0.0:
                turning[axis * n + k] = (u[axis * n + k] - speed[axis * n + k]) / lag
                reached[k] = speed[axis * n + k]
        tau[axis] = pushed(reached, axis, volts)
        if FORCE_LAG_S[axis] > 0.0:
            rising[axis] = (tau[axis] - force[axis]) / FORCE_LAG_S[axis]
            tau[axis] = force[axis]
    zdot = ca.vertcat(ca.substitute(xdot, wrench, tau), turning, rising)
    z, parameters = ca.vertcat(x, speed, force), ca.vertcat(p, volts)
    names = ["z", "u", "p"], ["zdot", "tau"]
    return ca.Function("actuated", [z, u, parameters], [zdot, tau], *names)


def start(x, inputs, supply_v=0.0):
    """z of a state and of thrusters whose inputs have always been these."""
    force = [float(ca.DM(pushed(inputs, axis, supply_v))) for axis in range(6)]
    return np.concatenate([x, np.tile(inputs, 6), force])
