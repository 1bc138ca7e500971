"""How often the 95 % intervals of six axes hold the truth, over vehicles drawn at random.

    coverage.py PROGRAM OUT NUMBER SEED [DISTURBANCE ...]

Each vehicle is a published one (RexROV and BlueROV2 Heavy in turn) with its added mass, damping,
centre of buoyancy and weight changed at random; its twin is driven freely, 300 s twice to fit and
once held out, and identified as its campaign says. `tether` and `current` disturb it if nothing
else is named.
"""

import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import tomllib

PLANTS = Path(__file__).parents[2] / "crates/seaplant-campaign/plants"
PUBLISHED = ["rexrov", "bluerov2-heavy-von-benzon-2022"]
# Standard deviations of the logarithms of what is drawn.
ADDED_MASS, DAMPING, CENTRE = 0.15, 0.3, 0.2
# Of the weight: it is trimmed to so much of what it displaces.
TRIM = 0.01


def drawn(name, g):
    """A published plant changed: added mass stays positive, as S A Sᵀ does."""
    table = tomllib.loads((PLANTS / f"{name}.toml").read_text())
    scale = np.exp(ADDED_MASS * g.standard_normal(6))
    added = np.array(table["added_mass"])
    added = np.diag(added) if added.ndim == 1 else added
    table["added_mass"] = (np.outer(scale, scale) * (added + added.T) / 2).tolist()
    for key in ("linear_damping", "quadratic_damping"):
        diagonal = np.array(table[key])
        table[key] = (diagonal * np.exp(DAMPING * g.standard_normal(diagonal.shape))).tolist()
    mass = table["rigid_body"]["mass_kg"]
    buoyancy = table["buoyancy"]
    buoyancy["displaced_kg"] = mass * (1 + TRIM * g.standard_normal())
    buoyancy["centre_m"][2] *= np.exp(CENTRE * g.standard_normal())
    return table


def kind(name):
    """Masses, couplings of masses, damping, or what weight does."""
    if name.startswith("mass."):
        return "couplings of mass" if "-" in name else "masses"
    return "damping" if ":" in name else "weight and lever"


def made(program, folder, vehicle, seed, disturbances):
    """Writes the specification of a twin to a folder, and its logs beside it."""
    listed = ", ".join(f'"{one}"' for one in disturbances)
    (folder / "spec.toml").write_text(
        f'vehicle = "{vehicle}"\nseed = {seed}\ndisturbances = [{listed}]\n'
    )
    subprocess.run(
        [program, "twin", folder / "spec.toml", "--out", folder / "twin", "--quiet"], check=True
    )


def judged(program, folder):
    """Of each coefficient that has an interval: kind, whether it holds the truth, relative error."""
    truth = json.loads((folder / "twin/truth.json").read_text())["vehicle"]["coefficients"]
    subprocess.run(
        [
            program,
            "identify",
            folder / "twin/campaign.toml",
            "--out",
            folder / "out",
            "--quiet",
        ],
        check=True,
    )
    (plant,) = json.loads((folder / "out/results.json").read_text())["plants"].values()
    rows = []
    for name, found in plant["parameters"].items():
        if found.get("low95") is None or (name not in truth and not name.startswith("mass.")):
            continue
        # A coupling of masses that the table does not have is zero.
        true = truth.get(name, 0.0)
        holds = found["low95"] <= true <= found["high95"]
        off = abs(found["value"] / true - 1) if true else None
        rows.append((name, holds, off))
    return plant["verdict"]["trust"], rows


def main():
    program, out = sys.argv[1], Path(sys.argv[2])
    number, first = int(sys.argv[3]), int(sys.argv[4])
    disturbances = sys.argv[5:] or ["tether", "current"]
    counts, errors = defaultdict(list), []
    for seed in range(first, first + number):
        folder = out / f"{seed:04}"
        name = PUBLISHED[seed % len(PUBLISHED)]
        table = drawn(name, np.random.default_rng(seed))
        folder.mkdir(parents=True)
        (folder / "plant.json").write_text(json.dumps(table))
        made(program, folder, "plant.json", seed, disturbances)
        trust, rows = judged(program, folder)
        for of, holds, off in rows:
            counts[kind(of)].append(holds)
            if kind(of) == "masses":
                errors.append(off)
        missed = [of for of, holds, _ in rows if not holds]
        held = len(rows) - len(missed)
        print(f"{seed} {name} {trust} {held}/{len(rows)} {' '.join(missed)}", flush=True)
    everything = [holds for of_kind in counts.values() for holds in of_kind]
    for of, holds in [*counts.items(), ("all", everything)]:
        print(f"{of}: {sum(holds)} of {len(holds)}, {100 * np.mean(holds):.1f} %")
    middle, worst = 100 * np.median(errors), 100 * max(errors)
    print(f"masses off by {middle:.2g} % (median), {worst:.2g} % at most")


if __name__ == "__main__":
    main()
