"""Compares thruster gains and faults in results with the truth of draw.py.

    thrusters.py PROGRAM FOLDER...

Each folder holds vehicles that draw.py wrote with one fault, such as `draw.py OUT/fouled 8 0 fouled`.
A row for each folder: how far gains are off beside each other, how many masses and intervals are
right, whether the thruster that has the fault is named, and how many others are.
"""

import json
import sys
from pathlib import Path

from running import identify

AXES = ["surge", "sway", "heave", "roll", "pitch", "yaw"]
# Deviation from the other thrusters from which one counts as faulty, as in the book.
LOSS = 0.12
TRIALS = ["first", "second"]


def median(values):
    ordered = sorted(values)
    n = len(ordered)
    return 0.5 * (ordered[(n - 1) // 2] + ordered[n // 2]) if ordered else float("nan")


def truly_at_fault(truth):
    """Returns the faulty thrusters: (name, trial), without a trial if the fault is in all."""
    gain = truth["gain"]
    follows = truth.get("follows", list(range(8)))
    faults = {(f"T{k + 1}", f"T{of + 1}") for k, of in enumerate(follows) if of != k}
    for k in range(8):
        both = [min(gain[trial][k]) for trial in range(2)]
        usual = median([gain[0][j][0] for j in range(8)])
        if max(both) < usual - LOSS:
            faults.add((f"T{k + 1}", None))
        elif min(both) < usual - LOSS:
            faults.add((f"T{k + 1}", TRIALS[both.index(min(both))]))
    return faults


def named(plant):
    """Returns the thrusters that the results name."""
    found = {(fault["thruster"], fault["trial"]) for fault in plant["thruster_faults"]}
    for a, b in plant.get("thrusters_exchanged", []):
        found |= {(a, b), (b, a)}
    for caveat in plant["caveats"]:
        said = caveat["message"]
        if caveat["code"] == "likely-mistake" and "look exchanged" in said:
            _, a, _, b, *_ = said.split("`")
            found |= {(a, b), (b, a)}
        if (
            caveat["code"] == "thruster-fault"
            and " in trial `" not in said
            and "exchanged" not in said
        ):
            found.add((said.split("`")[1], None))
    return found


def gain_errors(plant, gain):
    """Returns the error of each gain, both sets relative to their medians."""
    keys = [f"T{k + 1}.excess-thrust" for k in range(8)]
    if any(key not in plant["parameters"] for key in keys):
        found = [1.0] * 8
    else:
        found = [1.0 + plant["parameters"][key]["value"] for key in keys]
    true = [gain[0][k][0] for k in range(8)]
    if [trial[0] for trial in gain[0]] != [trial[0] for trial in gain[1]]:
        return []
    return [a / median(found) - b / median(true) for a, b in zip(found, true)]


def judge(program, folder):
    truth = json.loads((folder / "truth.json").read_text())
    results, _ = identify(program, folder)
    if not (results and results["plants"]):
        return None
    (plant,) = results["plants"].values()
    masses, held = [], []
    for k, axis in enumerate(AXES):
        true, found = truth["M"][k][k], plant["parameters"][f"mass.{axis}"]
        masses.append(abs(found["value"] / true - 1.0))
        held.append(found["low95"] <= true <= found["high95"])
    wanted, said = truly_at_fault(truth), named(plant)
    return {
        "gains": [abs(x) for x in gain_errors(plant, truth["gain"])],
        "masses": masses,
        "held": held,
        "named": len(wanted & said),
        "wanted": len(wanted),
        "false": len(said - wanted),
        "trust": plant["verdict"]["trust"],
    }


def main():
    program, folders = sys.argv[1], [Path(name) for name in sys.argv[2:]]
    for folder in folders:
        vehicles = sorted(path.parent for path in folder.glob("*/truth.json"))
        rows = [(vehicle, judge(program, vehicle)) for vehicle in vehicles]
        for vehicle, row in rows:
            print(" ", vehicle, "refused" if row is None else row["trust"], flush=True)
        found = [row for _, row in rows if row is not None]
        gains = [x for row in found for x in row["gains"]]
        masses = [x for row in found for x in row["masses"]]
        held = [x for row in found for x in row["held"]]
        print(
            f"{folder.name}: {len(found)} of {len(rows)} vehicles,",
            f"gains median {100 * median(gains):.1f} % worst {100 * max(gains, default=0):.1f} %,"
            if gains
            else "gains differ by trial,",
            f"masses median {100 * median(masses):.1f} % worst {100 * max(masses, default=0):.1f} %,",
            f"intervals {sum(held)} of {len(held)},",
            f"faults named {sum(row['named'] for row in found)} of {sum(row['wanted'] for row in found)},",
            f"falsely {sum(row['false'] for row in found)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
