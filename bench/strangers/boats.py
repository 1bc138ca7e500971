"""Draws boats that move in their plane, drives them, writes their logs as users have them, and judges plants of them.

Shares nothing with Seaplant but the files: the state is momentum (Kirchhoff's equations), the rudder is a foil
in a race, drag may be cross-flow in strips. Each boat has two propellers or a propeller and a rudder, one
of the sets of `INSTRUMENTS`, and one to three faults out of `FAULTS`.

    boats.py PROGRAM OUT NUMBER SEED [FAULT ...]   # draws OUT/SEED ... where they are absent, and judges them

With faults named, each boat has these; `healthy` has none; names of `INSTRUMENTS` and `ALSO` choose these. Wrong: a mass or the inertia that is off by more
than 10 % and outside its interval.
"""

import json

import numpy as np
from running import chosen_faults, faults, judge_drawn

RHO, AIR, G = 1025.0, 1.2, 9.81
STEP = 0.02
SECONDS = (300.0, 300.0, 150.0)
TRIALS = ("first", "second", "held-out")
AXES = ("surge", "sway", "yaw")
STRIPS = (np.arange(11) + 0.5) / 11 - 0.5
LATITUDE, LONGITUDE = np.radians(59.9), np.radians(10.7)

# Rate, Hz, standard deviation and that of a slow error, m or m/s.
INSTRUMENTS = {
    "rtk": {"kind": "fixes", "hz": 5.0, "std": 0.015, "slow": 0.0},
    "rtk_slow": {"kind": "fixes", "hz": 1.0, "std": 0.015, "slow": 0.0},
    "gnss": {"kind": "fixes", "hz": 5.0, "std": 0.05, "slow": 0.7},
    "course": {"kind": "course", "hz": 5.0, "std": 0.04, "slow": 0.0},
    "doppler": {"kind": "north", "hz": 5.0, "std": 0.03, "slow": 0.0},
    "both": {"kind": "both", "hz": 5.0, "std": 0.03, "slow": 0.7},
}
# What else can be asked for.
ALSO = ("healthy", "rudder", "propellers", "gyroscope", "no_gyroscope")
FAULTS, fault = faults()


@fault
def lag(s, g):
    s["lag"] = g.uniform(0.1, 0.6)


@fault
def delay(s, g):
    s["delay"] = g.uniform(0.1, 0.4)


@fault
def reverse(s, g):
    s["reverse"] = g.uniform(0.5, 0.85)


@fault
def exponent(s, g):
    s["exponent"] = g.uniform(1.75, 2.15)


@fault
def advance(s, g):
    s["advance"] = g.uniform(0.1, 0.4)


@fault
def unequal(s, g):
    # Nothing shows the scale of both together.
    s["gain"] = 1.0 + g.uniform(-0.12, 0.12) * np.array([1.0, -1.0])


@fault
def sag(s, g):
    s["sag"] = g.uniform(0.05, 0.15)


@fault
def slow_thrust_log(s, g):
    s["thrust_hz"] = g.choice([1.0, 2.0])


@fault
def wind(s, g):
    s["wind"] = g.uniform(2.0, 8.0)


@fault
def gusts(s, g):
    s["gusts"] = g.uniform(0.05, 0.15)


@fault
def waves(s, g):
    s["waves"] = g.uniform(0.05, 0.3)


@fault
def current(s, g):
    s["current"] = g.uniform(0.1, 0.5)


@fault
def current_varies(s, g):
    s["current"], s["current_std"] = g.uniform(0.0, 0.3), g.uniform(0.03, 0.1)


@fault
def strips(s, g):
    s["strips"] = True


@fault
def hull_lift(s, g):
    s["hull_lift"] = g.uniform(0.3, 1.0)
    s["hull_lift_at"] = s["length"] * g.uniform(0.1, 0.3)


@fault
def skeg(s, g):
    s["skeg_at"] = s["length"] * g.uniform(-0.3, -0.1)


@fault
def noise(s, g):
    s["noise"] = g.uniform(2.0, 5.0)


@fault
def jumps(s, g):
    s["jumps"] = g.uniform(0.002, 0.01)


@fault
def gap(s, g):
    s["gap"] = g.uniform(5.0, 30.0)


@fault
def late_fixes(s, g):
    s["late"] = g.uniform(0.1, 0.5)


@fault
def antenna_elsewhere(s, g):
    s["claimed_antenna"] = np.zeros(2)


@fault
def compass_turned(s, g):
    s["compass"] = np.radians(g.uniform(2.0, 8.0)) * g.choice([-1, 1])


@fault
def compass_deviates(s, g):
    s["deviation"] = np.radians(g.uniform(1.0, 5.0))


@fault
def rudder_order(s, g):
    s["logs_order"] = True


def draw(seed, wanted=()):
    """Draws a boat: hull, propulsion, sensors and faults, at random or as requested."""
    g = np.random.default_rng(seed)
    length = float(np.exp(g.uniform(np.log(0.8), np.log(6.0))))
    beam, draught = length * g.uniform(0.2, 0.5), length * g.uniform(0.05, 0.12)
    mass = RHO * length * beam * draught * g.uniform(0.35, 0.65)
    inertia = mass * (length * g.uniform(0.22, 0.28)) ** 2
    centre = length * g.uniform(-0.04, 0.04)
    added = [
        mass * g.uniform(0.04, 0.2),
        mass * g.uniform(0.4, 1.1),
        inertia * g.uniform(0.3, 0.9),
    ]
    across = mass * centre + added[1] * length * g.uniform(-0.03, 0.03)
    m = np.array(
        [
            [mass + added[0], 0, 0],
            [0, mass + added[1], across],
            [0, across, inertia + mass * centre**2 + added[2]],
        ]
    )
    top = g.uniform(0.25, 0.45) * np.sqrt(G * length)
    push = 2 * m[0, 0] * top / (g.uniform(2.0, 5.0) * np.sqrt(length))
    part = g.uniform(0.1, 0.5)
    cross = 0.5 * RHO * length * draught * g.uniform(0.7, 1.3)
    turn = g.uniform(0.25, 0.6) / length**0.5
    steer = push * 0.5 * beam * g.uniform(0.6, 0.9)
    s = {
        "seed": seed,
        "length": length,
        "size": [length, beam, draught],
        "M": m,
        "top": top,
        "push": push,
        "turn": turn,
        "linear": np.array(
            [
                part * push / top,
                cross * 0.3 * top * g.uniform(0.2, 1.0),
                part * steer / turn,
            ]
        ),
        "quadratic": np.array(
            [(1 - part) * push / top**2, cross, (1 - part) * steer / turn**2]
        ),
        "cross": cross,
        "steers": bool(g.uniform() < 0.4),
        "arm": 0.4 * beam,
        "aft": -0.42 * length,
        "rudder_area": 0.035 * length * draught * g.uniform(0.8, 1.5),
        "rudder_slope": g.uniform(2.0, 3.0),
        "race": g.uniform(0.5, 1.0),
        "rudder_rate": np.radians(g.uniform(15.0, 60.0)),
        "antenna": np.array([length * g.uniform(-0.35, 0.35), beam * g.uniform(-0.4, 0.4)]),
        "max_rate": g.uniform(60.0, 250.0),
        "lag": 0.0,
        "delay": 0.0,
        "reverse": 1.0,
        "stated_reverse": g.uniform(0.6, 1.0),
        "exponent": 2.0,
        "advance": 0.0,
        "gain": np.ones(2),
        "sag": 0.0,
        "thrust_hz": float(g.choice([5.0, 10.0])),
        "wind": 0.0,
        "gusts": g.uniform(0.005, 0.02),
        "waves": 0.0,
        "current": 0.0,
        "current_std": 0.0,
        "strips": False,
        "hull_lift": 0.0,
        "hull_lift_at": 0.0,
        "skeg_at": 0.0,
        "noise": 1.0,
        "jumps": 0.0,
        "gap": 0.0,
        "late": 0.0,
        "compass": 0.0,
        "deviation": 0.0,
        "logs_order": False,
        "imu_hz": float(g.choice([10.0, 20.0])),
        "has_gyro": bool(g.uniform() < 0.75),
        "states_mass": bool(g.uniform() < 0.5),
        "mass": mass,
        "inertia": inertia,
        "centre": centre,
    }
    s["claimed_antenna"] = s["antenna"]
    instrument = str(g.choice(list(INSTRUMENTS)))
    chosen = g.choice(list(FAULTS), size=g.integers(1, 4), replace=False)
    for name in wanted:
        instrument = name if name in INSTRUMENTS else instrument
        s["steers"] = {"rudder": True, "propellers": False}.get(name, s["steers"])
        s["has_gyro"] = {"gyroscope": True, "no_gyroscope": False}.get(name, s["has_gyro"])
    s["instrument"] = instrument
    s["faults"] = chosen_faults(wanted, FAULTS, chosen)
    for name in s["faults"]:
        FAULTS[name](s, g)
    s["thrusters"] = 1 if s["steers"] else 2
    s["max_force"] = push / s["thrusters"]
    if s["steers"]:
        # A rudder turns about as fast as two propellers would.
        arm = -s["aft"]
        side = 0.5 * RHO * s["rudder_area"] * s["rudder_slope"] * 0.4 * (0.6 * top) ** 2
        s["linear"][2], s["quadratic"][2] = (
            part * side * arm / turn,
            (1 - part) * side * arm / turn**2,
        )
    return s, g


def resistance(s, nu):
    """Returns the force of the water on the hull."""
    u, v, r = nu.T
    force = -(s["linear"] + s["quadratic"] * np.abs(nu)) * nu
    if s["skeg_at"]:
        flow = v + s["skeg_at"] * r
        side = -(s["linear"][1] + s["quadratic"][1] * np.abs(flow)) * flow
        force[:, 1] = side
        force[:, 2] += s["skeg_at"] * side
    if s["strips"]:
        x = STRIPS * s["length"]
        flow = v[:, None] + x * r[:, None]
        side = -s["cross"] / 11 * np.abs(flow) * flow
        force[:, 1] = -s["linear"][1] * v + side.sum(1)
        force[:, 2] = -s["linear"][2] * r + (side * x).sum(1)
    if s["hull_lift"]:
        area = s["length"] * s["size"][2]
        side = -0.5 * RHO * area * s["hull_lift"] * np.abs(u) * (v + s["hull_lift_at"] * r)
        force[:, 1] += side
        force[:, 2] += s["hull_lift_at"] * side
    return force


def propelled(s, speed, nu, angle, done):
    """Returns the force of propellers and rudder, by trial."""
    n = speed / s["max_rate"]
    thrust = np.sign(n) * np.abs(n) ** s["exponent"] * s["max_force"]
    thrust = np.where(thrust < 0, s["stated_reverse"] * s["reverse"] * thrust, thrust)
    thrust = thrust * (1 - s["sag"] * done)[:, None]
    y = np.array([0.0]) if s["steers"] else np.array([-s["arm"], s["arm"]])
    if s["advance"]:
        own = nu[:, :1] - y * nu[:, 2:]
        thrust = thrust - s["advance"] * s["max_force"] * np.abs(n) * own / s["top"]
    if not s["steers"]:
        thrust = thrust * s["gain"]
    force = np.zeros((len(nu), 3))
    force[:, 0] = thrust.sum(1)
    force[:, 2] = -(thrust * y).sum(1)
    if s["steers"]:
        disc = np.pi * (0.8 * s["size"][2]) ** 2 / 4
        # By momentum theory the race of a propeller that pushes ahead has 2 T/(ρ A) more of speed squared.
        behind = nu[:, 0] * np.abs(nu[:, 0])
        behind += s["race"] * 2 * np.maximum(thrust[:, 0], 0) / (RHO * disc)
        race = np.sqrt(np.abs(behind)) * np.sign(behind)
        aside = nu[:, 1] + s["aft"] * nu[:, 2]
        attack = angle + np.arctan2(aside, race)
        normal = 0.5 * RHO * s["rudder_area"] * s["rudder_slope"] * np.sin(attack)
        normal *= race**2 + aside**2
        # A positive angle turns the bow to starboard: its force pushes the stern to port.
        force[:, 0] -= normal * np.sin(angle)
        force[:, 1] -= normal * np.cos(angle)
        force[:, 2] -= s["aft"] * normal * np.cos(angle)
    return force


def blown(s, heading, over_ground, air):
    """Returns the force of the wind."""
    cos, sin = np.cos(heading), np.sin(heading)
    x = cos * air[:, 0] + sin * air[:, 1] - over_ground[:, 0]
    y = -sin * air[:, 0] + cos * air[:, 1] - over_ground[:, 1]
    length, beam, _ = s["size"]
    speed = np.hypot(x, y)
    front, side = 0.35 * beam * beam, 0.2 * length * beam
    return np.stack(
        [
            0.5 * AIR * front * 0.7 * speed * x,
            0.5 * AIR * side * 0.9 * speed * y,
            0.5 * AIR * side * length * 0.08 * speed * y,
        ],
        1,
    )


def simulate(s, g):
    """Drives all trials at once; returns the history of every step."""
    n, count = len(TRIALS), int(max(SECONDS) / STEP)
    inverse = np.linalg.inv(s["M"])
    drives = s["thrusters"] + int(s["steers"])
    hold = max(1.0, np.sqrt(s["length"]))
    times = g.uniform(2.5 * hold, 9.0 * hold, (n, drives, 150)).cumsum(2)
    levels = g.uniform(-0.4, 1.0, (n, drives, 151))
    if s["steers"]:
        levels[:, 0] = np.where(levels[:, 0] < -0.25, levels[:, 0], np.abs(levels[:, 0]))
        levels[:, 1] = g.uniform(-1, 1, (n, 151)) * np.radians(30)
    velocity = np.zeros((n, 3))
    water = s["current"] * np.array([np.cos(1.0), np.sin(1.0)]) * np.ones((n, 1))
    drift = np.zeros((n, 2))
    heading = g.uniform(-np.pi, np.pi, n)
    place = np.zeros((n, 2))
    from_way = g.uniform(0, 2 * np.pi)
    air_mean = s["wind"] * np.array([np.cos(from_way), np.sin(from_way)])
    air = np.zeros((n, 2))
    pushing, speed, angle = np.zeros((n, 3)), np.zeros((n, s["thrusters"])), np.zeros(n)
    size = s["push"] * np.array([1.0, 0.6, 0.4 * s["arm"] + 0.1 * s["length"]])
    wave_rate = 2 * np.pi / (g.uniform(1.5, 3.0, (3, 1, 1)) * np.sqrt(s["length"]))
    wave_phase = g.uniform(0, 2 * np.pi, (3, n, 3))
    late = round(s["delay"] / STEP)
    heard = np.zeros((count + late + 1, n, drives))
    widths = {
        "nu": 3,
        "heading": 1,
        "place": 2,
        "ground": 2,
        "order": drives,
        "angle": 1,
    }
    out = {name: np.zeros((count, n, width)) for name, width in widths.items()}
    spent = np.r_[0, np.cumsum(SECONDS)[:-1]]

    def turned(vector, by):
        cos, sin = np.cos(by), np.sin(by)
        x, y = vector.T
        return np.stack([cos * x - sin * y, sin * x + cos * y], 1)

    velocity[:, :2] = -turned(water, -heading)
    momentum = velocity @ s["M"].T

    def rates(momentum, heading, force, water):
        nu = momentum @ inverse.T
        u, v, r = nu.T
        p1, p2, _ = momentum.T
        whole = force + resistance(s, nu) + np.stack([r * p2, -r * p1, v * p1 - u * p2], 1)
        return whole, r, turned(nu[:, :2], heading) + water

    for k in range(count):
        t = k * STEP
        if k % 5 == 0:
            at = [[np.searchsorted(times[a, b], t) for b in range(drives)] for a in range(n)]
            order = np.take_along_axis(levels, np.array(at)[:, :, None], 2)[:, :, 0]
        heard[k + late] = order
        now = heard[k]
        goal = np.round(now[:, : s["thrusters"]] * 200) / 200 * s["max_rate"]
        keep = np.exp(-STEP / s["lag"]) if s["lag"] else 0.0
        speed = goal + keep * (speed - goal)
        if s["steers"]:
            most = s["rudder_rate"] * STEP
            angle = angle + np.clip(now[:, 1] - angle, -most, most)
        fade = np.exp(-STEP / 10.0)
        pushing = fade * pushing + np.sqrt(1 - fade**2) * s["gusts"] * size * g.standard_normal(
            (n, 3)
        )
        if s["current_std"]:
            drift += -drift * STEP / 60 + s["current_std"] * np.sqrt(2 * STEP / 60) * (
                g.standard_normal((n, 2))
            )
        nu = momentum @ inverse.T
        ground = turned(nu[:, :2], heading) + water + drift
        force = propelled(s, speed, nu, angle, (t + spent) / sum(SECONDS)) + pushing
        if s["wind"]:
            fade = np.exp(-STEP / 8.0)
            air = fade * air + np.sqrt(1 - fade**2) * 0.2 * s["wind"] * g.standard_normal(
                (n, 2)
            )
            force += blown(s, heading, turned(ground, -heading), air_mean + air)
        if s["waves"]:
            swing = np.sin(wave_rate * t + wave_phase).sum(0)
            force += s["waves"] * size * swing
        out["nu"][k], out["heading"][k, :, 0], out["place"][k] = nu, heading, place
        out["ground"][k], out["angle"][k, :, 0] = ground, angle
        out["order"][k] = now if late == 0 else order
        state = (momentum, heading, place)
        around = (force, water + drift)
        a = rates(*state[:2], *around)
        b = rates(*(x + STEP / 2 * d for x, d in zip(state[:2], a)), *around)
        c = rates(*(x + STEP / 2 * d for x, d in zip(state[:2], b)), *around)
        d = rates(*(x + STEP * e for x, e in zip(state[:2], c)), *around)
        momentum, heading, place = (
            x + STEP / 6 * (p + 2 * q + 2 * y + z) for x, p, q, y, z in zip(state, a, b, c, d)
        )
        if not np.isfinite(momentum).all():
            raise FloatingPointError(f"boat {s['seed']} runs away at {t:.1f} s")
    return out


def table(path, header, times, columns):
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [",".join(["time (s)", *header])]
    for t, row in zip(times, columns):
        lines.append(f"{t:.3f}," + ",".join("" if np.isnan(x) else f"{x:.10g}" for x in row))
    path.write_text("\n".join(lines) + "\n")


def at_rate(seconds, hz, late=0.0):
    rows = np.arange(0, seconds / STEP - 1, 1.0 / (hz * STEP)).round().astype(int)
    return rows * STEP, np.maximum(rows - round(late / STEP), 0)


def write(s, g, out, folder):
    instrument = INSTRUMENTS[s["instrument"]]
    for k, trial in enumerate(TRIALS):
        seconds = SECONDS[k]
        times, rows = at_rate(seconds, s["thrust_hz"])
        order = out["order"][rows, k].copy()
        order[:, : s["thrusters"]] = (
            np.round(order[:, : s["thrusters"]] * 200) / 200 * s["max_rate"] * 30 / np.pi
        )
        names = ["propeller (rpm)"] if s["steers"] else ["port (rpm)", "starboard (rpm)"]
        if s["steers"]:
            names.append("rudder (deg)")
            angle = order[:, 1] if s["logs_order"] else out["angle"][rows, k, 0]
            order[:, 1] = np.degrees(angle)
        table(folder / trial / "drive.csv", names, times, order)

        times, rows = at_rate(seconds, s["imu_hz"])
        heading = out["heading"][rows, k, 0]
        shown = heading + s["compass"] + s["deviation"] * np.sin(heading + 0.7)
        shown = shown + np.radians(0.3) * s["noise"] * g.standard_normal(len(rows))
        columns, names = [np.degrees(shown) % 360], ["heading (deg)"]
        if s["has_gyro"]:
            rate = out["nu"][rows, k, 2] + 0.003 * s["noise"] * g.standard_normal(len(rows))
            columns.append(np.degrees(rate) + 0.05)
            names.append("rate (deg/s)")
        table(folder / trial / "imu.csv", names, times, np.stack(columns, 1))

        times, rows = at_rate(seconds, instrument["hz"], s["late"])
        heading, r = out["heading"][rows, k, 0], out["nu"][rows, k, 2]
        cos, sin = np.cos(heading), np.sin(heading)
        x, y = s["antenna"]
        reach = np.stack([cos * x - sin * y, sin * x + cos * y], 1)
        # A receiver's slow error is smooth: it follows another that forgets itself in 30 s.
        slow, ahead = np.zeros((len(rows), 2)), np.zeros(2)
        fade = np.exp(-1 / (30.0 * instrument["hz"]))
        for j in range(1, len(rows)):
            ahead = fade * ahead + np.sqrt(1 - fade**2) * g.standard_normal(2)
            slow[j] = fade * slow[j - 1] + (1 - fade) * ahead
        slow *= np.sqrt(2) * instrument["slow"]
        shape = (len(rows), 2)
        std = instrument["std"] * s["noise"]
        fixes = out["place"][rows, k] + reach + slow + std * g.standard_normal(shape)
        wild = g.uniform(size=len(rows)) < s["jumps"]
        fixes[wild] += 3.0 * g.standard_normal((wild.sum(), 2))
        moving = out["ground"][rows, k] + np.stack([-reach[:, 1], reach[:, 0]], 1) * r[:, None]
        moving = moving + std * g.standard_normal(shape)
        moving[wild] += s["top"] * g.standard_normal((wild.sum(), 2))
        w = 1 - 6.69437999014e-3 * np.sin(LATITUDE) ** 2
        prime = 6378137.0 / np.sqrt(w)
        meridian = prime * (1 - 6.69437999014e-3) / w
        placed = np.degrees(
            np.stack(
                [
                    LATITUDE + fixes[:, 0] / meridian,
                    LONGITUDE + fixes[:, 1] / (prime * np.cos(LATITUDE)),
                ],
                1,
            )
        )
        names, columns = [], []
        if instrument["kind"] in ("fixes", "both"):
            names += ["latitude (deg)", "longitude (deg)"]
            columns.append(placed)
        if instrument["kind"] in ("north", "both"):
            names += ["vn (m/s)", "ve (m/s)"]
            columns.append(moving)
        if instrument["kind"] == "course":
            names += ["speed (m/s)", "course (deg)"]
            way = np.degrees(np.arctan2(moving[:, 1], moving[:, 0])) % 360
            columns.append(np.stack([np.hypot(*moving.T), way], 1))
        columns = np.hstack(columns)
        if s["gap"]:
            begin = g.uniform(20, seconds - 60)
            columns[(times > begin) & (times < begin + s["gap"])] = np.nan
        table(folder / trial / "gnss.csv", names, times, columns)
    claims(s, folder)


def claims(s, folder):
    """Writes the user's description of the boat and the trials."""
    lines = [f'name = "boat {s["seed"]}"', f"size_m = {[round(x, 3) for x in s['size']]}"]
    ahead = s["max_force"] / s["max_rate"] ** 2
    places = (
        [("propeller", 0.0)] if s["steers"] else [("port", -s["arm"]), ("starboard", s["arm"])]
    )
    for name, y in places:
        lines += [
            "[[thruster]]",
            f'name = "{name}"',
            f"position_m = [{s['aft'] + 0.04 * s['length']:.4f}, {y:.4f}, 0]",
            "direction = [1, 0, 0]",
            f'curve = {{ kind = "quadratic", forward = {ahead:.8g}, reverse = {ahead * s["stated_reverse"]:.8g} }}',
        ]
    if s["steers"]:
        lines += [
            "[[rudder]]",
            'name = "rudder"',
            f"position_m = [{s['aft']:.4f}, 0, 0]",
            "axis = [0, 0, -1]",
            'slipstream = "propeller"',
        ]
    x, y = s["claimed_antenna"]
    lines += ["[sensor.position]", f"position_m = [{x:.3f}, {y:.3f}, 0]"]
    (folder / "vehicle.toml").write_text("\n".join(lines) + "\n")
    lines = ['vehicle = "vehicle.toml"', "[[plant]]", 'axes = ["surge", "sway", "yaw"]']
    for trial in TRIALS:
        lines += [
            "[[trial]]",
            f'name = "{trial}"',
            f"log = {json.dumps([f'{trial}/{name}.csv' for name in ('drive', 'imu', 'gnss')])}",
        ]
        if trial == "held-out":
            lines.append('role = "hold-out"')
    lines.append("[channels]")
    lines += [f'"thruster.{name}.speed" = {{ column = "{name}" }}' for name, _ in places]
    if s["steers"]:
        lines.append('"rudder.rudder.angle" = { column = "rudder" }')
    lines.append('"attitude.heading" = { column = "heading" }')
    if s["has_gyro"]:
        lines.append('"rate.yaw" = { column = "rate" }')
    of = {
        "fixes": [("position.latitude", "latitude"), ("position.longitude", "longitude")],
        "north": [("velocity.north", "vn"), ("velocity.east", "ve")],
        "course": [("ground.speed", "speed"), ("ground.course", "course")],
    }
    of["both"] = of["fixes"] + of["north"]
    kind = INSTRUMENTS[s["instrument"]]["kind"]
    lines += [f'"{channel}" = {{ column = "{column}" }}' for channel, column in of[kind]]
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n")


def drawn(job):
    folder, seed, wanted = job
    s, g = draw(seed, wanted)
    out = simulate(s, g)
    write(s, g, out, folder)
    is_plain = not (s["strips"] or s["hull_lift"] or s["skeg_at"])
    truth = {
        **{name: np.asarray(x).tolist() for name, x in s.items()},
        "told": [True, is_plain, is_plain and not s["steers"]],
    }
    (folder / "truth.json").write_text(json.dumps(truth, indent=1))


def true_values(truth):
    """Returns the truth of every coefficient that the plant and the boat both have."""
    mass = truth["M"]
    values = {f"mass.{axis}": mass[i][i] for i, axis in enumerate(AXES)}
    values["mass.sway-yaw"] = mass[1][2]
    for i, (axis, speed) in enumerate(zip(AXES, "uvr")):
        if truth["told"][i]:
            values[f"{axis}: {speed}"] = truth["linear"][i]
            values[f"{axis}: |{speed}|{speed}"] = truth["quadratic"][i]
    return values


def described(truth):
    drive = "rudder" if truth["steers"] else "two propellers"
    gyroscope = "" if truth["has_gyro"] else ", no gyroscope"
    return f"{truth['length']:.1f} m, {drive}, {truth['instrument']}{gyroscope}"


if __name__ == "__main__":
    judge_drawn(drawn, described, true_values, {*FAULTS, *INSTRUMENTS, *ALSO})
