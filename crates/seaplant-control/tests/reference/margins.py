"""Margins, growth and regulators of single axes by python-control and SciPy.

Prints the tables of ../margins.rs. Made with python-control 0.10.2, SciPy 1.17.1, NumPy 2.4.6.

Margins are those that `control.stability_margins` finds on a fine frequency response of the sampled
loop up to half of the sampling rate, and, at that rate itself, where the loop is real, what is left
to -1; plants are held exactly by `scipy.signal.cont2discrete`, delays of whole periods are shifts, and
a part of a period goes by a second, shorter hold. Growth is the greatest eigenvalue of the loop.
"""

import control
import numpy as np
from scipy.linalg import solve_continuous_are
from scipy.signal import cont2discrete

# mass, linear drag, quadratic drag, speed, bandwidth, damping, integral time or 0, exact, lag, delay, rate
CASES = [
    (100.0, 20.0, 80.0, 0.5, 0.10, 1.0, 0.0, False, 0.0, 0.0, 10.0),
    (100.0, 20.0, 80.0, 0.5, 0.15, 0.7, 0.0, False, 0.3, 0.0, 10.0),
    (100.0, 20.0, 80.0, 0.5, 0.10, 1.0, 0.0, True, 0.3, 0.2, 10.0),
    (12970.0, 0.0, 2231.0, 0.5, 0.05, 1.0, 40.0, False, 0.4, 0.1, 5.0),
    (0.5, 0.1, 1.5, 0.3, 0.30, 0.6, 4.0, False, 0.1, 0.05, 20.0),
    # Heave of a BlueROV2 Heavy (von Benzon 2022), at rest and at 0.5 m/s.
    (32.18, 33.0, 190.0, 0.0, 0.10, 1.0, 0.0, False, 0.0, 0.0, 10.0),
    (32.18, 33.0, 190.0, 0.5, 0.10, 1.0, 0.0, False, 0.0, 0.0, 10.0),
    # A delay of a fraction of a period.
    (100.0, 20.0, 80.0, 0.5, 0.10, 1.0, 0.0, False, 0.2, 0.13, 10.0),
]


def gains(mass, bandwidth, damping, integral):
    omega = 2 * np.pi * bandwidth
    kp = mass * omega**2
    return kp, 2 * damping * omega * mass, kp / integral if integral else 0.0


def held(a, b, seconds):
    """Returns matrices of the state after some seconds of a held input, by the state before and
    by the input."""
    ad, bd, *_ = cont2discrete((a, b, np.eye(len(a)), np.zeros((len(a), 1))), seconds)
    return ad, bd


def response(case, speed):
    m, dl, dq, _, hz, zeta, ti, exact, lag, delay, rate = case
    kp, kd, ki = gains(m, hz, zeta, ti)
    slope = dl + 2 * dq * speed
    kd -= slope if exact else 0.0
    period = 1.0 / rate
    a = np.array([[0, 1], [0, -slope / m]])
    b = np.array([[0.0], [1 / m]])
    if lag:
        a = np.block([[a, b], [np.zeros((1, 2)), np.array([[-1 / lag]])]])
        b = np.array([[0.0], [0.0], [1 / lag]])
    whole = int(np.floor(delay / period + 1e-9))
    rest = delay - whole * period
    full, now = held(a, b, period)
    late = np.zeros_like(now)
    if rest > 1e-9:
        after, now = held(a, b, period - rest)
        late = after @ held(a, b, rest)[1]
    omega = np.pi * rate * np.logspace(-5, -1e-7, 4_001)
    z = np.exp(1j * omega * period)
    inputs = now[None] + late[None] / z[:, None, None]
    state = np.linalg.solve(z[:, None, None] * np.eye(len(a)) - full, inputs)[..., 0]
    law = kp * state[:, 0] + kd * state[:, 1] + ki * period / (z - 1) * state[:, 0]
    return omega, law / z**whole


def margins(case):
    worst = []
    for speed in (0.0, case[3]):
        omega, loop = response(case, speed)
        gm, pm, _, _, wpm, _ = control.stability_margins(
            control.frd(loop, omega), returnall=True
        )
        least = np.argmin(pm)
        rising = [g for g in np.atleast_1d(gm) if g > 1]
        if loop[-1].real < 0:
            rising.append(-1 / loop[-1].real)
        delay = np.radians(pm[least]) / wpm[least]
        worst.append((pm[least], min(rising, default=np.inf), delay, wpm[least] / 2 / np.pi))
    least = min(worst)
    return (
        least[0],
        min(one[1] for one in worst),
        min(one[2] for one in worst),
        least[3],
    )


def growth(case, mass, drag):
    """Computes the growth for a vehicle with other mass and drag under the gains for `case`, at
    rest and at speed."""
    m, dl, dq, v, hz, zeta, ti, _, lag, delay, rate = case
    kp, kd, ki = gains(m, hz, zeta, ti)
    found = 0.0
    for speed in (0.0, v):
        slope = drag * (dl + 2 * dq * speed)
        a = np.array([[0, 1, 0], [0, -slope / (mass * m), 1 / (mass * m)], [0, 0, -1 / lag]])
        b = np.array([[0.0], [0.0], [1 / lag]])
        ad, bd, *_ = cont2discrete((a, b, np.eye(3), np.zeros((3, 1))), 1 / rate)
        late = int(np.ceil(delay * rate - 1e-9))
        size = 4 + late
        step = np.zeros((size, size))
        step[:3, :3] = ad
        step[3, 3], step[3, 0] = 1.0, 1 / rate
        law = np.zeros(size)
        law[[0, 1, 3]] = -kp, -kd, -ki
        if late == 0:
            step[:3] += bd @ law[None, :]
        else:
            step[:3, 4] = bd[:, 0]
            for k in range(late - 1):
                step[4 + k, 5 + k] = 1.0
            step[-1] = law
        if not ti:
            keep = [k for k in range(size) if k != 3]
            step = step[np.ix_(keep, keep)]
        found = max(found, np.abs(np.linalg.eigvals(step)).max())
    return found


print("phase margin deg, gain margin, delay margin s, crossover Hz")
for case in CASES:
    print(case, "->", ", ".join(f"{x:.6g}" for x in margins(case)))

print("growth by mass and drag of the vehicle over those of the model")
for case in (CASES[1], CASES[3], CASES[4]):
    for mass in (0.1, 0.2, 0.4, 1.0, 3.0):
        print(case, mass, f"{growth(case, mass, 1.0):.6f}")

print("regulator: K_p, K_d")
for m, d, error, force in (
    (100.0, 20.0, 0.1, 40.0),
    (0.5, 0.2, 0.05, 1.0),
    (12970.0, 0.0, 0.5, 900.0),
):
    a, b = np.array([[0, 1], [0, -d / m]]), np.array([[0], [1 / m]])
    q, r = np.diag([1 / error**2, 0]), np.array([[1 / force**2]])
    p = solve_continuous_are(a, b, q, r)
    k = np.linalg.solve(r, b.T @ p)[0]
    print(m, d, error, force, "->", f"{k[0]:.9g}, {k[1]:.9g}")
