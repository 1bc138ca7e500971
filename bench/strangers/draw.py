"""Draws vehicles of six axes at random, drives them, and writes their logs as users have them.

Shares nothing with Seaplant but the files: the state is momentum, not velocity (Kirchhoff's
equations, so that C is never formed), attitude is a matrix, drag may be cross-flow in strips,
and the mass tensor is full. Each vehicle has one to three faults out of `FAULTS`.

    draw.py OUT NUMBER SEED [FAULT ...] [INSTRUMENTS]   # writes OUT/000 ..., each with truth.json

With faults named, each vehicle has these; a wake and those of single thrusters, `BY_NAME`, are there by name
only. Without a DVL a vehicle has one of the sets of `INSTRUMENTS`, if that is named: `healthy` in place
of a fault has none.
"""

import json
import multiprocessing
import sys
from pathlib import Path

import numpy as np
from running import chosen_faults, faults

RHO, G = 1025.0, 9.81
AXES = ["surge", "sway", "heave", "roll", "pitch", "yaw"]
STEP = 0.01
SECONDS = (300.0, 300.0, 150.0)
TRIALS = ["first", "second", "held-out"]

# Replacements of a DVL; attitude and a gyroscope are always present.
INSTRUMENTS = {
    "accelerometer": ["depth", "acceleration"],
    "usbl": ["depth", "fixes"],
    "accelerometer_and_usbl": ["depth", "acceleration", "fixes"],
}

# Each fault is a function of the vehicle `s` and the generator: it changes the truth, the logs
# or the files' description.
FAULTS, fault = faults()


@fault
def lag(s, g):
    s["lag_up"] = s["lag_down"] = g.uniform(0.1, 0.5)


@fault
def lag_two_way(s, g):
    s["lag_up"], s["lag_down"] = g.uniform(0.05, 0.2), g.uniform(0.25, 0.6)


@fault
def delay(s, g):
    s["delay"] = g.uniform(0.05, 0.4)


@fault
def reverse(s, g):
    s["reverse"] = g.uniform(0.6, 0.9)


@fault
def exponent(s, g):
    s["exponent"] = g.uniform(1.75, 2.15)


@fault
def thrust_scale(s, g):
    s["claimed_thrust"] = g.choice([0.1, 0.5, 2.0, 10.0])


@fault
def battery(s, g):
    s["sag"] = g.uniform(0.05, 0.15)


@fault
def slow_thrust_log(s, g):
    s["thrust_hz"] = g.choice([2.0, 4.0])


@fault
def wrench_log(s, g):
    s["wrench"] = True


@fault
def inflow(s, g):
    s["inflow"] = g.uniform(0.1, 0.3)


@fault
def tether(s, g):
    s["tether"] = g.uniform(0.02, 0.12)


@fault
def kicks(s, g):
    s["kicks"] = g.uniform(0.1, 0.3)


@fault
def current(s, g):
    s["current"] = g.uniform(0.05, 0.3)


@fault
def current_varies(s, g):
    s["current"], s["current_std"] = g.uniform(0.0, 0.2), g.uniform(0.03, 0.1)


@fault
def waves(s, g):
    s["waves"] = g.uniform(0.02, 0.1)


@fault
def strips(s, g):
    s["strips"] = True


@fault
def cross_drag(s, g):
    s["cross_drag"] = g.uniform(0.1, 0.3)


@fault
def noise(s, g):
    s["noise"] = g.uniform(2.0, 6.0)


@fault
def spikes(s, g):
    s["spikes"] = g.uniform(0.002, 0.02)


@fault
def dvl_scale(s, g):
    s["dvl_scale"] = g.uniform(0.97, 1.03)


@fault
def dvl_means(s, g):
    s["dvl_window"] = g.uniform(0.2, 0.8)


@fault
def dvl_late(s, g):
    s["dvl_late"] = g.uniform(0.05, 0.3)


@fault
def dvl_smoothed(s, g):
    s["dvl_smoothed"] = g.uniform(0.1, 0.5)


@fault
def dvl_turned(s, g):
    s["dvl_turned"] = np.radians(g.uniform(2.0, 6.0))


@fault
def dvl_place(s, g):
    s["dvl_place"] = s["length"] * g.uniform(-0.2, 0.2, 3)


@fault
def gap(s, g):
    s["gap"] = g.uniform(5.0, 30.0)


@fault
def gyro_bias(s, g):
    s["gyro_bias"] = g.uniform(-0.01, 0.01, 3)


@fault
def short_level(s, g):
    s["tilt"] = 0.0


# A fault that no model of Seaplant has, and faults of single thrusters.
BY_NAME, fault_by_name = faults()


@fault_by_name
def wake(s, g):
    s["wake"] = g.uniform(0.5, 2.0) * s["length"] ** 0.5


@fault_by_name
def slew(s, g):
    s["slew"] = g.uniform(0.3, 1.0)


@fault_by_name
def quick(s, g):
    shape = (len(TRIALS), 6, 4)
    s["tones"] = np.stack(
        [g.uniform(0.2, 1.0, shape), g.uniform(0.2, 2.5, shape), g.uniform(0, 6.28, shape)]
    )


@fault_by_name
def loaded(s, g):
    s["loaded"] = g.uniform(0.1, 0.35)


@fault_by_name
def gains(s, g):
    s["gain"] = s["gain"] * g.uniform(0.88, 1.12, (1, 8, 1))


@fault_by_name
def reverse_gains(s, g):
    s["gain"][:, :, 1] *= g.uniform(0.75, 1.0, 8)


@fault_by_name
def dead_band(s, g):
    s["dead_band"] = np.full(8, g.uniform(0.02, 0.1))


@fault_by_name
def dead_bands(s, g):
    s["dead_band"] = g.uniform(0.0, 0.1, 8)


@fault_by_name
def lags(s, g):
    s["lag_up"] = s["lag_down"] = g.uniform(0.05, 0.45, 8)


@fault_by_name
def lag_by_direction(s, g):
    lag_two_way(s, g)
    s["lag_of"] = "rising"


@fault_by_name
def fouled(s, g):
    s["gain"][:, g.integers(8)] *= g.uniform(0.75, 0.85)


@fault_by_name
def dead(s, g):
    s["gain"][:, g.integers(8)] = 0.0


@fault_by_name
def dead_in_one(s, g):
    s["gain"][g.integers(2), g.integers(8)] = 0.0


@fault_by_name
def reversed_thruster(s, g):
    s["gain"][:, g.integers(8)] *= -1.0


@fault_by_name
def exchanged(s, g):
    a, b = g.choice(8, 2, replace=False)
    s["follows"][[a, b]] = s["follows"][[b, a]]


@fault_by_name
def voltage(s, g):
    """Thrusters that are told commands, on a battery whose voltage is logged."""
    s["voltage_power"] = g.uniform(1.0, 2.0)
    s["resistance"] = g.uniform(0.02, 0.12)


@fault_by_name
def misplaced(s, g):
    s["claimed_places"] = s["places"] + g.normal(0.0, 0.02, (8, 3))


def skew(a):
    z = np.zeros(a.shape[:-1])
    x, y, w = a[..., 0], a[..., 1], a[..., 2]
    return np.stack(
        [np.stack([z, -w, y], -1), np.stack([w, z, -x], -1), np.stack([-y, x, z], -1)], -2
    )


def positive(g, diagonal, spread):
    """Returns a symmetric matrix with this diagonal and correlations of about `spread`."""
    a = np.eye(6) + spread * g.standard_normal((6, 6)) / np.sqrt(2.0)
    c = a @ a.T
    d = np.sqrt(np.diag(c))
    root = np.sqrt(diagonal)
    return c / np.outer(d, d) * np.outer(root, root)


def draw(seed, wanted=()):
    """Draws a vehicle: sizes, mass, drag, thrusters, sensors and faults, at random or as
    requested."""
    g = np.random.default_rng(seed)
    length = np.exp(g.uniform(np.log(0.35), np.log(3.5)))
    size = length * np.array([1.0, g.uniform(0.35, 0.9), g.uniform(0.3, 0.8)])
    displaced = RHO * np.prod(size) * g.uniform(0.3, 0.6)
    mass = displaced * g.uniform(0.99, 1.0)
    radii = size / np.sqrt(12.0) * g.uniform(0.8, 1.1, 3)
    r2 = radii**2
    inertia = mass * np.array([r2[1] + r2[2], r2[0] + r2[2], r2[0] + r2[1]])
    cg = np.array([0.0, 0.0, size[2] * g.uniform(0.02, 0.08)])
    rigid = np.zeros((6, 6))
    rigid[:3, :3] = mass * np.eye(3)
    rigid[:3, 3:] = -mass * skew(cg)
    rigid[3:, :3] = mass * skew(cg)
    rigid[3:, 3:] = np.diag(inertia) - mass * skew(cg) @ skew(cg)
    parts = np.array(
        [
            g.uniform(lo, hi)
            for lo, hi in [
                (0.2, 0.8),
                (0.5, 1.3),
                (0.6, 1.6),
                (0.2, 0.9),
                (0.3, 1.2),
                (0.3, 1.2),
            ]
        ]
    )
    added = positive(g, parts * np.r_[displaced * np.ones(3), inertia], g.uniform(0.0, 0.1))
    top = g.uniform(0.5, 1.2) * length**0.25
    rate = g.uniform(0.5, 1.2) / length**0.4
    area = np.array([size[1] * size[2], size[0] * size[2], size[0] * size[1]])
    reach = (
        np.array(
            [
                size[1] ** 2 + size[2] ** 2,
                size[0] ** 2 + size[2] ** 2,
                size[0] ** 2 + size[1] ** 2,
            ]
        )
        / 4.0
    )
    cd = g.uniform(0.7, 1.4, 6)
    quadratic = 0.5 * RHO * cd * np.r_[area, area[[1, 2, 1]] * reach**1.5 * 0.4]
    speed = top * np.array([1.0, 0.6, 0.5, 0.0, 0.0, 0.0])
    speed[3:] = rate * np.array([0.5, 0.5, 1.0])
    linear = quadratic * speed * g.uniform(0.05, 0.5, 6)
    s = {
        "seed": seed,
        "length": length,
        "size": size,
        "mass": mass,
        "displaced": displaced,
        "rigid": rigid,
        "M": rigid + added,
        "cg": cg,
        "cb": np.array([0.0, 0.0, 0.0]),
        "linear": linear,
        "quadratic": quadratic,
        "top": top,
        "rate": rate,
        "speed": speed,
        "lag_up": 0.0,
        "lag_down": 0.0,
        # What `lag_up` is of: propellers that turn faster, or those whose speed rises.
        "lag_of": "faster",
        "slew": 0.0,
        "loaded": 0.0,
        "tones": None,
        "delay": 0.0,
        "reverse": 1.0,
        "exponent": 2.0,
        "claimed_thrust": 1.0,
        "sag": 0.0,
        "voltage_power": 0.0,
        "resistance": 0.0,
        "thrust_hz": float(g.choice([10.0, 20.0])),
        "wrench": False,
        "inflow": 0.0,
        "tether": 0.0,
        "kicks": 0.0,
        "current": 0.0,
        "current_std": 0.0,
        "waves": 0.0,
        "wake": 0.0,
        "strips": False,
        "cross_drag": 0.0,
        "noise": 1.0,
        "spikes": 0.0,
        "dvl_scale": 1.0,
        "dvl_window": 0.0,
        "dvl_late": 0.0,
        "dvl_smoothed": 0.0,
        "dvl_turned": 0.0,
        "dvl_place": np.zeros(3),
        "gap": 0.0,
        "gyro_bias": np.zeros(3),
        "tilt": g.uniform(0.05, 0.3),
        "dvl_hz": float(g.choice([5.0, 8.0, 10.0])),
        "imu_hz": float(g.choice([25.0, 50.0])),
        "pilot_hz": float(g.choice([10.0, 20.0])),
        "states_rigid_body": bool(g.uniform() < 0.5),
    }
    thrusters(s, g)
    s["claimed_places"] = s["places"]
    # By trial, thruster and way: ahead, in reverse.
    s["gain"] = np.ones((len(TRIALS), 8, 2))
    # Which log each propeller follows.
    s["follows"] = np.arange(8)
    # Part of full speed below which a propeller does not push.
    s["dead_band"] = np.zeros(8)
    chosen = g.choice(list(FAULTS), size=g.integers(1, 4), replace=False)
    s["instruments"] = next(
        (INSTRUMENTS[name] for name in wanted if name in INSTRUMENTS), ["dvl"]
    )
    known = FAULTS | BY_NAME
    s["faults"] = chosen_faults(wanted, known, chosen)
    for name in s["faults"]:
        known[name](s, g)
    s["coupling"] = np.zeros((6, 6))
    if s["cross_drag"]:
        scale = np.sqrt(linear)
        s["coupling"] = s["cross_drag"] * np.outer(scale, scale) * g.uniform(-1, 1, (6, 6))
        np.fill_diagonal(s["coupling"], 0.0)
    return s, g


def thrusters(s, g):
    """Returns eight propellers: four vectored, four vertical; strong enough for the required
    speeds."""
    lx, ly, lz = s["size"] / 2
    angle = np.radians(g.uniform(30, 50))
    c, w = np.cos(angle), np.sin(angle)
    z = lz * g.uniform(-0.2, 0.3)
    places = [[0.8 * lx, y * ly, z] for y in (1, -1)] + [
        [-0.8 * lx, y * ly, z] for y in (1, -1)
    ]
    ways = [[c, -w, 0], [c, w, 0], [c, w, 0], [c, -w, 0]]
    places += [[x * 0.6 * lx, y * 0.8 * ly, 0.0] for x in (1, -1) for y in (1, -1)]
    ways += [[0.0, 0.0, -1.0]] * 4
    s["places"], s["ways"] = np.array(places), np.array(ways)
    s["B"] = np.vstack([s["ways"].T, np.cross(s["places"], s["ways"]).T])
    drag = (s["quadratic"] * s["speed"] + s["linear"]) * s["speed"]
    share = np.abs(np.linalg.pinv(s["B"]))
    s["max_force"] = 2.5 * (share.max(0) * drag).max()
    s["max_rate"] = g.uniform(100.0, 300.0)


def drag_force(s, nu):
    if not s["strips"]:
        return (s["linear"] + s["quadratic"] * np.abs(nu)) * nu + nu @ s["coupling"].T
    # Cross-flow: each strip across the hull has its own sideways and downward speed.
    x = (np.arange(11) + 0.5) / 11 * s["size"][0] - s["size"][0] / 2
    force = (s["linear"] + s["quadratic"] * np.abs(nu)) * nu
    v = nu[:, 1:2] + x * nu[:, 5:6]
    w = nu[:, 2:3] - x * nu[:, 4:5]
    flow = np.hypot(v, w)
    fy = s["quadratic"][1] / 11 * flow * v
    fz = s["quadratic"][2] / 11 * flow * w
    force[:, 1] = s["linear"][1] * nu[:, 1] + fy.sum(1)
    force[:, 2] = s["linear"][2] * nu[:, 2] + fz.sum(1)
    force[:, 4] = s["linear"][4] * nu[:, 4] - (x * fz).sum(1)
    force[:, 5] = s["linear"][5] * nu[:, 5] + (x * fy).sum(1)
    return force


def derivative(s, state, thrust, outside, water, wake=None):
    """Computes rates of momentum, attitude and position; three trials at a time. Drag is that of a flow
    that follows motion late, if there is one."""
    p, rot, _ = state
    relative = p @ s["inverse"].T
    a, w = p[:, :3], p[:, 3:]
    v, omega = relative[:, :3], relative[:, 3:]
    force = thrust + outside - drag_force(s, relative if wake is None else wake)
    down = rot[:, 2, :]
    weight, lift = s["mass"] * G, s["displaced"] * G
    force[:, :3] += (weight - lift) * down
    force[:, 3:] += np.cross(weight * s["cg"] - lift * s["cb"], down)
    dp = np.hstack([np.cross(a, omega), np.cross(w, omega) + np.cross(a, v)]) + force
    over_ground = v + np.einsum("nij,ni->nj", rot, water)
    return dp, rot @ skew(omega), np.einsum("nij,nj->ni", rot, over_ground)


def piloted(s, drag, pinv, want, seen, angle, place):
    """Computes commands: levels of force on each axis; roll and pitch controlled, depth and
    speed bounded."""
    mass = np.diag(s["M"])
    bandwidth = np.clip(drag / (mass * np.maximum(s["speed"], 1e-9)), 0.3, 1.5)
    spring = s["mass"] * G * s["cg"][2]
    tau = want * drag * 1.2
    target = want[:, 3:5] * s["tilt"]
    stiff = 0.6 * spring + mass[3:5] * 0.8
    tau[:, 3:5] = stiff * (target - angle) + spring * target - (mass[3:5] * 1.2) * seen[:, 3:5]
    tau[:, 2] -= 0.15 * bandwidth[2] * mass[2] * place[:, 2] / s["length"] ** 0.5
    fast = np.maximum(np.abs(seen) / np.maximum(s["speed"], 1e-9) - 1, 0)
    tau -= 0.3 * drag * fast * np.sign(seen)
    force = np.clip(tau @ pinv.T, -s["max_force"], s["max_force"])
    command = np.sign(force) * np.sqrt(np.abs(force) / s["max_force"]) * s["max_rate"]
    return np.round(command / s["max_rate"] * 400) / 400 * s["max_rate"]


def followed(s, heard, speed):
    """Returns propeller speed after a step and in its middle; up and down may differ."""
    if s["slew"]:
        most = s["max_rate"] * STEP / s["slew"]
        after = speed + np.clip(heard - speed, -most, most)
        return after, 0.5 * (after + speed)
    if not np.any(s["lag_up"]):
        return heard, heard
    up = (heard * speed >= 0) & (np.abs(heard) > np.abs(speed))
    if s["lag_of"] == "rising":
        up = heard > speed
    blend = np.where(up, np.exp(-STEP / s["lag_up"]), np.exp(-STEP / s["lag_down"]))
    after = heard + (speed - heard) * blend
    return after, 0.5 * (after + speed)


# A lithium battery of four cells, V; the bollard test was made at the nominal voltage.
FULL_V, EMPTY_V, NOMINAL_V = 16.8, 13.6, 15.0


def supplied(s, load, done):
    """Returns the voltage of the battery at this fraction of all trials, under this load."""
    return (FULL_V - (FULL_V - EMPTY_V) * done) * (1 - s["resistance"] * load)


def propelled(s, speed, relative, done):
    """Computes thrust of each propeller, at this fraction of all trials."""
    part = speed[:, s["follows"]] / s["max_rate"]
    beyond = np.maximum(np.abs(part) - s["dead_band"], 0.0) / (1.0 - s["dead_band"])
    pushed = np.sign(part) * beyond ** s["exponent"] * s["max_force"]
    pushed = np.where(pushed < 0, s["reverse"] * pushed, pushed)
    pushed *= np.where(pushed < 0, s["gain"][:, :, 1], s["gain"][:, :, 0])
    pushed *= (1 - s["sag"] * done)[:, None]
    # The current of all lowers the voltage; power goes with the cube of speed.
    load = (np.abs(part) ** 3).mean(1, keepdims=True)
    pushed *= 1 - s["loaded"] * load
    if s["voltage_power"]:
        pushed *= (supplied(s, load, done[:, None]) / NOMINAL_V) ** s["voltage_power"]
    if s["inflow"]:
        turning = np.cross(relative[:, None, 3:], s["places"][None])
        own = relative[:, :3] @ s["ways"].T + np.einsum("nij,ij->ni", turning, s["ways"])
        pushed -= s["inflow"] * s["max_force"] / s["top"] * np.abs(part) * own
    return pushed


def desired(s, holds, levels, t):
    """Returns the force that the pilot wants on each axis in each trial, as fractions: levels that are
    held, or tones."""
    if s["tones"] is not None:
        size, omega, phase = s["tones"]
        return (size * np.sin(omega * t + phase)).sum(2) / size.sum(2)
    trials = range(len(TRIALS))
    at = [[np.searchsorted(holds[k * 6 + axis], t) for axis in range(6)] for k in trials]
    return np.take_along_axis(levels, np.array(at)[:, :, None], 2)[:, :, 0]


def simulate(s, g):
    """Drives all trials at once; returns the history of every step."""
    n, count = len(TRIALS), int(max(SECONDS) / STEP)
    s["inverse"] = np.linalg.inv(s["M"])
    pinv = np.linalg.pinv(s["B"])
    drag = (s["quadratic"] * s["speed"] + s["linear"]) * s["speed"]
    holds = [g.uniform(3, 12, 200).cumsum() for _ in range(n * 6)]
    levels = g.uniform(-1, 1, (n, 6, 201))
    rot = np.repeat(np.eye(3)[None], n, 0)
    place = np.zeros((n, 3))
    speed_prop = np.zeros((n, 8))
    late = round(s["delay"] / STEP)
    commands = np.zeros((count + late + 1, n, 8))
    out = {
        k: np.zeros((count, n, w))
        for k, w in [
            ("nu", 6),
            ("euler", 3),
            ("place", 3),
            ("command", 8),
            ("wrench", 6),
            ("volts", 1),
        ]
    }
    every = max(1, round(1.0 / (s["pilot_hz"] * STEP)))
    ou = np.zeros((n, 6))
    water_var = np.zeros((n, 3))
    heading = g.uniform(0, 2 * np.pi)
    water_mean = s["current"] * np.array([np.cos(heading), np.sin(heading), 0.0])
    wave_phase = g.uniform(0, 2 * np.pi, (3, 6, n))
    wave_rate = 2 * np.pi / g.uniform(4, 9, 3)
    kick, kick_left = np.zeros((n, 6)), np.zeros(n)
    relative0 = np.zeros((n, 6))
    relative0[:, :3] = -np.einsum("nij,i->nj", rot, water_mean)
    p, wake = relative0 @ s["M"].T, relative0
    seconds = np.array(SECONDS)
    command = np.zeros((n, 8))
    for k in range(count):
        t = k * STEP
        # Where the flow accelerates, its pressure carries a neutrally buoyant body along: the
        # momentum relative to the water is conserved.
        if s["current_std"]:
            tau = 60.0
            water_var += -water_var * STEP / tau + s["current_std"] * np.sqrt(
                2 * STEP / tau
            ) * (g.standard_normal((n, 3)) * [1, 1, 0.2])
        water = water_mean + water_var
        relative = p @ s["inverse"].T
        nu = relative.copy()
        nu[:, :3] += np.einsum("nij,ni->nj", rot, water)
        roll = np.arctan2(rot[:, 2, 1], rot[:, 2, 2])
        pitch = -np.arcsin(np.clip(rot[:, 2, 0], -1, 1))
        yaw = np.arctan2(rot[:, 1, 0], rot[:, 0, 0])
        if k % every == 0:
            want = desired(s, holds, levels, t)
            seen = nu + g.standard_normal((n, 6)) * 0.003
            angle = np.stack([roll, pitch], 1) + g.standard_normal((n, 2)) * 0.003
            command = piloted(s, drag, pinv, want, seen, angle, place)
        commands[k + late] = command
        heard = commands[k]
        speed_prop, middle = followed(s, heard, speed_prop)
        done = (t + np.r_[0, np.cumsum(seconds)[:-1]]) / seconds.sum()
        pushed = propelled(s, middle, relative, done)
        thrust = pushed @ s["B"].T
        outside = np.zeros((n, 6))
        if s["tether"]:
            ou += -ou * STEP / 8.0 + np.sqrt(2 * STEP / 8.0) * g.standard_normal((n, 6))
            outside += s["tether"] * drag * ou
        if s["kicks"]:
            start = (g.uniform(size=n) < STEP / 25.0) & (kick_left <= 0)
            kick[start] = s["kicks"] * drag * g.standard_normal((start.sum(), 6))
            kick_left = np.where(start, 3.0, kick_left - STEP)
            outside += np.where((kick_left > 0)[:, None], kick, 0.0)
        if s["waves"]:
            swing = np.sin(wave_rate[:, None, None] * t + wave_phase).sum(0).T
            outside += s["waves"] * drag * swing
        out["nu"][k], out["place"][k] = nu, place
        out["euler"][k] = np.stack([roll, pitch, yaw], 1)
        out["command"][k] = command
        load = (np.abs(middle / s["max_rate"]) ** 3).mean(1, keepdims=True)
        out["volts"][k] = supplied(s, load, done[:, None])
        # A ship's computer that logs a wrench knows its own curves, no lag.
        c = command / s["max_rate"]
        out["wrench"][k] = (np.sign(c) * c**2 * s["max_force"]) @ s["B"].T
        state = (p, rot, place)
        if s["wake"]:
            wake = wake + STEP / s["wake"] * (relative - wake)
        flow = wake if s["wake"] else None
        around = (thrust, outside, water, flow)
        k1 = derivative(s, state, *around)
        k2 = derivative(s, [x + 0.5 * STEP * d for x, d in zip(state, k1)], *around)
        k3 = derivative(s, [x + 0.5 * STEP * d for x, d in zip(state, k2)], *around)
        k4 = derivative(s, [x + STEP * d for x, d in zip(state, k3)], *around)
        p, rot, place = (
            x + STEP / 6 * (a + 2 * b + 2 * c_ + d)
            for x, a, b, c_, d in zip(state, k1, k2, k3, k4)
        )
        u, _, v = np.linalg.svd(rot)
        rot = u @ v
        if not np.isfinite(p).all():
            raise FloatingPointError(f"vehicle {s['seed']} runs away at {t:.1f} s")
    return out


def sampled(values, hz, window=0.0, late=0.0):
    """Returns rows of `values` at `hz`, each the mean of the `window` seconds that end at it."""
    rows = np.arange(0, len(values) - 1, 1.0 / (hz * STEP)).round().astype(int)
    width = max(1, round(window / STEP))
    if width > 1:
        total = np.cumsum(np.concatenate([np.zeros_like(values[:1]), values]), 0)
        low = np.maximum(rows + 1 - width, 0)
        picked = (total[rows + 1] - total[low]) / (rows + 1 - low)[:, None]
    else:
        picked = values[np.maximum(rows - round(late / STEP), 0)]
    return rows * STEP, picked


def behind_a_lag(values, lag):
    """Returns `values` after a first-order lag."""
    behind, keep = values.copy(), np.exp(-STEP / lag) if lag else 0.0
    for k in range(1, len(values)):
        behind[k] = keep * behind[k - 1] + (1.0 - keep) * values[k]
    return behind


def table(path, header, time, columns):
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [",".join(["time (s)", *header])]
    for t, row in zip(time, columns):
        lines.append(f"{t:.3f}," + ",".join("" if np.isnan(x) else f"{x:.6g}" for x in row))
    path.write_text("\n".join(lines) + "\n")


def write(s, g, out, folder):
    noise = s["noise"]
    tilt = s["dvl_turned"]
    turn = np.array(
        [[np.cos(tilt), -np.sin(tilt), 0], [np.sin(tilt), np.cos(tilt), 0], [0, 0, 1]]
    )
    for k, trial in enumerate(TRIALS):
        count = int(SECONDS[k] / STEP)
        nu, euler = out["nu"][:count, k], out["euler"][:count, k]
        time, rows = sampled(
            out["wrench" if s["wrench"] else "command"][:count, k], s["thrust_hz"]
        )
        if s["wrench"]:
            table(
                folder / trial / "thrust.csv",
                [f"{a} force ({'N' if i < 3 else 'N m'})" for i, a in enumerate(AXES)],
                time,
                rows,
            )
        else:
            unit, full = ("-", s["max_rate"]) if s["voltage_power"] else ("rad/s", 1.0)
            header = [f"T{i + 1} ({unit})" for i in range(8)]
            table(folder / trial / "thrust.csv", header, time, rows / full)
        if s["voltage_power"]:
            time, rows = sampled(out["volts"][:count, k], 2.0)
            rows = np.round(rows + 0.03 * g.standard_normal(rows.shape), 2)
            table(folder / trial / "battery.csv", ["supply (V)"], time, rows)
        if s["instruments"] == ["dvl"]:
            write_dvl(s, g, nu, turn, SECONDS[k], folder / trial)
            leak = np.zeros_like(euler)
        else:
            leak = write_without_dvl(s, g, nu, euler, out["place"][:count, k], folder / trial)
        both = np.hstack([nu[:, 3:] + s["gyro_bias"], euler + leak])
        time, rows = sampled(both, s["imu_hz"])
        rows = rows + 0.002 * noise * g.standard_normal(rows.shape)
        header = [
            "p (rad/s)",
            "q (rad/s)",
            "r (rad/s)",
            "roll (rad)",
            "pitch (rad)",
            "yaw (rad)",
        ]
        table(folder / trial / "imu.csv", header, time, rows)
    claims(s, folder)


def write_dvl(s, g, nu, turn, seconds, folder):
    at = nu[:, :3] + np.cross(nu[:, 3:], s["dvl_place"])
    seen = behind_a_lag(at @ turn, s["dvl_smoothed"])
    time, rows = sampled(seen, s["dvl_hz"], s["dvl_window"], s["dvl_late"])
    rows = rows * s["dvl_scale"] + 0.003 * s["noise"] * g.standard_normal(rows.shape)
    wild = g.uniform(size=rows.shape) < s["spikes"]
    rows = np.where(wild, rows + g.standard_normal(rows.shape) * s["top"], rows)
    if s["gap"]:
        begin = g.uniform(20, seconds - 60)
        rows[(time > begin) & (time < begin + s["gap"])] = np.nan
    table(folder / "dvl.csv", ["x (m/s)", "y (m/s)", "z (m/s)"], time, rows)


def write_without_dvl(s, g, nu, euler, place, folder):
    """Writes logs of the replacement of a DVL; returns the slow errors of attitude."""
    count = len(nu)
    leak = np.zeros((count, 3))
    # An attitude filter has an error of a third of a degree, which changes smoothly within half
    # a minute.
    std, tau = np.radians(0.3), 20.0
    driven = g.standard_normal((count, 2)) * np.sqrt(2 * STEP / tau)
    smooth = np.zeros((2, 2))
    for k in range(count):
        smooth[0] += -smooth[0] * STEP / tau + driven[k]
        smooth[1] += (smooth[0] - smooth[1]) * STEP / tau
        leak[k, :2] = smooth[1] * std * np.sqrt(2)
    if "acceleration" in s["instruments"]:
        v, omega = nu[:, :3], nu[:, 3:]
        roll, pitch = euler[:, 0], euler[:, 1]
        down = np.stack(
            [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)], 1
        )
        felt = np.gradient(v, STEP, axis=0) + np.cross(omega, v) - G * down
        felt += 0.03 * g.standard_normal(3)
        time, rows = sampled(felt, s["imu_hz"])
        rows = rows + 0.05 * s["noise"] * g.standard_normal(rows.shape)
        table(folder / "accelerometer.csv", ["ax (m/s2)", "ay (m/s2)", "az (m/s2)"], time, rows)
    time, rows = sampled(place[:, 2:], 10.0)
    rows = rows + 0.005 * s["noise"] * g.standard_normal(rows.shape)
    table(folder / "depth.csv", ["depth (m)"], time, rows)
    if "fixes" in s["instruments"]:
        time, rows = sampled(place[:, :2], 0.5)
        rows = rows + 0.2 * s["noise"] * g.standard_normal(rows.shape)
        table(folder / "usbl.csv", ["north (m)", "east (m)"], time, rows)
    return leak


def claims(s, folder):
    """Writes the user's description of the vehicle and the trials."""
    lines = [
        f'name = "stranger {s["seed"]}"',
        f"dry_mass_kg = {s['mass']:.5g}",
        f"size_m = [{', '.join(f'{x:.4g}' for x in s['size'])}]",
    ]
    if not s["wrench"]:
        # The bollard test was made at full speed.
        factor = s["claimed_thrust"] * s["max_force"]
        factor /= 1.0 if s["voltage_power"] else s["max_rate"] ** 2
        told = 'input = "command", ' if s["voltage_power"] else ""
        for i, (place, way) in enumerate(zip(s["claimed_places"], s["ways"])):
            lines += [
                "[[thruster]]",
                f'name = "T{i + 1}"',
                f"position_m = {place.tolist()}",
                f"direction = {way.tolist()}",
                f'curve = {{ kind = "quadratic", {told}forward = {factor:.8g}, reverse = {factor:.8g} }}',
            ]
    if s["states_rigid_body"]:
        lines += [
            "[rigid_body]",
            f"mass_kg = {s['mass']:.8g}",
            f"centre_of_gravity_m = {s['cg'].tolist()}",
        ]
        about = s["rigid"][3:, 3:] + s["mass"] * skew(s["cg"]) @ skew(s["cg"])
        lines += [
            f"inertia_kg_m2 = {about.tolist()}",
            "[buoyancy]",
            f"displaced_kg = {s['displaced']:.8g}",
            f"centre_m = {s['cb'].tolist()}",
        ]
    (folder / "vehicle.toml").write_text("\n".join(lines) + "\n")
    lines = [
        'vehicle = "vehicle.toml"',
        "[[plant]]",
        'axes = ["surge", "sway", "heave", "roll", "pitch", "yaw"]',
    ]
    if "strips" not in s["faults"]:
        lines.append('symmetry = "none"')
    names = {"dvl": "dvl", "depth": "depth", "acceleration": "accelerometer", "fixes": "usbl"}
    files = ["thrust", *[names[x] for x in s["instruments"]], "imu"]
    if s["voltage_power"]:
        files.append("battery")
    for trial in TRIALS:
        lines += [
            "[[trial]]",
            f'name = "{trial}"',
            f"log = {json.dumps([f'{trial}/{name}.csv' for name in files])}",
        ]
        if trial == "held-out":
            lines.append('role = "hold-out"')
    lines.append("[channels]")
    if s["wrench"]:
        lines += [f'"wrench.{a}" = {{ column = "{a} force" }}' for a in AXES]
    else:
        told = "command" if s["voltage_power"] else "speed"
        lines += [f'"thruster.T{i + 1}.{told}" = {{ column = "T{i + 1}" }}' for i in range(8)]
    if s["voltage_power"]:
        lines.append('"supply.voltage" = { column = "supply" }')
    if "dvl" in s["instruments"]:
        lines += [f'"dvl.velocity.{a}" = {{ column = "{a}" }}' for a in "xyz"]
    if "acceleration" in s["instruments"]:
        lines += [f'"acceleration.{a}" = {{ column = "a{a}" }}' for a in "xyz"]
    if "depth" in s["instruments"]:
        lines.append('"depth" = { column = "depth" }')
    if "fixes" in s["instruments"]:
        lines += [f'"position.{a}" = {{ column = "{a}" }}' for a in ("north", "east")]
    lines += [f'"rate.{a}" = {{ column = "{c}" }}' for a, c in zip(AXES[3:], "pqr")]
    lines += [
        '"attitude.roll" = { column = "roll" }',
        '"attitude.pitch" = { column = "pitch" }',
        '"attitude.heading" = { column = "yaw" }',
    ]
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n")


def one(job):
    folder, seed, wanted = job
    s, g = draw(seed, wanted)
    out = simulate(s, g)
    write(s, g, out, folder)
    count = int(SECONDS[0] / STEP)
    rms = np.sqrt((out["nu"][:count, :2] ** 2).mean((0, 1)))
    drag = (s["linear"] + s["quadratic"] * rms) * rms
    tilt = np.abs(out["euler"][:count, :2, :2]).max()
    truth = {
        "seed": seed,
        "faults": s["faults"],
        "instruments": s["instruments"],
        "length_m": s["length"],
        "M": s["M"].tolist(),
        "rigid": s["rigid"].tolist(),
        "linear": s["linear"].tolist(),
        "quadratic": s["quadratic"].tolist(),
        "coupling": s["coupling"].tolist(),
        "strips": s["strips"],
        "rms_speed": rms.tolist(),
        "drag_at_rms": drag.tolist(),
        "largest_tilt_rad": float(tilt),
        "weight_minus_buoyancy": (s["mass"] - s["displaced"]) * G,
        "lever_z": s["mass"] * G * s["cg"][2],
        "claimed_thrust": float(s["claimed_thrust"]),
        "gain": s["gain"].tolist(),
        "follows": s["follows"].tolist(),
        "max_rate": s["max_rate"],
        "dead_band": s["dead_band"].tolist(),
        "lag_up": np.asarray(s["lag_up"]).tolist(),
        "lag_down": np.asarray(s["lag_down"]).tolist(),
        **{
            k: s[k]
            for k in [
                "slew",
                "loaded",
                "delay",
                "reverse",
                "exponent",
                "sag",
                "voltage_power",
                "resistance",
                "thrust_hz",
                "inflow",
                "tether",
                "kicks",
                "current",
                "current_std",
                "waves",
                "noise",
                "spikes",
                "dvl_scale",
                "dvl_window",
                "dvl_late",
                "dvl_smoothed",
                "dvl_turned",
                "gap",
            ]
        },
    }
    (folder / "truth.json").write_text(json.dumps(truth, indent=1, default=float))
    return folder.name, s["faults"], s["length"], rms, tilt


def main():
    out, number, seed, wanted = (
        Path(sys.argv[1]),
        int(sys.argv[2]),
        int(sys.argv[3]),
        sys.argv[4:],
    )
    known = {**FAULTS, **BY_NAME, **INSTRUMENTS, "healthy": None}
    if unknown := [name for name in wanted if name not in known]:
        sys.exit(f"no fault is called {', '.join(unknown)}; there are {', '.join(known)}")
    jobs = [(out / f"{k:03}", k, wanted) for k in range(seed, seed + number)]
    with multiprocessing.Pool() as pool:
        for name, faults, length, rms, tilt in pool.imap(one, jobs):
            print(
                name,
                f"{length:.2f} m",
                "+".join(faults),
                np.round(rms, 2),
                f"tilt {tilt:.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
