"""Identifies each vehicle that one_axis.py wrote and compares the result with its truth.

    judge_one_axis.py PROGRAM FOLDER

A row for each vehicle whose plant is wrong or doubtful, and at the end: errors, intervals, and how
often a wrong plant is called usable (false assurance) and a right one doubtful (false alarm).
Wrong: mass off by more than 10 %, or drag at the root mean square speed by more than 20 %.
"""

import collections
import json
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "gate"))

from reading import drag_keys, read_result
from running import identify

WRONG_MASS, WRONG_DRAG = 0.10, 0.20


def identified(program, folder):
    results, error = identify(program, folder)
    if results is None:
        return None, error
    results = read_result(folder / "results/results.json")
    plants = [plant for plant in results["plants"] if plant["is_recommended"]]
    return (plants[0] if plants else None), "; ".join(results["failures"])


def judge(program, folder):
    truth = json.loads((folder / "truth.json").read_text())
    row = {"name": folder.name, "faults": truth["faults"], "axis": truth["dof"]}
    plant, failure = identified(program, folder)
    if plant is None:
        return row | {"trust": "refused", "reason": failure}
    found, axis = plant["parameters"], truth["dof"]
    linear, quadratic = drag_keys(axis)
    speed = truth["rms_speed"]

    def value(key):
        return found.get(key, {"value": 0.0})["value"]

    drag = (value(linear) + value(quadratic) * speed) * speed
    mass = found[f"mass.{axis}"]
    interval = found.get(quadratic)
    return row | {
        "trust": plant["trust"],
        "reason": plant["reason"],
        "mass": mass["value"] / truth["mass"] - 1,
        "drag": drag / truth["drag_at_rms"] - 1,
        "holds_mass": mass["low95"] <= truth["mass"] <= mass["high95"],
        "holds_drag": interval is not None
        and interval["low95"] <= truth["quadratic_drag"] <= interval["high95"],
    }


def quantile(values, part):
    values = sorted(values)
    return values[max(0, math.ceil(part * len(values)) - 1)]


def main():
    program, folder = sys.argv[1], Path(sys.argv[2])
    rows = [judge(program, one.parent) for one in sorted(folder.glob("*/truth.json"))]
    fitted = [row for row in rows if "mass" in row]
    if not fitted:
        sys.exit(f"no vehicle in {folder} has a plant")
    count = collections.Counter()
    for row in rows:
        kind = "none"
        if "mass" in row:
            is_wrong = abs(row["mass"]) > WRONG_MASS or abs(row["drag"]) > WRONG_DRAG
            kind = "wrong" if is_wrong else "right"
            errors = f"mass {100 * row['mass']:+.1f} %, drag {100 * row['drag']:+.1f} %"
        else:
            errors = "no plant"
        count[kind, row["trust"]] += 1
        if kind != "right" or row["trust"] in ("doubtful", "do-not-use"):
            faults = "+".join(row["faults"])
            print(f"{row['name']} {row['axis']} {faults}: {row['trust']}, {errors}")
            print(f"      {row['reason'][:200]}")
    for key in ("mass", "drag"):
        errors = [100 * abs(row[key]) for row in fitted]
        parts = (f"{quantile(errors, q):.2g} % at {100 * q:.0f} %" for q in (0.5, 0.9, 0.95))
        print(f"{key}: {', '.join(parts)}")
    for key in ("holds_mass", "holds_drag"):
        print(f"intervals, {key[6:]}: {sum(row[key] for row in fitted)} of {len(fitted)}")
    for (kind, trust), number in sorted(count.items()):
        print(f"  {kind:5} {trust:17} {number}")


if __name__ == "__main__":
    main()
