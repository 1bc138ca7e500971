"""Draws vehicles whose thrust is not what their files say, with a known weight, and counts the scale.

Shares nothing with Seaplant but the files, and needs Python alone. Each vehicle moves in heave for ten
minutes under random thrust of up to 100 N and a tether force with a memory of 30 s, and carries a weight
once or on and off four times. What its thrusters give is 0.8 to 1.25 times what the file says.

    weights.py PROGRAM OUT NUMBER SEED [WEIGHT_N TIMES TETHER_N]
"""

import json
import math
import statistics
from random import Random

from running import arguments, identify

G, RHO, STEP, SECONDS = 9.80665, 1025.0, 0.01, 600.0
# Standard error of the scale from the Fisher information of such a trial, by weight, times and tether.
BOUNDS = {
    (10, 1): {0.5: 0.022, 2: 0.056, 5: 0.096},
    (10, 4): {0.5: 0.015, 2: 0.032, 5: 0.053},
    (20, 4): {0.5: 0.007, 2: 0.016, 5: 0.026},
}


def moved(w, push, linear, quadratic, mass):
    """Returns the velocity a step later, by Runge and Kutta's fourth order.

    By Euler's rule a vehicle would have d h / 2 less mass, which is 1 to 3 % of it.
    """

    def rate(w):
        return (push - linear * w - quadratic * w * abs(w)) / mass

    a = rate(w)
    b = rate(w + 0.5 * STEP * a)
    c = rate(w + 0.5 * STEP * b)
    d = rate(w + STEP * c)
    return w + STEP * (a + 2 * b + 2 * c + d) / 6


def draw(folder, seed, weight_n, times, tether_n):
    g = Random(seed)
    mass, linear, quadratic = g.uniform(15, 60), g.uniform(2, 30), g.uniform(20, 150)
    excess, scale = g.uniform(-8, 8), math.exp(g.uniform(math.log(0.8), math.log(1.25)))
    # Lead: its weight in water by its mass and density.
    density = 11340.0
    lead = weight_n / (G * (1 - RHO / density))
    period = SECONDS / times
    hung = [((k + 0.5) * period, (k + 1.0) * period) for k in range(times)]
    full = 100.0 / 250.0**2
    w = rpm = depth = tether = 0.0
    command, until, rows = 0.0, 0.0, []
    decay = math.exp(-STEP / 30.0)
    kick = tether_n * math.sqrt(1 - decay * decay)
    depth = 40.0
    for k in range(round(SECONDS / STEP)):
        t = k * STEP
        hangs = any(a <= t < b for a, b in hung)
        if k % 10 == 0:
            if t >= until:
                until = t + g.uniform(2.0, 8.0)
                pull = 0.0 if g.random() < 0.2 else g.uniform(-100.0, 100.0)
            # A pilot who keeps the vehicle at its depth, and carries what hangs on it.
            held = pull - 12.0 * (depth - 40.0) - 20.0 * w - (weight_n if hangs else 0.0)
            held = max(-100.0, min(100.0, held))
            command = math.copysign(math.sqrt(abs(held) / full), held)
            rpm = round(command * 60 / (2 * math.pi))
            rows.append([t, rpm, w + g.gauss(0, 0.004), depth + g.gauss(0, 0.005)])
        n = rpm * 2 * math.pi / 60
        thrust = scale * full * n * abs(n)
        tether = decay * tether + kick * g.gauss(0, 1)
        all_mass = mass + (lead if hangs else 0.0)
        push = thrust + tether + excess + (weight_n if hangs else 0.0)
        before = w
        w = moved(w, push, linear, quadratic, all_mass)
        depth += 0.5 * STEP * (before + w)
    folder.mkdir(parents=True)
    names = "t [s],up [rpm],w [m/s],depth [m]\n"
    text = "".join(",".join(f"{x:.5f}" for x in row) + "\n" for row in rows)
    (folder / "hover.csv").write_text(names + text)
    (folder / "vehicle.toml").write_text(
        f"""name = "stranger {seed}"
water_density_kg_m3 = {RHO}
[[thruster]]
name = "up"
position_m = [0, 0, 0]
direction = [0, 0, 1]
curve = {{ kind = "quadratic", forward = {full}, reverse = {full} }}
"""
    )
    known = "".join(
        f"""[[trial.known]]
kind = "weight"
mass_kg = {lead:.6f}
density_kg_m3 = {density}
position_m = [0, 0, 0]
from_s = {a}
to_s = {b}
"""
        for a, b in hung
    )
    (folder / "campaign.toml").write_text(
        f"""vehicle = "vehicle.toml"
[channels]
"thruster.up.speed" = {{ column = "up [rpm]" }}
"velocity.heave" = {{ column = "w [m/s]" }}
depth = {{ column = "depth [m]" }}
[[plant]]
axes = ["heave"]
[[trial]]
name = "hover"
log = "hover.csv"
{known}"""
    )
    truth = {"scale": scale, "mass": mass, "quadratic": quadratic, "linear": linear}
    (folder / "truth.json").write_text(json.dumps(truth))


def identified(program, folder):
    results, error = identify(program, folder)
    if results is None:
        print(folder.name, error[-600:])
        return None
    (plant,) = results["plants"].values()
    return plant


def part(values, p):
    values = sorted(values)
    return values[min(len(values) - 1, math.ceil(p * len(values)) - 1)]


def main():
    program, out, number, seed, rest = arguments(__doc__)
    one = [tuple(map(float, rest))] if rest else []
    rows = one or [(w, n, s) for (w, n), own in BOUNDS.items() for s in own]
    for weight_n, times, tether_n in rows:
        bound = BOUNDS.get((int(weight_n), int(times)), {}).get(tether_n, math.nan)
        errors, stds, inside, masses, mass_inside = [], [], 0, [], 0
        for k in range(number):
            folder = out / f"{weight_n:g}-{times:g}-{tether_n:g}" / f"{k:03}"
            if not folder.exists():
                draw(folder, seed + k, weight_n, int(times), tether_n)
            found = identified(program, folder)
            if found is None:
                continue
            plant = found
            truth = json.loads((folder / "truth.json").read_text())
            scale, mass = plant["nuisances"]["thrust_scale"], plant["parameters"]["mass.heave"]
            errors.append(abs(scale["value"] / truth["scale"] - 1))
            stds.append(scale["std"] / scale["value"])
            inside += scale["low95"] <= truth["scale"] <= scale["high95"]
            masses.append(abs(mass["value"] / truth["mass"] - 1))
            mass_inside += mass["low95"] <= truth["mass"] <= mass["high95"]
        n = len(errors)
        if n == 0:
            continue
        rms = math.sqrt(statistics.fmean(e * e for e in errors))
        print(
            f"{weight_n:g} N x{times:g}, tether {tether_n:g} N: {n} vehicles, scale off by "
            f"{100 * part(errors, 0.5):.1f} % (50 %), {100 * part(errors, 0.9):.1f} % (90 %), rms "
            f"{100 * rms:.1f} %; stated std {100 * statistics.median(stds):.1f} %, "
            f"{statistics.median(stds) / bound:.2f} of the bound; {inside} of {n} intervals hold; "
            f"mass off by {100 * part(masses, 0.5):.1f} % (50 %), {mass_inside} of {n} hold",
            flush=True,
        )


if __name__ == "__main__":
    main()
