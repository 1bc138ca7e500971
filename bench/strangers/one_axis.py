"""Draws vehicles that move in one axis, drives them, and writes their logs as users have them.

Shares nothing with Seaplant but the files, and needs Python alone. Each vehicle has a fault out of
`FAULTS`, each in turn, and every third has a second one.

    one_axis.py OUT NUMBER SEED [FAULT ...]   # writes OUT/000 ..., each with truth.json

With faults named, each vehicle has these.
"""

import json
import math
import sys
from pathlib import Path
from random import Random

STEP = 0.01
TRIALS = {"first": 300.0, "second": 300.0, "third": 150.0, "fourth": 150.0}
HELD_OUT = ["third", "fourth"]
TRANSLATIONS = ["surge", "sway", "heave"]
AXES = [*TRANSLATIONS, "yaw"]

# Each fault is a function of the vehicle `s` and the generator `g`, and the axes that can have it.
FAULTS = {}
# There by name only: faults that no model of Seaplant has, and some that it has learnt since.
UNMODELLED = {}


def fault(*axes, among=FAULTS):
    def keep(f):
        among[f.__name__] = (f, list(axes) or AXES)
        return f

    return keep


@fault()
def plain(s, g):
    pass


@fault()
def lag(s, g):
    s["lag_up"] = s["lag_down"] = g.uniform(0.1, 0.5)


@fault()
def lag_two_way(s, g):
    s["lag_up"], s["lag_down"] = g.uniform(0.05, 0.2), g.uniform(0.25, 0.6)


@fault()
def slew(s, g):
    s["slew"] = g.uniform(0.3, 0.8)


@fault()
def delay(s, g):
    s["delay"] = g.uniform(0.05, 0.35)


@fault(*TRANSLATIONS)
def reverse(s, g):
    s["reverse"] = g.uniform(0.6, 0.9)


@fault()
def exponent(s, g):
    s["exponent"] = g.uniform(1.75, 2.15)


@fault()
def inflow(s, g):
    s["inflow"] = g.uniform(0.1, 0.3)


@fault()
def inflow_ahead(s, g):
    s["inflow_ahead"] = g.uniform(0.1, 0.3)


@fault()
def sag(s, g):
    s["sag"] = g.uniform(0.05, 0.15)


@fault()
def tether(s, g):
    s["tether"] = g.uniform(0.02, 0.1)


@fault("surge", "sway")
def current(s, g):
    s["current"] = g.uniform(0.05, 0.2) * g.choice([-1, 1])


@fault("surge", "sway")
def current_varies(s, g):
    s["current"], s["current_std"] = g.uniform(-0.1, 0.1), g.uniform(0.03, 0.08)


@fault()
def swell(s, g):
    s["swell"], s["swell_s"] = g.uniform(0.05, 0.2), g.uniform(4.0, 10.0)


@fault()
def linear_drag(s, g):
    s["linear"] = g.uniform(0.1, 0.5)


@fault()
def weak(s, g):
    s["effort"], s["tether"] = g.uniform(0.15, 0.3), g.uniform(0.02, 0.05)


@fault()
def noise(s, g):
    s["noise"] = g.uniform(3.0, 7.0)


@fault()
def spikes(s, g):
    s["spikes"] = g.uniform(0.002, 0.01)


@fault()
def gaps(s, g):
    s["gaps"] = g.uniform(3.0, 12.0)


@fault()
def stamps(s, g):
    s["jitter"], s["begin"] = g.uniform(0.05, 0.2), g.uniform(0.01, 0.05)


@fault()
def slow_speed_log(s, g):
    s["thrust_hz"] = g.choice([2.0, 4.0])


@fault()
def coarse_speed_log(s, g):
    s["levels"] = 256


@fault("surge", "sway")
def means(s, g):
    s["window"] = g.uniform(0.4, 1.2)


@fault("surge", "sway")
def smoothed(s, g):
    s["smoothed"] = g.uniform(0.2, 0.6)


@fault("heave")
def scale(s, g):
    s["scale"] = g.uniform(0.96, 1.04)


@fault("yaw")
def heading_drifts(s, g):
    s["drift"] = g.uniform(0.002, 0.01) * g.choice([-1, 1])


@fault("surge", "sway", "yaw")
def speed_control(s, g):
    s["controlled"] = True


@fault(*TRANSLATIONS, among=UNMODELLED)
def lag_by_direction(s, g):
    lag_two_way(s, g)
    s["lag_of"] = "rising"


@fault(among=UNMODELLED)
def asymmetric_drag(s, g):
    s["asymmetry"] = g.uniform(0.08, 0.25) * g.choice([-1, 1])


@fault(among=UNMODELLED)
def drag_power(s, g):
    s["power"] = g.uniform(1.6, 1.9)


@fault(among=UNMODELLED)
def wake(s, g):
    s["wake"] = g.uniform(0.5, 2.5)


@fault(among=UNMODELLED)
def quick(s, g):
    s["tones"] = [
        (g.uniform(0.2, 1.0), g.uniform(0.2, 2.5), g.uniform(0, 6.28)) for _ in range(4)
    ]


@fault(among=UNMODELLED)
def quick_force(s, g):
    quick(s, g)
    s["tones_of"] = "force"


@fault(among=UNMODELLED)
def voltage(s, g):
    """Propellers that are told commands, on a battery whose voltage is logged."""
    s["voltage_power"] = g.uniform(1.0, 2.0)
    s["resistance"] = g.uniform(0.02, 0.12)


@fault(among=UNMODELLED)
def voltage_stated(s, g):
    """The same vehicles, with the voltage of the bollard test in the vehicle file."""
    voltage(s, g)
    s["states_voltage"] = True


@fault(among=UNMODELLED)
def dead_band(s, g):
    s["dead_band"] = g.uniform(0.04, 0.12)


@fault(among=UNMODELLED)
def ballast(s, g):
    s["ballast"] = g.uniform(0.05, 0.15) * g.choice([-1, 1])


@fault(among=UNMODELLED)
def thrust_wanders(s, g):
    s["wander"] = g.uniform(0.03, 0.08)


def draw(seed, wanted=()):
    """Draws a vehicle: mass, drag, thrusters, instruments and faults, at random or as
    requested."""
    g = Random(seed)
    first = wanted or [list(FAULTS)[seed % len(FAULTS)]]
    known = FAULTS | UNMODELLED
    common = [axis for axis in AXES if all(axis in known[name][1] for name in first)]
    axis = g.choice(common)
    names = list(first)
    if not wanted and g.random() < 1 / 3:
        others = [name for name in FAULTS if axis in FAULTS[name][1]]
        names.append(g.choice([name for name in others if name not in [*names, "plain"]]))
    mass = math.exp(g.uniform(math.log(15.0), math.log(15e3)))
    length = (mass / 300.0) ** (1 / 3)
    turns = axis == "yaw"
    inertia = mass * length**2 * g.uniform(0.05, 0.15) if turns else mass
    top = g.uniform(0.5, 1.3) / length**0.5 if turns else g.uniform(0.5, 1.2) * length**0.25
    s = {
        "seed": seed,
        "axis": axis,
        "faults": names,
        "mass": inertia,
        "top": top,
        "quadratic": inertia / (top * g.uniform(1.5, 8.0)),
        "linear": 0.0,
        "arm": length * g.uniform(0.2, 0.5) if turns else 1.0,
        "bias": g.uniform(-0.03, 0.03),
        "max_rate": g.uniform(100.0, 300.0),
        "effort": 1.0,
        "lag_up": 0.0,
        "lag_down": 0.0,
        # What `lag_up` is of: propellers that turn faster, or those whose speed rises towards full ahead.
        "lag_of": "faster",
        "slew": 0.0,
        "delay": 0.0,
        "reverse": 1.0,
        "known_reverse": g.choice([1.0, g.uniform(0.75, 0.95)]),
        "exponent": 2.0,
        "inflow": 0.0,
        "inflow_ahead": 0.0,
        "sag": 0.0,
        "tether": 0.0,
        "current": 0.0,
        "current_std": 0.0,
        "swell": 0.0,
        "swell_s": 8.0,
        "noise": 1.0,
        "spikes": 0.0,
        "gaps": 0.0,
        "jitter": 0.0,
        "begin": 0.0,
        "thrust_hz": 10.0,
        "levels": 0,
        "window": 0.0,
        "smoothed": 0.0,
        "scale": 1.0,
        "drift": 0.0,
        "controlled": False,
        "asymmetry": 0.0,
        "power": 2.0,
        "wake": 0.0,
        "tones": [],
        "tones_of": "speed",
        "voltage_power": 0.0,
        "resistance": 0.0,
        "states_voltage": False,
        "dead_band": 0.0,
        "ballast": 0.0,
        "wander": 0.003,
        "hz": g.choice([5.0, 8.0, 10.0]),
    }
    for name in names:
        known[name][0](s, g)
    if turns:
        # In yaw one propeller of a pair runs backward, whichever way the vehicle turns.
        s["known_reverse"] = 1.0
    s["linear"] *= s["quadratic"] * top
    s["force"] = s["quadratic"] * top**2 + s["linear"] * top
    s["bias"] *= s["force"]
    return s, g


class Joystick:
    """Returns levels, each held for a while, a third of them zero."""

    def __init__(self, g, low, high, hold):
        self.g, self.low, self.high, self.hold = g, low, high, hold
        self.left, self.level = 0.0, 0.0

    def now(self):
        self.left -= STEP
        if self.left <= 0:
            self.left = self.g.uniform(*self.hold)
            size = self.g.uniform(self.low, self.high) * self.g.choice([-1, 1])
            self.level = 0.0 if self.low == 0 and self.g.random() < 0.3 else size
        return self.level


def tones(s, time):
    """Returns the command of a quick drive, whose propeller speed or force is a sum of sinusoids."""
    whole = sum(size for size, _, _ in s["tones"])
    turning = sum(size * math.sin(omega * time + phase) for size, omega, phase in s["tones"])
    part = turning / whole
    return s["effort"] * (part if s["tones_of"] == "force" else part * abs(part))


def orders(s, g, name, seconds):
    """Returns the pilot's command at every step, as fractions of full force, or of top speed."""
    if name in HELD_OUT:
        stick = Joystick(g, 0.2, 0.7, (15.0, 40.0))
        return [s["effort"] * stick.now() for _ in range(round(seconds / STEP))]
    if s["tones"]:
        return [tones(s, k * STEP) for k in range(round(seconds / STEP))]
    stick = Joystick(g, 0.0, 0.5, (4.0, 15.0))
    size, omega = g.uniform(0.3, 0.6), 2 * math.pi / g.uniform(6.0, 16.0)
    phase, behind, asked = g.uniform(0, 2 * math.pi), 0.0, []
    for k in range(round(seconds / STEP)):
        behind += STEP * (stick.now() - behind)
        asked.append(s["effort"] * (size * math.sin(omega * k * STEP + phase) + behind))
    return asked


# A lithium battery of four cells, V; the bollard test was made at the nominal voltage.
FULL_V, EMPTY_V, NOMINAL_V = 16.8, 13.6, 15.0


def supplied(s, part, done):
    """Returns the voltage of the battery at this fraction of all trials and of full propeller
    speed."""
    return (FULL_V - (FULL_V - EMPTY_V) * done) * (1 - s["resistance"] * abs(part) ** 3)


class Propellers:
    """Simulates a pair of propellers from their command to their force."""

    def __init__(self, s, g):
        self.s, self.g = s, g
        self.speed, self.wander, self.queue = 0.0, 0.0, []

    def told(self, part):
        """Returns the speed for a fraction of full force by the curve that the analyst has."""
        s = self.s
        part = max(-s["known_reverse"], min(1.0, part))
        worth = part if part > 0 else part / s["known_reverse"]
        fade = STEP / 0.5
        kick = s["wander"] * math.sqrt(2 * fade) * self.g.gauss(0, 1)
        self.wander += -fade * self.wander + kick
        turning = math.copysign(math.sqrt(abs(worth)), worth)
        return (turning + self.wander * abs(turning)) * s["max_rate"]

    def follow(self, told):
        s = self.s
        self.queue.append(told)
        if len(self.queue) <= round(s["delay"] / STEP):
            return self.speed
        told = self.queue.pop(0)
        before = self.speed
        is_faster = told * before >= 0 and abs(told) > abs(before)
        is_up = told > before if s["lag_of"] == "rising" else is_faster
        lag = s["lag_up"] if is_up else s["lag_down"]
        after = told + (before - told) * math.exp(-STEP / lag) if lag else told
        if s["slew"]:
            most = s["max_rate"] * STEP / s["slew"]
            after = before + max(-most, min(most, after - before))
        self.speed = after
        return 0.5 * (before + after) if lag or s["slew"] else after

    def force(self, speed, through_water, done):
        s = self.s
        part = speed / s["max_rate"]
        if dead := s["dead_band"]:
            part = math.copysign(max(0.0, abs(part) - dead) / (1 - dead), part)
        pushed = math.copysign(abs(part) ** s["exponent"], part)
        if pushed < 0:
            pushed *= s["known_reverse"] * s["reverse"]
        pushed *= 1 - s["sag"] * done
        if s["voltage_power"]:
            pushed *= (supplied(s, part, done) / NOMINAL_V) ** s["voltage_power"]
        advance = through_water / s["top"]
        pushed -= s["inflow"] * abs(part) * advance
        if part * advance > 0:
            pushed -= s["inflow_ahead"] * abs(part) * advance
        return pushed * s["force"]


class Outside:
    """Simulates current, tether and swell."""

    def __init__(self, s, g):
        self.s, self.g = s, g
        self.pull, self.drift = g.gauss(0, 1), g.gauss(0, 1)
        self.wave, self.rate = 0.0, 0.0

    def now(self):
        s, g = self.s, self.g
        self.pull += -STEP / 30 * self.pull + math.sqrt(2 * STEP / 30) * g.gauss(0, 1)
        self.drift += -STEP / 90 * self.drift + math.sqrt(2 * STEP / 90) * g.gauss(0, 1)
        w, damping = 2 * math.pi / s["swell_s"], 0.08
        # Its standard deviation is one: q = 4 damping w^3.
        kick = math.sqrt(4 * damping * w**3 * STEP) * g.gauss(0, 1)
        self.rate += STEP * (-2 * damping * w * self.rate - w * w * self.wave) + kick
        self.wave += STEP * self.rate
        force = s["tether"] * self.pull + s["swell"] * self.wave
        return force * s["force"], s["current"] + s["current_std"] * self.drift


def drag(s, r):
    """Returns the drag at a velocity through the water."""
    size = s["quadratic"] * s["top"] ** 2 * abs(r / s["top"]) ** s["power"]
    way = 1 + math.copysign(s["asymmetry"], r)
    return math.copysign(size * way, r) + s["linear"] * r


def drive(s, g, name, start):
    """Simulates one trial; returns the logged propeller speed, velocity over ground, position
    and supply voltage, at every step."""
    seconds, total = TRIALS[name], sum(TRIALS.values())
    propellers, outside = Propellers(s, g), Outside(s, g)
    v, x, told, flow = 0.0, 0.0, 0.0, 0.0
    rows = []
    for k, asked in enumerate(orders(s, g, name, seconds)):
        if k % 10 == 0:
            if s["controlled"]:
                wanted = 0.7 * s["top"] * asked
                asked = 0.8 * s["mass"] * (wanted - v) / s["force"] + 0.5 * asked * abs(asked)
            if s["axis"] == "heave":
                asked -= 0.02 * x + 0.05 * v / s["top"]
            told = propellers.told(asked + s["bias"] / s["force"])
        push, water = outside.now()
        speed = propellers.follow(told)
        done = (start + k * STEP) / total

        if s["wake"]:
            flow += STEP / s["wake"] * (v - water - flow)
        shifted = s["ballast"] * s["force"] if done > 0.25 else 0.0

        def rate(v, speed=speed, push=push, water=water, done=done, flow=flow, shifted=shifted):
            r = v - water
            force = propellers.force(speed, r, done) - drag(s, flow if s["wake"] else r)
            return (force - s["bias"] - shifted + push) / s["mass"]

        rows.append((told, v, x, supplied(s, speed / s["max_rate"], done)))
        middle = v + 0.5 * STEP * rate(v)
        x, v = x + STEP * middle, v + STEP * rate(middle)
    return rows


def stamped(s, g, hz, count):
    """Returns the instants of samples: the step of each, and its logged time."""
    every = 1 / (hz * STEP)
    for k in range(int(count / every)):
        at = round(k * every)
        moved = s["jitter"] / hz * g.uniform(-0.5, 0.5) if s["jitter"] else 0.0
        yield at, at * STEP + s["begin"] + moved


def seen(s, rows):
    """Returns velocity as its instrument measures it before noise."""
    velocity = [row[1] for row in rows]
    if s["smoothed"]:
        keep, y = math.exp(-STEP / s["smoothed"]), velocity[0]
        for k, v in enumerate(velocity):
            y = keep * y + (1 - keep) * v
            velocity[k] = y
    width = round(s["window"] / STEP)
    if width:
        total = [0.0]
        for v in velocity:
            total.append(total[-1] + v)
        velocity = [
            (total[k + 1] - total[max(0, k + 1 - width)]) / min(width, k + 1)
            for k in range(len(velocity))
        ]
    return [s["scale"] * v for v in velocity]


def motion_log(s, g, rows):
    """Returns header and rows of the axis' measurements."""
    begin = g.uniform(20, len(rows) * STEP - 60)
    is_missing = lambda t: s["gaps"] and begin < t < begin + s["gaps"]
    wild = lambda size: g.gauss(0, size) if g.random() < s["spikes"] else 0.0
    if s["axis"] == "yaw":
        turned = g.uniform(0, 2 * math.pi)
        for at, t in stamped(s, g, 10.0, len(rows)):
            angle = rows[at][2] + turned + s["drift"] * t + wild(1.0)
            angle += math.radians(0.1) * s["noise"] * g.gauss(0, 1)
            if not is_missing(t):
                yield t, [angle % (2 * math.pi)]
        return
    velocity = seen(s, rows)
    depth_noise = 0.02
    for at, t in stamped(s, g, s["hz"], len(rows)):
        values = [velocity[at] + 0.003 * s["noise"] * g.gauss(0, 1) + wild(s["top"])]
        if s["axis"] == "heave":
            depth = 20 + rows[at][2] + depth_noise * g.gauss(0, 1)
            values.append(round(depth / 0.01) * 0.01)
        if not is_missing(t):
            yield t, values


HEADERS = {
    "surge": {"velocity.surge": "u (m/s)"},
    "sway": {"velocity.sway": "v (m/s)"},
    "heave": {"velocity.heave": "w (m/s)", "depth": "depth (m)"},
    "yaw": {"attitude.heading": "heading (rad)"},
}


def table(path, header, rows):
    lines = [",".join(["time (s)", *header])]
    lines += [",".join([f"{t:.4f}", *(f"{x:.7g}" for x in values)]) for t, values in rows]
    path.write_text("\n".join(lines) + "\n")


def speed_log(s, g, rows):
    """Returns the speeds of both propellers, rpm, or their commands; in yaw they turn against
    each other."""
    rpm = 1 / s["max_rate"] if s["voltage_power"] else 30 / math.pi
    usual = 0.001 if s["voltage_power"] else 10.0
    quantum = 2 * s["max_rate"] * rpm / s["levels"] if s["levels"] else usual
    for at, t in stamped(s, g, s["thrust_hz"], len(rows)):
        logged = round(rows[at][0] * rpm / quantum) * quantum
        yield t, [logged, -logged if s["axis"] == "yaw" else logged]


def battery_log(s, g, rows):
    for at, t in stamped(s, g, 2.0, len(rows)):
        yield t, [round(rows[at][3] + 0.03 * g.gauss(0, 1), 2)]


DIRECTIONS = {"surge": [1, 0, 0], "sway": [0, 1, 0], "heave": [0, 0, 1], "yaw": [1, 0, 0]}


def logs(s, name):
    """Returns the files of a trial."""
    names = ["speed", "motion"] + (["battery"] if s["voltage_power"] else [])
    return [f"{name}-{kind}.csv" for kind in names]


def claims(s, folder):
    """Writes the user's description of the vehicle and the trials."""
    each = s["force"] / (2 * s["arm"])
    each /= 1.0 if s["voltage_power"] else s["max_rate"] ** 2
    told = 'input = "command", ' if s["voltage_power"] else ""
    told += f"voltage_v = {NOMINAL_V}, " if s["states_voltage"] else ""
    back = s["known_reverse"] * each
    lines = [f'name = "stranger {s["seed"]}"']
    for name, side in (("A", -1), ("B", 1)):
        place = [0.0, side * s["arm"], 0.0] if s["axis"] == "yaw" else [0.0, 0.0, 0.0]
        lines += [
            "[[thruster]]",
            f'name = "{name}"',
            f"position_m = {place}",
            f"direction = {DIRECTIONS[s['axis']]}",
            f'curve = {{ kind = "quadratic", {told}forward = {each:.9g}, reverse = {back:.9g} }}',
        ]
    (folder / "vehicle.toml").write_text("\n".join(lines) + "\n")
    lines = ['vehicle = "vehicle.toml"']
    for name in TRIALS:
        lines += [
            "[[trial]]",
            f'name = "{name}"',
            f"log = {json.dumps(logs(s, name))}",
            f'dof = ["{s["axis"]}"]',
        ]
        if name in HELD_OUT:
            lines.append('role = "hold-out"')
    lines.append("[channels]")
    kind, unit = ("command", "-") if s["voltage_power"] else ("speed", "rpm")
    lines += [f'"thruster.{name}.{kind}" = {{ column = "{name} ({unit})" }}' for name in "AB"]
    if s["voltage_power"]:
        lines.append('"supply.voltage" = { column = "supply (V)" }')
    lines += [f'"{key}" = {{ column = "{name}" }}' for key, name in HEADERS[s["axis"]].items()]
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n")


def write(folder, seed, wanted=()):
    """Draws one vehicle and writes its folder."""
    s, g = draw(seed, wanted)
    folder.mkdir(parents=True, exist_ok=True)
    start, squares, count = 0.0, 0.0, 0
    for name, seconds in TRIALS.items():
        rows = drive(s, g, name, start)
        start += seconds
        squares, count = squares + sum(v * v for _, v, _, _ in rows), count + len(rows)
        unit = "-" if s["voltage_power"] else "rpm"
        table(
            folder / f"{name}-speed.csv", [f"A ({unit})", f"B ({unit})"], speed_log(s, g, rows)
        )
        if s["voltage_power"]:
            table(folder / f"{name}-battery.csv", ["supply (V)"], battery_log(s, g, rows))
        table(
            folder / f"{name}-motion.csv", HEADERS[s["axis"]].values(), motion_log(s, g, rows)
        )
    claims(s, folder)
    rms = math.sqrt(squares / count)
    truth = {
        "dof": s["axis"],
        "faults": s["faults"],
        "mass": s["mass"],
        "quadratic_drag": s["quadratic"],
        "linear_drag": s["linear"],
        "bias_force": s["bias"],
        "rms_speed": rms,
        "drag_at_rms": 0.5 * (drag(s, rms) - drag(s, -rms)),
        "settings": s,
    }
    (folder / "truth.json").write_text(json.dumps(truth, indent=1))
    return s


def main():
    out, number, seed, wanted = (
        Path(sys.argv[1]),
        int(sys.argv[2]),
        int(sys.argv[3]),
        sys.argv[4:],
    )
    known = FAULTS | UNMODELLED
    if unknown := [name for name in wanted if name not in known]:
        sys.exit(f"no fault is called {', '.join(unknown)}; there are {', '.join(known)}")
    if wanted and not any(all(axis in known[name][1] for name in wanted) for axis in AXES):
        sys.exit(f"no axis can have all of {', '.join(wanted)}")
    for k in range(seed, seed + number):
        s = write(out / f"{k:03}", k, wanted)
        print(f"{k:03}", s["axis"], "+".join(s["faults"]), flush=True)


if __name__ == "__main__":
    main()
