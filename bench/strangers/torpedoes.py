"""Draws torpedo-shaped vehicles with fins, drives them under an autopilot, writes their logs, and judges plants of them.

Shares nothing with Seaplant but the files: the state is momentum (Kirchhoff's equations), the hull has cross-flow
drag in strips and lift, and each fin has lift, stall and induced drag of its own. Each vehicle has a propeller
at the stern, four fins in a cross (rudder and stern plane) or an X, and up to two faults out of `FAULTS`.

    torpedoes.py PROGRAM OUT NUMBER SEED [FAULT ...]   # draws OUT/SEED ... where they are absent, and judges them

With faults named, each vehicle has these; `healthy` has none; names of `ALSO` choose these. Wrong: a mass or an
inertia that is off by more than 10 % and outside its interval; roll is not judged, as nothing rolls these vehicles.
"""

import json

import numpy as np
from boats import at_rate, table
from running import chosen_faults, faults, judge_drawn

RHO, G = 1025.0, 9.81
STEP = 0.02
SECONDS = (300.0, 300.0, 150.0)
TRIALS = ("first", "second", "held-out")
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
STRIPS = (np.arange(15) + 0.5) / 15 - 0.5
ANGLES = (("roll", "roll"), ("pitch", "pitch"), ("heading", "yaw"))
ALSO = ("healthy", "cross", "x", "states_fins", "hides_fins", "six", "five")
FAULTS, fault = faults()


@fault
def lag(s, g):
    s["lag"] = g.uniform(0.1, 0.5)


@fault
def advance(s, g):
    s["advance"] = g.uniform(0.1, 0.4)


@fault
def thrust_curve(s, g):
    s["scale"] = 1 + g.uniform(-0.12, 0.12)


@fault
def fin_orders(s, g):
    s["logs_orders"] = True


@fault
def fin_zero(s, g):
    s["fin_zero"] = np.radians(g.uniform(-3, 3, 4))


@fault
def late_fins(s, g):
    s["fin_delay"] = g.uniform(0.1, 0.4)


@fault
def current(s, g):
    s["current"] = g.uniform(0.1, 0.5)


@fault
def current_varies(s, g):
    s["current"], s["current_std"] = g.uniform(0.0, 0.3), g.uniform(0.02, 0.08)


@fault
def waves(s, g):
    s["waves"] = g.uniform(0.05, 0.3)


@fault
def noise(s, g):
    s["noise"] = g.uniform(2.0, 5.0)


@fault
def dvl_late(s, g):
    s["dvl_late"] = g.uniform(0.1, 0.4)


@fault
def dvl_place(s, g):
    s["claimed_dvl"] = np.zeros(3)


@fault
def dvl_turned(s, g):
    s["dvl_turned"] = np.radians(g.uniform(2, 6)) * g.choice([-1, 1])


@fault
def gap(s, g):
    s["gap"] = g.uniform(5, 30)


@fault
def gyro_bias(s, g):
    s["gyro_bias"] = g.uniform(-0.02, 0.02, 3)


@fault
def heavy_nose(s, g):
    s["ahead"] = s["length"] * g.choice([-1, 1]) * g.uniform(0.003, 0.008)


def draw(seed, wanted=()):
    """Draws a vehicle: hull, fins, propeller, sensors and faults, at random or as requested."""
    g = np.random.default_rng(seed)
    length = float(np.exp(g.uniform(np.log(1.0), np.log(3.0))))
    diameter = length / g.uniform(6.5, 9.5)
    mass = RHO * np.pi / 6 * diameter**2 * length * g.uniform(1.2, 1.4)
    lateral = mass * length**2 / 12 * g.uniform(0.7, 0.95)
    added = g.uniform(0.03, 0.07), g.uniform(0.8, 1.05), g.uniform(0.6, 0.95)
    middle = length * g.uniform(-0.03, 0.03)
    speed = g.uniform(1.0, 2.2)
    push = 0.5 * RHO * np.pi / 4 * diameter**2 * g.uniform(0.12, 0.25) * speed**2
    s = {
        "seed": seed,
        "length": length,
        "size": [length, diameter, diameter],
        "mass": mass,
        "roll_inertia": mass * diameter**2 * g.uniform(0.1, 0.14),
        "lateral_inertia": lateral,
        "added": added,
        "middle": middle,
        "below": diameter * g.uniform(0.03, 0.12),
        "ahead": 0.0,
        "buoyant": g.uniform(0.0, 0.006),
        "speed": speed,
        "push": push,
        "drag": push / speed**2,
        "cross_drag": g.uniform(0.8, 1.3),
        "hull_lift": g.uniform(0.6, 1.6) * diameter**2,
        "hull_lift_at": length * g.uniform(-0.2, 0.1),
        "fin_area": length * diameter * g.uniform(0.035, 0.06),
        "fin_slope": g.uniform(2.2, 3.6),
        "fin_aft": -length * g.uniform(0.38, 0.46),
        "fin_out": diameter * g.uniform(0.45, 0.7),
        "stall": np.radians(g.uniform(20, 28)),
        "is_x": bool(g.uniform() < 0.4),
        "max_rate": g.uniform(100, 250),
        "torque": diameter * g.uniform(0.03, 0.12),
        "roll_damping": g.uniform(0.5, 1.5),
        "dvl": np.array([length * g.uniform(-0.25, 0.3), 0.0, diameter * g.uniform(0.2, 0.45)]),
        "fin_rate": np.radians(g.uniform(40, 120)),
        "lag": 0.0,
        "advance": 0.0,
        "scale": 1.0,
        "logs_orders": False,
        "fin_zero": np.zeros(4),
        "fin_delay": 0.0,
        "current": 0.0,
        "current_std": 0.0,
        "waves": 0.0,
        "noise": 1.0,
        "dvl_late": 0.0,
        "dvl_turned": 0.0,
        "gap": 0.0,
        "gyro_bias": np.zeros(3),
        "imu_hz": float(g.choice([10.0, 20.0])),
        "dvl_hz": float(g.choice([4.0, 5.0, 8.0])),
        "states_rigid_body": bool(g.uniform() < 0.6),
        "states_fins": bool(g.uniform() < 0.5),
        "fin_claim": 1 + g.uniform(-0.15, 0.15),
        "six": bool(g.uniform() < 0.5),
    }
    s["claimed_dvl"] = s["dvl"]
    chosen = g.choice(list(FAULTS), size=g.integers(0, 3), replace=False)
    for name in wanted:
        s["is_x"] = {"x": True, "cross": False}.get(name, s["is_x"])
        s["states_fins"] = {"states_fins": True, "hides_fins": False}.get(
            name, s["states_fins"]
        )
        s["six"] = {"six": True, "five": False}.get(name, s["six"])
    s["faults"] = chosen_faults(wanted, FAULTS, chosen)
    for name in s["faults"]:
        FAULTS[name](s, g)
    x, z = s["ahead"], s["below"]
    rigid = np.diag([mass] * 3 + [s["roll_inertia"], lateral, lateral])
    rigid[3:, 3:] += mass * np.array(
        [[z * z, 0, -x * z], [0, x * x + z * z, 0], [-x * z, 0, x * x]]
    )
    rigid[:3, 3:] = mass * np.array([[0, z, 0], [-z, 0, x], [0, -x, 0]])
    rigid[3:, :3] = rigid[:3, 3:].T
    along, across, turn = added
    water = np.diag([along, across, across, 0.0, 0.0, 0.0]) * mass
    water[3:, 3:] = np.diag([0.05 * s["roll_inertia"], turn * lateral, turn * lateral])
    water[1, 5] = water[5, 1] = across * mass * middle
    water[2, 4] = water[4, 2] = -across * mass * middle
    s["rigid"], s["M"] = rigid, rigid + water
    turns = np.radians([45, 135, 225, 315]) if s["is_x"] else np.radians([0, 90, 180, 270])
    # From the hull to the tip of each fin, the first down in a cross.
    s["out"] = np.stack([np.zeros(4), np.sin(turns), np.cos(turns)], 1)
    places = np.array([s["fin_aft"], 0, 0]) + s["fin_out"] * s["out"]
    chord = np.repeat([[1.0, 0, 0]], 4, 0)
    side = np.cross(s["out"], chord)
    # The wrenches of a force along chord and normal of each fin.
    s["chords"] = np.hstack([chord, np.cross(places, chord)])
    s["sides"] = np.hstack([side, np.cross(places, side)])
    return s, g


def steering(s):
    """Returns the fins' angles by orders of rudder and stern plane: bow to starboard, bow up."""
    # Each fin turns about its own span; a positive angle pushes to its side.
    return s["sides"][:, 1:3] * [-1, 1]


def of_fins(s, nu, angles):
    """Returns the force of the fins, by trial."""
    ahead, aside = nu @ s["chords"].T, nu @ s["sides"].T
    attack = np.arctan2(aside, np.maximum(ahead, 1e-3)) - angles
    # Linear to nearly the stall angle, and constant beyond.
    lift = s["fin_slope"] * attack / (1 + (attack / s["stall"]) ** 8) ** 0.125
    drag = 0.012 + lift**2 / (np.pi * 3.0 * 0.8)
    dynamic = 0.5 * RHO * s["fin_area"] / 2 * np.hypot(ahead, aside)
    # Lift is across the flow, drag along it.
    x = dynamic * (lift * aside - drag * ahead)
    y = dynamic * (-lift * ahead - drag * aside)
    return x @ s["chords"] + y @ s["sides"]


def crossed(a, b):
    """Returns a × b by row, several times as fast as numpy of three rows."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


def of_hull(s, nu):
    """Returns drag and lift of the bare hull."""
    u, v, w, p, q, r = nu.T
    length, diameter, _ = s["size"]
    x = STRIPS * length
    y, z = v[:, None] + x * r[:, None], w[:, None] - x * q[:, None]
    size = -0.5 * RHO * diameter * s["cross_drag"] * length / 15 * np.hypot(y, z)
    force = np.zeros((len(nu), 6))
    force[:, 0] = -0.88 * s["drag"] * np.abs(u) * u
    force[:, 1], force[:, 5] = (size * y).sum(1), (size * y * x).sum(1)
    force[:, 2], force[:, 4] = (size * z).sum(1), -(size * z * x).sum(1)
    lift = -0.5 * RHO * s["hull_lift"] * np.abs(u)
    at = s["hull_lift_at"]
    force[:, 1] += lift * (v + at * r)
    force[:, 2] += lift * (w - at * q)
    force[:, 5] += at * lift * (v + at * r)
    force[:, 4] -= at * lift * (w - at * q)
    force[:, 3] = -s["roll_damping"] * s["roll_inertia"] * (2 + np.abs(p)) * p
    return force


def simulate(s, g):
    """Drives all trials at once under an autopilot with steps on its fins; returns the history of every step."""
    n, count = len(TRIALS), int(max(SECONDS) / STEP)
    inverse = np.linalg.inv(s["M"])
    hold = s["length"] / s["speed"]
    set_times = g.uniform(6, 25, (n, 3, 120)).cumsum(2)
    levels = g.uniform(-1, 1, (n, 3, 121))
    dither_times = g.uniform(1.0 * hold, 5.0 * hold, (n, 2, 400)).cumsum(2)
    dithers = np.radians(8) * g.uniform(-1, 1, (n, 2, 401))
    rot = np.repeat(np.eye(3)[None], n, 0)
    place = np.zeros((n, 3))
    place[:, 2] = 12.0
    drift = np.zeros((n, 3))
    way = g.uniform(0, 2 * np.pi)
    steady = s["current"] * np.array([np.cos(way), np.sin(way), 0.0])
    speed, angles = np.zeros(n), np.zeros((n, 4))
    late = round(s["fin_delay"] / STEP)
    heard = np.zeros((count + late + 1, n, 4))
    wave_rate = 2 * np.pi / g.uniform(3, 6, (3, 1, 1))
    wave_phase = g.uniform(0, 2 * np.pi, (3, n, 6))
    wave_size = (
        s["push"]
        * np.array([1, 1, 1, 0.02, 0.2, 0.2])
        * np.array([1, 1, 1, s["length"], s["length"], s["length"]])
    )
    nu = np.zeros((n, 6))
    nu[:, 0] = 0.6 * s["speed"]
    nu[:, :3] -= steady
    momentum = nu @ s["M"].T
    weight = s["mass"] * G
    lift = weight * (1 + s["buoyant"])
    centre = np.array([[s["ahead"], 0, s["below"]]])
    to_fins = steering(s)
    width = {"nu": 6, "euler": 3, "depth": 1, "ground": 3, "order": 4, "angle": 4, "speed": 1}
    out = {name: np.zeros((count, n, size)) for name, size in width.items()}

    def euler_of(rot):
        return np.stack(
            [
                np.arctan2(rot[:, 2, 1], rot[:, 2, 2]),
                -np.arcsin(np.clip(rot[:, 2, 0], -1, 1)),
                np.arctan2(rot[:, 1, 0], rot[:, 0, 0]),
            ],
            1,
        )

    def rates(momentum, rot, thrust, angles, outside, water):
        nu = momentum @ inverse.T
        force = of_hull(s, nu) + of_fins(s, nu, angles) + outside
        own = thrust * (1 - s["advance"] * nu[:, 0] / s["speed"])
        force[:, 0] += own
        force[:, 3] -= s["torque"] * own
        down = rot[:, 2, :]
        force[:, :3] += (weight - lift) * down
        force[:, 3:] += crossed(centre, weight * down)
        p, turn, omega = momentum[:, :3], momentum[:, 3:], nu[:, 3:]
        turning = crossed(turn, omega) + crossed(p, nu[:, :3])
        change = force + np.hstack([crossed(p, omega), turning])
        spin = np.zeros((n, 3, 3))
        spin[:, 0, 1], spin[:, 0, 2], spin[:, 1, 2] = -omega[:, 2], omega[:, 1], -omega[:, 0]
        spin -= spin.transpose(0, 2, 1)
        return change, rot @ spin, np.einsum("nij,nj->ni", rot, nu[:, :3]) + water

    for k in range(count):
        t = k * STEP
        nu = momentum @ inverse.T
        euler = euler_of(rot)
        if k % 5 == 0:
            at = [[np.searchsorted(set_times[a, b], t) for b in range(3)] for a in range(n)]
            goal = np.take_along_axis(levels, np.array(at)[:, :, None], 2)[:, :, 0]
            at = [[np.searchsorted(dither_times[a, b], t) for b in range(2)] for a in range(n)]
            dither = np.take_along_axis(dithers, np.array(at)[:, :, None], 2)[:, :, 0]
            turn = (np.pi * goal[:, 0] - euler[:, 2] + np.pi) % (2 * np.pi) - np.pi
            pitch = np.clip(0.12 * (place[:, 2] - 12 - 8 * goal[:, 1]), -0.35, 0.35)
            rudder = 0.6 * np.clip(turn, -0.8, 0.8) - 0.5 * hold * nu[:, 5] + dither[:, 0]
            plane = 1.2 * (pitch - euler[:, 1]) - 0.5 * hold * nu[:, 4] + dither[:, 1]
            order = np.stack([rudder, plane], 1) @ to_fins.T
            if s["is_x"]:
                order = order + (0.3 * euler[:, 0] + 0.1 * nu[:, 3])[:, None]
            order = np.clip(order, -np.radians(20), np.radians(20))
        heard[k + late] = order
        most = s["fin_rate"] * STEP
        angles = angles + np.clip(heard[k] - angles, -most, most)
        wanted = (0.8 + 0.2 * goal[:, 2]) * s["max_rate"]
        keep = np.exp(-STEP / s["lag"]) if s["lag"] else 0.0
        speed = wanted + keep * (speed - wanted)
        thrust = (
            s["scale"] * s["push"] * 1.3 * np.abs(speed / s["max_rate"]) * speed / s["max_rate"]
        )
        if s["current_std"]:
            kick = s["current_std"] * np.sqrt(2 * STEP / 60) * g.standard_normal((n, 3))
            drift += -drift * STEP / 60 + kick * [1, 1, 0.2]
        water = steady + drift
        outside = 0.005 * wave_size * g.standard_normal((n, 6))
        if s["waves"]:
            outside = outside + s["waves"] * wave_size * np.sin(wave_rate * t + wave_phase).sum(
                0
            )
        out["nu"][k], out["euler"][k], out["depth"][k, :, 0] = nu, euler, place[:, 2]
        out["ground"][k] = nu[:, :3] + np.einsum("nij,ni->nj", rot, water)
        out["order"][k], out["angle"][k], out["speed"][k, :, 0] = order, angles, wanted
        state, around = (momentum, rot, place), (thrust, angles + s["fin_zero"], outside, water)
        a = rates(*state[:2], *around)
        b = rates(*(x + STEP / 2 * d for x, d in zip(state[:2], a)), *around)
        c = rates(*(x + STEP / 2 * d for x, d in zip(state[:2], b)), *around)
        d = rates(*(x + STEP * e for x, e in zip(state[:2], c)), *around)
        momentum, rot, place = (
            x + STEP / 6 * (p + 2 * q + 2 * y + z) for x, p, q, y, z in zip(state, a, b, c, d)
        )
        left, _, right = np.linalg.svd(rot)
        rot = left @ right
        if not np.isfinite(momentum).all():
            raise FloatingPointError(f"vehicle {s['seed']} runs away at {t:.1f} s")
    return out


def fins(s):
    """Returns name, place, axis and column of each surface as the user has it."""
    if s["is_x"]:
        places = [np.array([s["fin_aft"], 0, 0]) + s["fin_out"] * out for out in s["out"]]
        return [(f"fin {k + 1}", places[k], s["out"][k], k, 1) for k in range(4)]
    aft = np.array([s["fin_aft"], 0, 0])
    return [("rudder", aft, s["out"][0], 0, 2), ("stern plane", aft, s["out"][1], 1, 2)]


def write(s, g, out, folder):
    tilt = s["dvl_turned"]
    turn = np.array(
        [[np.cos(tilt), np.sin(tilt), 0], [-np.sin(tilt), np.cos(tilt), 0], [0, 0, 1]]
    )
    for k, trial in enumerate(TRIALS):
        count = int(SECONDS[k] / STEP)
        own = {name: values[:count, k] for name, values in out.items()}
        times, rows = at_rate(SECONDS[k], 10.0)
        shown = own["order" if s["logs_orders"] else "angle"][rows]
        columns = [own["speed"][rows] * 30 / np.pi]
        columns += [np.degrees(shown[:, [column]]) for *_, column, _ in fins(s)]
        names = ["propeller (rpm)", *[f"{name} (deg)" for name, *_ in fins(s)]]
        table(folder / trial / "drive.csv", names, times, np.hstack(columns))
        times, rows = at_rate(SECONDS[k], s["imu_hz"])
        rate = own["nu"][rows, 3:] + s["gyro_bias"]
        rate = rate + 0.002 * s["noise"] * g.standard_normal(rate.shape)
        angle = own["euler"][rows] + 0.003 * s["noise"] * g.standard_normal(rate.shape)
        depth = own["depth"][rows] + 0.01 * s["noise"] * g.standard_normal((len(rows), 1))
        names = [*[f"{x} (deg/s)" for x in "pqr"], "roll (deg)", "pitch (deg)", "yaw (deg)"]
        columns = np.hstack([np.degrees(rate), np.degrees(angle), depth])
        table(folder / trial / "imu.csv", [*names, "depth (m)"], times, columns)
        times, rows = at_rate(SECONDS[k], s["dvl_hz"], s["dvl_late"])
        seen = own["ground"][rows] + np.cross(own["nu"][rows, 3:], s["dvl"])
        seen = seen @ turn.T + 0.005 * s["noise"] * g.standard_normal(seen.shape)
        if s["gap"]:
            begin = g.uniform(20, SECONDS[k] - 60)
            seen[(times > begin) & (times < begin + s["gap"])] = np.nan
        table(folder / trial / "dvl.csv", [f"{x} (m/s)" for x in "xyz"], times, seen)
    claims(s, folder)


def claims(s, folder):
    """Writes the user's description of the vehicle and the trials."""
    ahead = 1.3 * s["push"] / s["max_rate"] ** 2
    lines = [
        f'name = "torpedo {s["seed"]}"',
        f"dry_mass_kg = {s['mass']:.5g}",
        f"size_m = {[round(x, 3) for x in s['size']]}",
        "[[thruster]]",
        'name = "propeller"',
        f"position_m = [{-0.48 * s['length']:.3f}, 0, 0]",
        "direction = [1, 0, 0]",
        f'curve = {{ kind = "quadratic", forward = {ahead:.8g}, reverse = {ahead:.8g} }}',
    ]
    for name, place, axis, _, number in fins(s):
        lines += [
            "[[fin]]",
            f'name = "{name}"',
            f"position_m = {[round(x, 4) for x in place.tolist()]}",
            f"axis = {[round(x, 6) for x in axis.tolist()]}",
        ]
        if s["states_fins"]:
            slope = s["fin_slope"] * s["fin_claim"]
            area = s["fin_area"] / 2 * number
            lines += [f"area_m2 = {area:.6g}", f"lift_slope = {slope:.4g}"]
    if s["states_rigid_body"]:
        lines += [
            "[rigid_body]",
            f"mass_kg = {s['mass']:.6g}",
            f"centre_of_gravity_m = [{s['ahead']:.4f}, 0, {s['below']:.4f}]",
            f"inertia_kg_m2 = {np.diag([s['roll_inertia'], *[s['lateral_inertia']] * 2]).tolist()}",
            "[buoyancy]",
            f"displaced_kg = {s['mass'] * (1 + s['buoyant']):.6g}",
            "centre_m = [0, 0, 0]",
        ]
    lines += [
        "[sensor.dvl]",
        f"position_m = {[round(x, 3) for x in s['claimed_dvl'].tolist()]}",
    ]
    (folder / "vehicle.toml").write_text("\n".join(lines) + "\n")
    axes = AXES if s["six"] else [a for a in AXES if a != "roll"]
    lines = ['vehicle = "vehicle.toml"', "[[plant]]", f"axes = {json.dumps(list(axes))}"]
    for trial in TRIALS:
        logs = json.dumps([f"{trial}/{name}.csv" for name in ("drive", "imu", "dvl")])
        lines += ["[[trial]]", f'name = "{trial}"', f"log = {logs}"]
        if trial == "held-out":
            lines.append('role = "hold-out"')
    lines += ["[channels]", '"thruster.propeller.speed" = { column = "propeller" }']
    lines += [f'"fin.{name}.angle" = {{ column = "{name}" }}' for name, *_ in fins(s)]
    lines += [f'"dvl.velocity.{x}" = {{ column = "{x}" }}' for x in "xyz"]
    lines += [f'"rate.{a}" = {{ column = "{c}" }}' for a, c in zip(AXES[3:], "pqr")]
    lines += [f'"attitude.{a}" = {{ column = "{c}" }}' for a, c in ANGLES]
    lines.append('"depth" = { column = "depth" }')
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n")


def drawn(job):
    folder, seed, wanted = job
    s, g = draw(seed, wanted)
    out = simulate(s, g)
    write(s, g, out, folder)
    most = {name: np.abs(out[name]).max((0, 1)).tolist() for name in ("nu", "euler", "angle")}
    truth = {name: np.asarray(x).tolist() for name, x in s.items()} | {"most": most}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1))


def described(truth):
    fins = "X" if truth["is_x"] else "cross"
    known = "fins known" if truth["states_fins"] else "fins unknown"
    return f"{truth['length']:.1f} m, {fins}, {known}, {'six' if truth['six'] else 'five'} axes"


def true_values(truth):
    """Returns the masses and the couplings between them."""
    mass = truth["M"]
    axes = [axis for axis in AXES if axis != "roll"]
    values = {f"mass.{axis}": mass[AXES.index(axis)][AXES.index(axis)] for axis in axes}
    return values | {"mass.sway-yaw": mass[1][5], "mass.heave-pitch": mass[2][4]}


if __name__ == "__main__":
    judge_drawn(drawn, described, true_values, {*FAULTS, *ALSO})
