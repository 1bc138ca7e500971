"""Compares gains, lags, dead bands and faults of thrusters in results with the truth of draw.py.

    thrusters.py PROGRAM FOLDER...

Each folder holds vehicles that draw.py wrote with one fault, such as `draw.py OUT/fouled 8 0 fouled`.
A row for each folder: errors of gains relative to each other, of lags, and of dead bands as parts of
the true one; how many masses and intervals are right, whether the thruster that has the fault is
named, and how many others are.
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


def own_errors(plant, truth):
    """Returns the errors of lags, s, and of dead bands beyond 1 % of full speed, as parts of them."""

    def found(common, own):
        parameters, nuisances = plant["parameters"], plant["nuisances"]
        value = nuisances[common]["value"] if common in nuisances else 0.0
        names = [f"T{k + 1}.{own}" for k in range(8)]
        return [
            value + (parameters[name]["value"] if name in parameters else 0.0) for name in names
        ]

    lags = truth["lag_up"] if isinstance(truth["lag_up"], list) else [truth["lag_up"]] * 8
    late = [abs(a - b) for a, b in zip(found("lag", "excess-lag"), lags)]
    full = plant["nuisances"].get("full_speed", {"value": 0.0})["value"]
    bands = [band * truth["max_rate"] for band in truth["dead_band"]]
    found_bands = found("dead_band", "excess-dead-band")
    return late, [
        abs(a * full / b - 1.0)
        for a, b in zip(found_bands, bands)
        if b > 0.01 * truth["max_rate"]
    ]


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
    late, bands = own_errors(plant, truth)
    return {
        "gains": [abs(x) for x in gain_errors(plant, truth["gain"])],
        "late": late,
        "bands": bands,
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
        bands = [x for row in found for x in row["bands"]]
        masses = [x for row in found for x in row["masses"]]
        held = [x for row in found for x in row["held"]]
        print(
            f"{folder.name}: {len(found)} of {len(rows)} vehicles,",
            f"gains median {100 * median(gains):.1f} % worst {100 * max(gains, default=0):.1f} %,"
            if gains
            else "gains differ by trial,",
            f"lags worst {max((x for row in found for x in row['late']), default=0):.3f} s,",
            f"dead bands median {100 * median(bands):.1f} % worst {100 * max(bands):.1f} %,"
            if bands
            else "",
            f"masses median {100 * median(masses):.1f} % worst {100 * max(masses, default=0):.1f} %,",
            f"intervals {sum(held)} of {len(held)},",
            f"faults named {sum(row['named'] for row in found)} of {sum(row['wanted'] for row in found)},",
            f"falsely {sum(row['false'] for row in found)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
