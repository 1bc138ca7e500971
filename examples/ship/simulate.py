"""Trials of the tanker model KVLCC2 L7, by the MMG standard method, apart from Seaplant.

H. Yasukawa, Y. Yoshimura: Introduction of MMG standard method for ship maneuvering predictions,
J. Mar. Sci. Technol. 20 (2015), tables 1 to 3 (model L7). Speeds are of the midship point.
Needs numpy. `python simulate.py` writes the logs beside it and prints the turning circle.
"""

from pathlib import Path

import numpy as np

RHO, L, B, D, VOLUME, X_G = 1000.0, 7.0, 1.27, 0.46, 3.27, 0.25
D_P, H_R, A_R = 0.204, 0.345, 0.0539
T_P, W_P0, X_P, C_1 = 0.220, 0.40, -0.48, 2.0
K_T = (0.2931, -0.2753, -0.1385)
T_R, A_H, X_H, L_R, EPSILON, KAPPA, F_ALPHA = 0.387, 0.312, -0.464, -0.710, 1.09, 0.50, 2.747
M = RHO * VOLUME
M_X, M_Y = (0.5 * RHO * L**2 * D * x for x in (0.022, 0.223))
J_Z = 0.5 * RHO * L**4 * D * 0.011
I_Z = M * (0.25 * L) ** 2


def forces(u, v, r, n, delta):
    """X, Y, N of hull, propeller and rudder."""
    speed = max(np.hypot(u, v), 1e-6)
    vp, rp = v / speed, r * L / speed
    area = 0.5 * RHO * L * D * speed**2
    x = area * (-0.022 - 0.040 * vp**2 + 0.002 * vp * rp + 0.011 * rp**2 + 0.771 * vp**4)
    y = area * (
        -0.315 * vp
        + 0.083 * rp
        - 1.607 * vp**3
        + 0.379 * vp**2 * rp
        - 0.391 * vp * rp**2
        + 0.008 * rp**3
    )
    moment = (
        area
        * L
        * (
            -0.137 * vp
            - 0.049 * rp
            - 0.030 * vp**3
            - 0.294 * vp**2 * rp
            + 0.055 * vp * rp**2
            - 0.013 * rp**3
        )
    )
    beta = np.arctan2(-v, u)
    beta_p = beta - X_P * rp
    c_2 = 1.6 if beta_p > 0 else 1.1
    flow = (1 - W_P0) * (1 + (1 - np.exp(-C_1 * abs(beta_p))) * (c_2 - 1))
    j = u * flow / (n * D_P)
    k_t = K_T[0] + K_T[1] * j + K_T[2] * j**2
    x += (1 - T_P) * RHO * n**2 * D_P**4 * k_t
    beta_r = beta - L_R * rp
    gamma = 0.395 if beta_r < 0 else 0.640
    v_r = speed * gamma * beta_r
    eta = D_P / H_R
    race = 1 + KAPPA * (np.sqrt(1 + 8 * k_t / (np.pi * j**2)) - 1)
    u_r = EPSILON * u * flow * np.sqrt(eta * race**2 + 1 - eta)
    f_n = 0.5 * RHO * A_R * (u_r**2 + v_r**2) * F_ALPHA * np.sin(delta - np.arctan2(v_r, u_r))
    x -= (1 - T_R) * f_n * np.sin(delta)
    y -= (1 + A_H) * f_n * np.cos(delta)
    moment -= (-0.5 * L + A_H * X_H * L) * f_n * np.cos(delta)
    return x, y, moment


MASS = np.array(
    [
        [M + M_X, 0, 0],
        [0, M + M_Y, X_G * M],
        [0, X_G * M, I_Z + X_G**2 * M + J_Z],
    ]
)


def rate(state, n, delta):
    u, v, r, psi = state[:4]
    x, y, moment = forces(u, v, r, n, delta)
    right = [
        x + (M + M_Y) * v * r + X_G * M * r**2,
        y - (M + M_X) * u * r,
        moment - X_G * M * u * r,
    ]
    c, s = np.cos(psi), np.sin(psi)
    return np.array([*np.linalg.solve(MASS, right), r, u * c - v * s, u * s + v * c])


def run(times, speed_of, angle_of, u0):
    """States [u v r psi north east] at `times`; the rudder turns at 15.8 degrees a second."""
    state, delta = np.array([u0, 0, 0, 0, 0, 0.0]), 0.0
    rows, angles = [], []
    for k, t in enumerate(times):
        rows.append(state.copy())
        angles.append(delta)
        h = (times[k + 1] - t if k + 1 < len(times) else 0.0) / 10
        for i in range(10):
            goal = angle_of(t, state)
            delta += np.clip(goal - delta, -np.radians(15.8) * h, np.radians(15.8) * h)
            n = speed_of(t + i * h)
            a = rate(state, n, delta)
            b = rate(state + h / 2 * a, n, delta)
            c = rate(state + h / 2 * b, n, delta)
            d = rate(state + h * c, n, delta)
            state = state + h / 6 * (a + 2 * b + 2 * c + d)
    return np.array(rows), np.array(angles)


def service_speed(u):
    """The propeller speed, rev/s, that holds a speed."""
    low, high = 1.0, 40.0
    for _ in range(60):
        n = 0.5 * (low + high)
        low, high = (n, high) if forces(u, 0, 0, n, 0)[0] < 0 else (low, n)
    return n


def circle(u0=1.179, angle=35.0):
    """Advance, transfer and tactical diameter, in ship lengths."""
    times = np.arange(0, 240, 0.1)
    n = service_speed(u0)
    rows, _ = run(times, lambda t: n, lambda t, s: np.radians(angle), u0)
    at = lambda deg: rows[np.argmax(rows[:, 3] >= np.radians(deg))]
    return at(90)[4] / L, at(90)[5] / L, at(180)[5] / L


def log(name, seed, seconds=400.0):
    """A trial with a restless rudder and some changes of propeller speed."""
    random = np.random.default_rng(seed)
    times = np.arange(0, seconds, 0.5)
    n0 = service_speed(1.179)
    goals = np.radians(random.uniform(-35, 35, 60))
    dwell = np.cumsum(random.uniform(6, 22, 60))
    speeds = n0 * random.uniform(0.6, 1.25, 20)
    rows, angles = run(
        times,
        lambda t: speeds[int(t // 45) % 20],
        lambda t, s: goals[np.searchsorted(dwell, t)],
        1.0,
    )
    noise = lambda std: random.normal(0, std, len(times))
    columns = [
        times,
        rows[:, 0] + noise(0.003),
        rows[:, 1] + noise(0.003),
        np.degrees(rows[:, 2]) + noise(0.02),
        np.degrees(rows[:, 3]) + noise(0.05),
        [60 * speeds[int(t // 45) % 20] for t in times],
        np.degrees(angles),
    ]
    head = "time [s],u [m/s],v [m/s],r [deg/s],heading [deg],propeller [rpm],rudder [deg]"
    formats = ["%.1f", "%.4f", "%.4f", "%.3f", "%.2f", "%.1f", "%.2f"]
    path = Path(__file__).with_name(name)
    np.savetxt(path, np.transpose(columns), formats, ",", header=head, comments="")


if __name__ == "__main__":
    advance, transfer, diameter = circle()
    print(
        f"35 deg: advance {advance:.2f} L, transfer {transfer:.2f} L, diameter {diameter:.2f} L"
    )
    for number in (1, 2, 3):
        log(f"fit-{number}.csv", number)
    log("aside.csv", 4)
