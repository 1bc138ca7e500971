"""Faults of drawn vehicles; runs the program on their campaigns, and judges its plants."""

import collections
import json
import multiprocessing
import resource
import statistics
import subprocess
import sys
from pathlib import Path

# A mass is wrong if it is off by more than this part and outside its interval.
WRONG = 0.10


def identify(program, folder):
    """Returns the results of ``folder/campaign.toml`` and an empty text, or None and the error."""
    out = folder / "results"
    run = subprocess.run(
        [program, "identify", folder / "campaign.toml", "--out", out, "--force", "--quiet"],
        capture_output=True,
        text=True,
    )
    if run.returncode:
        return None, run.stderr
    return json.loads((out / "results.json").read_text()), ""


def faults():
    """Returns a table of faults, and the decorator that enters a function under its name."""
    table = {}

    def fault(f):
        table[f.__name__] = f
        return f

    return table, fault


def chosen_faults(wanted, known, drawn):
    """Returns the names of a vehicle's faults: those wanted, or those drawn; a healthy one has none."""
    named = [name for name in wanted if name in known]
    return [] if "healthy" in wanted else named or [str(name) for name in drawn]


def arguments(document):
    """Returns program, folder, number, seed and what follows of the command line."""
    if len(sys.argv) < 5:
        sys.exit(document)
    program, out, number, seed, *wanted = sys.argv[1:]
    return program, Path(out), int(number), int(seed), wanted


def judged(program, folder, described, true_values):
    """Identifies the plant of a drawn vehicle, and compares it with the truth."""
    truth = json.loads((folder / "truth.json").read_text())
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    results, error = identify(program, folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    row = {
        "name": folder.name,
        "faults": truth["faults"],
        "cpu": after.ru_utime - before.ru_utime,
        "what": described(truth),
    }
    if not (results and results["plants"]):
        refused = [failure["message"] for failure in results["failures"]] if results else error
        return row | {"trust": "refused", "reason": str(refused)}
    plant = next(iter(results["plants"].values()))
    found, expected = plant["parameters"], true_values(truth)

    def holds(name):
        p = found[name]
        return p["low95"] <= expected[name] <= p["high95"]

    known = [n for n in found if n in expected and found[n].get("low95") is not None]
    masses = [n for n in known if n.startswith("mass.") and "-" not in n]
    off = {n: found[n]["value"] / expected[n] - 1 for n in masses}
    width = {n: (found[n]["high95"] - found[n]["low95"]) / 2 / expected[n] for n in masses}
    return row | {
        "method": plant.get("method"),
        "trust": plant["verdict"]["trust"],
        "reason": plant["verdict"]["reason"],
        "codes": sorted(set(plant["verdict"]["codes"])),
        "off": off,
        "widths": width,
        "wrong": [n for n in masses if abs(off[n]) > WRONG and not holds(n)],
        "held": sum(holds(n) for n in known),
        "intervals": len(known),
        "masses_held": sum(holds(n) for n in masses),
    }


def judge_drawn(drawn, described, true_values, names):
    """Draws vehicles that are absent, judges all, and prints each and their counts.

    ``drawn((folder, seed, wanted))`` writes one vehicle with its ``truth.json``, of which the others are functions: a
    description, and the true values by name of parameter.
    """
    program, out, number, seed, wanted = arguments(sys.modules["__main__"].__doc__)
    if unknown := [name for name in wanted if name not in names]:
        sys.exit(
            f"no fault is called {', '.join(unknown)}; there are {', '.join(sorted(names))}"
        )
    jobs = [(out / str(k), k, wanted) for k in range(seed, seed + number)]
    with multiprocessing.Pool() as pool:
        pool.map(drawn, [job for job in jobs if not (job[0] / "truth.json").exists()], 1)
    rows = []
    for folder, _, _ in jobs:
        row = judged(program, folder, described, true_values)
        rows.append(row)
        faults = "+".join(row["faults"])
        print(f"{row['name']} {row['trust']:17} {row['cpu']:5.1f} s  {row['what']}, {faults}")
        if "off" in row:
            masses = " ".join(
                f"{100 * off:+.1f}±{100 * row['widths'][n]:.1f}"
                for n, off in row["off"].items()
            )
            wrong = f"wrong: {', '.join(row['wrong'])}" if row["wrong"] else ""
            print(
                f"      M {masses} %   {row['held']}/{row['intervals']}   {wrong} {row['method']}"
            )
            print(f"      {' '.join(row['codes'])}")
        print(f"      {row['reason'][:300]}", flush=True)
    fitted = [r for r in rows if "off" in r]
    print(
        f"intervals: {sum(r['held'] for r in fitted)} of {sum(r['intervals'] for r in fitted)}, "
        f"of masses {sum(r['masses_held'] for r in fitted)} of {sum(len(r['off']) for r in fitted)}"
    )
    count = collections.Counter(
        ("wrong" if r["wrong"] else "right", r["trust"]) for r in fitted
    )
    for (what, trust), times in sorted(count.items()):
        print(f"  {what:5} {trust:17} {times}")
    cpu = [r["cpu"] for r in rows]
    print(
        f"refused: {len(rows) - len(fitted)}   processor time: "
        f"{statistics.median(cpu):.1f} s in the median, {max(cpu):.1f} s at most"
    )
