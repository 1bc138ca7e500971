"""Compares what plans promise with what fits of their rehearsals obtain, over drawn vehicles.

Each vehicle has four axes (surge, sway, heave, yaw), two (surge, yaw) or six, masses and drag by a
generator of its own, and thrusters to match. `seaplant plan` sees a plant file of it and rehearses the
plan with a vehicle whose plant differs from that file; `seaplant identify` fits the logs.

    promises.py SEAPLANT WORK NUMBER [SEED]     # prints the table, keeps WORK/NNN/*.json
"""

import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

AXES = {
    2: ["surge", "yaw"],
    4: ["surge", "sway", "heave", "yaw"],
    6: ["surge", "sway", "heave", "roll", "pitch", "yaw"],
}
HALF_95 = 1.959964


def vehicle(g, count):
    """A plant file: a box of a vehicle, with vectored and vertical thrusters."""
    size = g.uniform(0.4, 1.5) * np.array([1.0, g.uniform(0.5, 0.9), g.uniform(0.4, 0.8)])
    mass = 1025.0 * np.prod(size) * g.uniform(0.3, 0.6)
    l, w, h = size
    inertia = mass / 12 * np.array([w * w + h * h, l * l + h * h, l * l + w * w])
    all_mass = np.concatenate([mass * g.uniform(1.3, 2.2, 3), inertia * g.uniform(1.3, 2.0, 3)])
    faces = np.array([w * h, l * h, l * w])
    strips = np.array([l * w**4, w * l**4, h * l**4]) / 32
    quadratic = 512.5 * np.concatenate([faces, strips]) * g.uniform(0.6, 1.4, 6)
    linear = quadratic * g.uniform(0.05, 0.2, 6)
    righting = 9.81 * mass * 0.05 * h
    full = 0.5 * 512.5 * faces[0] * 1.2**2 * g.uniform(0.8, 1.5)
    curve = {
        "kind": "quadratic",
        "input": "command",
        "forward": float(full),
        "reverse": float(full * g.uniform(0.75, 1.0)),
    }
    thrusters = []

    def add(name, position, direction):
        thrusters.append(
            {
                "name": name,
                "position_m": [float(x) for x in position],
                "direction": [float(x) for x in direction],
                "curve": curve,
            }
        )

    x, y = 0.35 * l, 0.4 * w
    if count == 2:
        add("port", [0, -y, 0], [1, 0, 0])
        add("starboard", [0, y, 0], [1, 0, 0])
    else:
        add("fore port", [x, -y, 0], [1, 1, 0])
        add("fore starboard", [x, y, 0], [1, -1, 0])
        add("aft port", [-x, -y, 0], [1, -1, 0])
        add("aft starboard", [-x, y, 0], [1, 1, 0])
        for fore in [1, -1]:
            for side in [1, -1]:
                add(f"vertical {fore} {side}", [fore * x, side * y, 0], [0, 0, -1])
    axes = AXES[count]
    places = [AXES[6].index(axis) for axis in axes]
    table = {
        "schema": "seaplant/plant/1",
        "name": "drawn",
        "source": "drawn",
        "axes": axes,
        "mass_matrix": [float(all_mass[k]) for k in places],
        "linear_damping": [float(linear[k]) for k in places],
        "quadratic_damping": [float(quadratic[k]) for k in places],
        "thruster": thrusters,
    }
    if count == 6:
        table["righting_lever_nm"] = [0.0, 0.0, float(righting)]
    return table


def one(seaplant, folder, k, seed):
    g = np.random.default_rng([seed, k])
    count = [2, 4, 6, 4][k % 4]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "plant.json").write_text(json.dumps(vehicle(g, count)))

    def run(*words):
        began = time.monotonic()
        done = subprocess.run([seaplant, *map(str, words), "--force"], capture_output=True, text=True)
        return done, time.monotonic() - began

    words = ["plan", folder / "plant.json", "--out", folder / "plan", "--rehearse", folder / "dive"]
    done, seconds = run(*words, "--seed", seed + k, "--compare", "--checks", 1000)
    if done.returncode:
        print(k, count, "no plan:", done.stderr.strip())
        return None
    plan = json.loads((folder / "plan/plan.json").read_text())
    done, fit_seconds = run("identify", folder / "dive/campaign.toml", "--out", folder / "results", "--quiet")
    if done.returncode:
        print(k, count, "no fit:", done.stderr.strip())
        return None
    results = json.loads((folder / "results/results.json").read_text())
    truth = json.loads((folder / "dive/truth.json").read_text())["vehicle"]["coefficients"]
    (plant,) = results["coupled"].values()
    rows = []
    for forecast in plan["coefficients"]:
        name = forecast["name"]
        found = plant["parameters"].get(name)
        if found is None or truth[name] == 0:
            continue
        promised = forecast["after"] / HALF_95 / abs(forecast["value"])
        stated = found["std"] / abs(truth[name])
        rows.append((name, stated / promised, (found["value"] - truth[name]) / found["std"]))
    unplanned = {kind: minutes and minutes / plan["minutes_needed"] for kind, minutes in plan["unplanned"].items()}
    ratios = [ratio for _, ratio, _ in rows]
    print(
        f"{k:3} {count} axes  {plan['minutes']:5.1f} min  gap {100 * plan['certificate']['gap']:.2f} %"
        f"  broken {plan['check']['broken']}/{plan['check']['runs']}  {seconds:5.1f} s, fit {fit_seconds:5.1f} s"
        f"  stated/promised {min(ratios):.2f} {statistics.median(ratios):.2f} {max(ratios):.2f}"
        f"  without a plan {unplanned}",
        flush=True,
    )
    return count, rows, plan, unplanned, seconds


def main():
    seaplant, work, number, *rest = sys.argv[1:]
    seed = int(rest[0]) if rest else 1
    found = [one(seaplant, Path(work) / f"{k:03}", k, seed) for k in range(int(number))]
    found = [one for one in found if one]
    rows = [row for _, rows, *_ in found for row in rows]
    near = [abs(ratio - 1) <= 0.2 for _, ratio, _ in rows]
    main_rows = [row for row in rows if row[0].count(".") == 1 and "-" not in row[0]]
    print(f"\n{len(found)} vehicles, {len(rows)} coefficients")
    print(f"stated within 20 % of promised: {100 * statistics.mean(near):.0f} %")
    print(f"median stated/promised: {statistics.median(r for _, r, _ in rows):.2f}")
    print(f"truth within 1.96 stated deviations: {100 * statistics.mean(abs(z) < 1.96 for *_, z in rows):.0f} %")
    if main_rows:
        own = [abs(ratio - 1) <= 0.2 for _, ratio, _ in main_rows]
        print(f"of masses and levers, within 20 %: {100 * statistics.mean(own):.0f} %")
    for kind in ["sinusoid-and-joystick", "sweep"]:
        factors = [u[kind] for *_, u, _ in found if u.get(kind)]
        never = sum(1 for *_, u, _ in found if kind in u and u[kind] is None)
        if factors:
            print(f"{kind}: {statistics.median(factors):.1f} times the minutes (median), never for {never}")
    print(f"certified gap at most {100 * max(p['certificate']['gap'] for _, _, p, _, _ in found):.2f} %")
    runs = sum(p["check"]["runs"] for _, _, p, _, _ in found)
    print(f"limits broken in {sum(p['check']['broken'] for _, _, p, _, _ in found)} of {runs} runs")


main()
