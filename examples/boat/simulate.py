"""Drives of a catamaran with two propellers, as a satellite receiver and a compass log them.

The boat moves in its plane by Newton's law in axes that turn with it: a hull in strips, waves of
gusts (a force that forgets itself in 15 s), propellers by the square of their speed. The antenna
stands aft and to starboard. Nothing of this is Seaplant's. Needs numpy.
`python simulate.py` writes the logs beside it.
"""

from pathlib import Path

import numpy as np

M_11, M_22, M_23, I_33 = 85.3, 162.5, 11.0, 40.5
AHEAD, ASTERN, OUT = 0.01108, 0.006445, 0.395  # N/(rad/s)^2, N/(rad/s)^2, m
ANTENNA = np.array([-0.5, 0.25])  # m
POSITION_STD, HEADING_STD, GUST = 0.02, 0.003, np.array([4.0, 4.0, 2.0])  # m, rad, N and N m
SEED, STEP, SAMPLE, LENGTH = 20, 0.02, 10, 240.0
LATITUDE, LONGITUDE = np.radians(59.9), np.radians(10.7)
STRIPS = (np.arange(40) + 0.5) / 20 - 1


def acceleration(velocity, shafts, gust):
    """Of surge, sway and yaw at speeds of the port and the starboard shaft, rad/s."""
    u, v, r = velocity
    port, starboard = (AHEAD * n * n if n > 0 else -ASTERN * n * n for n in shafts)
    across = v + STRIPS * r
    strip = 0.5 * 1025.0 * 0.195 / 20 * np.abs(across) * across
    x = port + starboard - 60.0 * u - 12.0 * abs(u) * u
    y = -162.5 * v - strip.sum()
    n = OUT * (port - starboard) - 40.5 * r * (1 + 10 * abs(r)) - (STRIPS * strip).sum()
    side = M_22 * v + M_23 * r
    x, y, n = np.array([x, y, n]) + gust + [side * r, -M_11 * u * r, M_11 * u * v - side * u]
    x_dot = x / M_11
    v_dot, r_dot = np.linalg.solve([[M_22, M_23], [M_23, I_33]], [y, n])
    return np.array([x_dot, v_dot, r_dot])


def over_ground(place, velocity):
    """North, east and heading by the velocity of the boat."""
    cos, sin = np.cos(place[2]), np.sin(place[2])
    u, v, r = velocity
    return np.array([cos * u - sin * v, sin * u + cos * v, r])


def drive(random):
    """Rows of time, heading, both shafts and the antenna's place, five a second."""
    place, velocity, gust = np.zeros(3), np.zeros(3), np.zeros(3)
    shafts, order, until = np.zeros(2), np.zeros(2), np.zeros(2)
    fade = np.exp(-STEP / 15.0)
    rows = []
    for k in range(int(LENGTH / STEP)):
        t = k * STEP
        if k % SAMPLE == 0:
            for side in np.flatnonzero(t >= until):
                order[side], until[side] = random.uniform(-40, 100), t + random.uniform(3, 12)
            shafts = shafts + 0.4 * (order - shafts)
            cos, sin = np.cos(place[2]), np.sin(place[2])
            antenna = place[:2] + np.array([[cos, -sin], [sin, cos]]) @ ANTENNA
            antenna += POSITION_STD * random.standard_normal(2)
            heading = place[2] + HEADING_STD * random.standard_normal()
            rows.append([t, heading, *shafts, *antenna])
        gust = fade * gust + np.sqrt(1 - fade**2) * GUST * random.standard_normal(3)
        a = acceleration(velocity, shafts, gust)
        b = acceleration(velocity + STEP / 2 * a, shafts, gust)
        c = acceleration(velocity + STEP / 2 * b, shafts, gust)
        d = acceleration(velocity + STEP * c, shafts, gust)
        after = velocity + STEP / 6 * (a + 2 * b + 2 * c + d)
        half = place + STEP / 2 * over_ground(place, velocity)
        place = place + STEP * over_ground(half, (velocity + after) / 2)
        velocity = after
    return rows


def write(path, rows):
    """A table as a logger of a boat has it."""
    w = 1 - 6.69437999014e-3 * np.sin(LATITUDE) ** 2
    prime = 6378137.0 / np.sqrt(w)
    meridian = prime * (1 - 6.69437999014e-3) / w
    lines = [
        "time [s],heading [deg],port propeller [rpm],starboard propeller [rpm],"
        "latitude [deg],longitude [deg]"
    ]
    for t, heading, port, starboard, north, east in rows:
        latitude = np.degrees(LATITUDE + north / meridian)
        longitude = np.degrees(LONGITUDE + east / (prime * np.cos(LATITUDE)))
        rpm = [30 / np.pi * n for n in (port, starboard)]
        lines.append(
            f"{t:.1f},{np.degrees(heading) % 360:.2f},{rpm[0]:.1f},{rpm[1]:.1f},"
            f"{latitude:.8f},{longitude:.8f}"
        )
    path.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    source = np.random.default_rng(SEED)
    for name in ("fit-1", "fit-2", "aside"):
        write(Path(__file__).parent / f"{name}.csv", drive(source))
