"""Identifies each vehicle that draw.py wrote and compares the result with its truth.

    judge.py PROGRAM FOLDER [PATTERN]

A row for each vehicle, and at the end: how far off the numbers are, how many intervals hold the
truth, how often a wrong plant is called usable (false assurance) and a right one doubtful (false
alarm). Wrong: a mass of surge, sway or heave, or the inertia of yaw, off by more than 10 %.
"""

import collections
import json
import math
import resource
import sys
import time
from pathlib import Path

from running import identify

AXES = ["surge", "sway", "heave", "roll", "pitch", "yaw"]
SPEED = "uvwpqr"
MAIN = [0, 1, 2, 5]
WRONG = 0.10


def true_values(truth):
    """Returns the truth of every coefficient that the plant and the vehicle both have."""
    mass = truth["M"]
    values = {}
    for i in range(6):
        values[f"mass.{AXES[i]}"] = mass[i][i]
        for j in range(i + 1, 6):
            values[f"mass.{AXES[i]}-{AXES[j]}"] = mass[i][j]
        if not truth["strips"] or i in (0, 3):
            values[f"{AXES[i]}: {SPEED[i]}"] = truth["linear"][i]
            values[f"{AXES[i]}: |{SPEED[i]}|{SPEED[i]}"] = truth["quadratic"][i]
        for j in range(6):
            if i != j and truth["coupling"][i][j]:
                values[f"{AXES[i]}: {SPEED[j]}"] = truth["coupling"][i][j]
    values["weight-minus-buoyancy"] = truth["weight_minus_buoyancy"]
    values["lever.z"] = truth["lever_z"]
    return values


def judge(program, folder):
    truth = json.loads((folder / "truth.json").read_text())
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.monotonic()
    results, error = identify(program, folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    row = {
        "name": folder.name,
        "faults": truth["faults"],
        "length": truth["length_m"],
        "cpu": after.ru_utime - before.ru_utime,
        "elapsed": time.monotonic() - start,
    }
    if not (results and results["plants"]):
        refused = [failure["message"] for failure in results["failures"]] if results else error
        return row | {"trust": "refused", "reason": str(refused)[:200]}
    (plant,) = results["plants"].values()
    found = plant["parameters"]
    expected = true_values(truth)
    held = [
        p["low95"] <= expected[n] <= p["high95"]
        for n, p in found.items()
        if n in expected and p.get("low95") is not None
    ]
    mass = [found[f"mass.{a}"]["value"] / truth["M"][i][i] - 1 for i, a in enumerate(AXES)]
    drag = []
    for i, axis in enumerate(AXES):
        v = truth["rms_speed"][i]
        own = [
            found.get(f"{axis}: {t}", {"value": 0.0})["value"]
            for t in (SPEED[i], f"|{SPEED[i]}|{SPEED[i]}")
        ]
        # Strips have no drag of one axis by itself.
        is_told = not truth["strips"] or i in (0, 3)
        off = (own[0] + own[1] * v) * v / truth["drag_at_rms"][i] - 1
        drag.append(off if is_told else None)
    row |= {
        "trust": plant["verdict"]["trust"],
        "reason": plant["verdict"]["reason"],
        "codes": plant["verdict"]["codes"],
        "mass": mass,
        "drag": drag,
        "held": sum(held),
        "intervals": len(held),
    }
    return row


def worst(row, key, axes=MAIN):
    return max((row[key][i] for i in axes if row[key][i] is not None), key=abs)


def quantile(values, part):
    values = sorted(values)
    return values[min(len(values) - 1, math.ceil(part * len(values)) - 1)]


def main():
    program, folder = sys.argv[1], Path(sys.argv[2])
    pattern = sys.argv[3] if len(sys.argv) > 3 else "*"
    rows = []
    for one in sorted(p.parent for p in folder.glob(f"{pattern}/truth.json")):
        row = judge(program, one)
        rows.append(row)
        head = f"{row['name']} {row['trust']:17} {row['cpu']:5.1f} s  {'+'.join(row['faults'])}"
        if "mass" in row:
            parts = " ".join(f"{100 * m:+.1f}" for m in row["mass"])
            drags = " ".join("." if m is None else f"{100 * m:+.0f}" for m in row["drag"])
            head += f"\n      M {parts} %   D {drags} %   {row['held']}/{row['intervals']}"
        print(f"{head}\n      {row['reason'][:150]}", flush=True)
        if row.get("codes"):
            print(f"      {' '.join(sorted(set(row['codes'])))}", flush=True)
    fitted = [r for r in rows if "mass" in r]
    for key, name in (("mass", "worst main mass"), ("drag", "worst main drag")):
        errors = [100 * abs(worst(r, key)) for r in fitted]
        print(
            f"{name}: "
            + ", ".join(
                f"{quantile(errors, q):.2g} % at {100 * q:.0f} %" for q in (0.5, 0.75, 0.9, 1.0)
            )
        )
    print(
        f"intervals: {sum(r['held'] for r in fitted)} of {sum(r['intervals'] for r in fitted)}"
    )
    count = collections.Counter()
    for row in fitted:
        is_wrong = abs(worst(row, "mass")) > WRONG
        count["wrong" if is_wrong else "right", row["trust"]] += 1
    for key, number in sorted(count.items()):
        print(f"  {key[0]:5} {key[1]:17} {number}")
    print(
        f"refused: {len(rows) - len(fitted)}   processor time, median: "
        f"{quantile([r['cpu'] for r in rows], 0.5):.1f} s, most {max(r['cpu'] for r in rows):.1f} s"
    )
    (folder / "judged.json").write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
