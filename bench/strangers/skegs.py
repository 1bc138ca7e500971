"""Draws boats with two thrusters aft, whose damping or velocity sensor is elsewhere, and counts inertias.

Shares nothing with Seaplant but the files, and needs Python alone. Nothing pushes sway. Damping in sway
acts at a centre that is the origin or up to 0.3 lengths from it, as a skeg or a keel moves it; the sensor
sits where the file says or up to 0.3 lengths from it. Forces of 2 % of the thrust, with a memory of 10 s,
disturb all axes.

    skegs.py PROGRAM OUT NUMBER SEED
"""

import json
import math
from random import Random

from running import arguments, identify

STEP, SECONDS = 0.02, 200.0
KINDS = {"neither": (0, 0), "damping": (1, 0), "sensor": (0, 1), "both": (1, 1)}
TRIALS = (("a", "fit"), ("b", "fit"), ("c", "hold-out"))
# An inertia that is off by more is another one.
WRONG = 0.2


def accelerations(boat, state, push):
    """Returns the rates of surge, sway and yaw of [Fossen2011, eq. 6.109] with damping at a centre."""
    u, v, r = state
    at = boat["damping_at"]
    across = v + at * r
    side = -boat["sway"][0] * across - boat["sway"][1] * across * abs(across)
    x = push[0] - boat["surge"][0] * u - boat["surge"][1] * u * abs(u)
    y = push[1] + side
    n = push[2] + at * side - boat["yaw"][0] * r - boat["yaw"][1] * r * abs(r)
    m, k, of_both, inertia = boat["mass"]
    # C(v) v of the mass matrix [m 0 0; 0 k c; 0 c I].
    momentum = k * v + of_both * r
    x += momentum * r
    y -= m * u * r
    n += (m - k) * u * v - of_both * u * r
    whole = k * inertia - of_both * of_both
    return x / m, (inertia * y - of_both * n) / whole, (k * n - of_both * y) / whole


def moved(boat, state, push):
    """Returns the state a step later, by Runge and Kutta's fourth order."""

    def plus(rates, part):
        return [x + part * STEP * rate for x, rate in zip(state, rates, strict=True)]

    a = accelerations(boat, state, push)
    b = accelerations(boat, plus(a, 0.5), push)
    c = accelerations(boat, plus(b, 0.5), push)
    d = accelerations(boat, plus(c, 1.0), push)
    all_four = zip(state, a, b, c, d, strict=True)
    return [x + STEP * (p + 2 * q + 2 * s + t) / 6 for x, p, q, s, t in all_four]


def drawn(g, kind):
    length = math.exp(g.uniform(math.log(0.7), math.log(4.0)))
    mass = 12.0 * length**3 * g.uniform(0.8, 1.3)
    sway = mass * g.uniform(1.3, 2.0)
    centre = length * g.uniform(-0.04, 0.04)
    inertia = sway * ((length * g.uniform(0.2, 0.28)) ** 2 + centre**2)
    thrust = mass * g.uniform(0.25, 0.6)
    arm = length * g.uniform(0.15, 0.25)
    has_skeg, is_elsewhere = KINDS[kind]

    def far():
        return length * g.choice((-1, 1)) * g.uniform(0.1, 0.3)

    def damping(size, speed, part):
        return [part * size / speed, (1 - part) * size / speed**2]

    speed, turn = g.uniform(0.6, 1.5), g.uniform(0.4, 0.9)
    return {
        "length": length,
        "mass": [mass, sway, sway * centre, inertia],
        "surge": damping(1.4 * thrust, speed, g.uniform(0.2, 0.8)),
        "sway": damping(sway * g.uniform(0.3, 0.8) * 0.3, 0.3, g.uniform(0.3, 1.0)),
        "yaw": damping(0.8 * thrust * arm, turn, g.uniform(0.3, 0.8)),
        "damping_at": far() if has_skeg else 0.0,
        "sensor_off": far() if is_elsewhere else 0.0,
        "sensor_at": length * g.uniform(-0.2, 0.2),
        "thrust": thrust,
        "arm": arm,
    }


def logged(g, boat):
    """Returns rows of 20 Hz (thrusters, gyroscope, heading) and of 5 Hz (velocities of the sensor)."""
    state, heading, commands, until = [0.0, 0.0, 0.0], g.uniform(-3, 3), [0.0, 0.0], 0.0
    gusts = [0.0, 0.0, 0.0]
    decay = math.exp(-STEP / 10.0)
    sizes = [0.02 * boat["thrust"], 0.02 * boat["thrust"], 0.02 * boat["thrust"] * boat["arm"]]
    fast, slow = [], []
    place = boat["sensor_at"] + boat["sensor_off"]
    for k in range(round(SECONDS / STEP)):
        t = k * STEP
        if t >= until:
            until = t + g.uniform(2.0, 9.0)
            commands = [round(g.uniform(-0.6, 1.0), 3) for _ in range(2)]
        u, v, r = state
        if k % 2 == 0:
            degrees = math.degrees(math.remainder(heading, 2 * math.pi)) + g.gauss(0, 0.1)
            fast.append([t, *commands, 0, 0, degrees, r + g.gauss(0, 0.001)])
        if k % 10 == 0:
            slow.append(
                [t, u + g.gauss(0, 0.004), v + place * r + g.gauss(0, 0.004), g.gauss(0, 0.004)]
            )
        port, starboard = (boat["thrust"] * c * abs(c) for c in commands)
        gusts = [
            decay * x + size * math.sqrt(1 - decay**2) * g.gauss(0, 1)
            for x, size in zip(gusts, sizes, strict=True)
        ]
        push = [
            port + starboard + gusts[0],
            gusts[1],
            boat["arm"] * (port - starboard) + gusts[2],
        ]
        state = moved(boat, state, push)
        heading += STEP * 0.5 * (r + state[2])
    return fast, slow


def write(path, names, rows):
    text = "".join(",".join(f"{x:.6g}" for x in row) + "\n" for row in rows)
    path.write_text(names + "\n" + text)


def draw(folder, seed, kind):
    g = Random(f"{kind} {seed}")
    boat = drawn(g, kind)
    folder.mkdir(parents=True)
    for name, _ in TRIALS:
        fast, slow = logged(g, boat)
        names = "t [s],port [1],starboard [1],roll [deg],pitch [deg],heading [deg],rate [rad/s]"
        write(folder / f"{name}-fast.csv", names, fast)
        write(folder / f"{name}-dvl.csv", "t [s],x [m/s],y [m/s],z [m/s]", slow)
    thruster = "".join(
        f"""[[thruster]]
name = "{name}"
position_m = [{-0.45 * boat["length"]:.4f}, {y:.4f}, 0]
direction = [1, 0, 0]
curve = {{ kind = "quadratic", input = "command", forward = {boat["thrust"]}, reverse = {boat["thrust"]} }}
"""
        for name, y in (("port", -boat["arm"]), ("starboard", boat["arm"]))
    )
    place = f"[sensor.dvl]\nposition_m = [{boat['sensor_at']}, 0, 0]\n"
    (folder / "vehicle.toml").write_text(f'name = "{kind} {seed}"\n{thruster}{place}')
    trials = "".join(
        f'[[trial]]\nname = "{name}"\nlog = ["{name}-fast.csv", "{name}-dvl.csv"]\nrole = "{role}"\n'
        for name, role in TRIALS
    )
    (folder / "campaign.toml").write_text(
        f"""vehicle = "vehicle.toml"
[channels]
"thruster.port.command" = {{ column = "port [1]" }}
"thruster.starboard.command" = {{ column = "starboard [1]" }}
"attitude.roll" = {{ column = "roll [deg]" }}
"attitude.pitch" = {{ column = "pitch [deg]" }}
"attitude.heading" = {{ column = "heading [deg]" }}
"rate.yaw" = {{ column = "rate [rad/s]" }}
"dvl.velocity.x" = {{ column = "x [m/s]" }}
"dvl.velocity.y" = {{ column = "y [m/s]" }}
"dvl.velocity.z" = {{ column = "z [m/s]" }}
[[plant]]
axes = ["surge", "sway", "yaw"]
{trials}"""
    )
    (folder / "truth.json").write_text(json.dumps(boat))


def judged(program, folder):
    """Returns the relative error of the inertia of yaw, whether its interval holds, and the trust in yaw."""
    results, error = identify(program, folder)
    if results is None:
        print(folder, error[-600:])
        return None
    truth = json.loads((folder / "truth.json").read_text())["mass"][3]
    plant = results["plants"]["surge-sway-yaw"]
    found = plant["parameters"]["mass.yaw"]
    holds = found["low95"] <= truth <= found["high95"]
    trust = plant["verdicts"].get("yaw", plant["verdict"])["trust"]
    place = plant["nuisances"].get("lever_x", {"value": 0.0})["value"]
    part = found["value"] / truth - 1
    print(
        f"{folder.name}: inertia {100 * part:+.1f} %, {'holds' if holds else '-'}, lever {place:.3f} m, {trust}"
    )
    return abs(part), holds, trust


def main():
    program, out, number, seed, _ = arguments(__doc__)
    for kind in KINDS:
        found = []
        for k in range(number):
            folder = out / f"{kind}-{seed + k}"
            if not folder.exists():
                draw(folder, seed + k, kind)
            found.append(judged(program, folder))
        found = [one for one in found if one]
        wrong = [one for one in found if one[0] > WRONG]
        usable = [one for one in found if one[2].startswith("usable")]
        print(
            f"{kind}: {len(found)} boats; inertia off by more than {WRONG:.0%}: {len(wrong)}, "
            f"{len([one for one in wrong if one in usable])} of them usable; right and doubtful: "
            f"{len([one for one in found if one not in wrong and one not in usable])}; "
            f"{sum(one[1] for one in found)} intervals hold",
            flush=True,
        )


if __name__ == "__main__":
    main()
