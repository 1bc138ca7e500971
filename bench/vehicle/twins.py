"""Measures plants of six axes on twins of the published vehicles: the figures of the book.

    twins.py PROGRAM OUT

Each vehicle is driven freely, 300 s twice to fit and once held out, with seeds 1 to 4, without
disturbances and with two sets of them. A row says how far off masses are, the inertias of roll and
pitch apart, how many of all 95 % intervals hold the truth, and what users are told. Then RexROV has each
other fault once, with seed 1.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np
from coverage import PUBLISHED, judged, made

SEEDS = range(1, 5)
DISTURBANCES = [[], ["tether"], ["current", "lag"]]
FAULTS = [
    "lag-two-way",
    "delay",
    "thrcoef",
    "spikes",
    "velocity-lag",
    "velocity-averaging",
    "thrust-exponent",
    "battery-sag",
    "inflow",
    "dvl-scale",
    "lever",
]
TILTED = ["mass.roll", "mass.pitch"]


def row(program, out, name, disturbances, seeds):
    """Prints median and largest error in percent of both kinds of mass, intervals and verdicts."""
    trusts, of_mass, of_tilt, held = Counter(), [], [], []
    for seed in seeds:
        folder = out / f"{name}-{'-'.join(disturbances) or 'none'}-{seed}"
        folder.mkdir(parents=True)
        made(program, folder, f"published:{name}", seed, disturbances)
        trust, rows = judged(program, folder)
        trusts[trust] += 1
        held += [holds for _, holds, _ in rows]
        for coefficient, _, off in rows:
            if coefficient.startswith("mass.") and "-" not in coefficient:
                (of_tilt if coefficient in TILTED else of_mass).append(100 * off)
    errors = [f"{np.median(off):.2g}, {max(off):.2g} %" for off in (of_mass, of_tilt)]
    told = ", ".join(f"{count} {trust}" for trust, count in sorted(trusts.items()))
    return f"{' | '.join(errors)} | {sum(held)} of {len(held)} | {told}"


def main():
    program, out = sys.argv[1], Path(sys.argv[2])
    print("vehicle, disturbances | masses, yaw | roll, pitch | intervals | verdicts")
    drawn = [(name, some, SEEDS) for some in DISTURBANCES for name in PUBLISHED]
    drawn += [("rexrov", [fault], [1]) for fault in FAULTS]
    for name, disturbances, seeds in drawn:
        found = row(program, out, name, disturbances, seeds)
        print(f"{name}, {' '.join(disturbances) or 'none'} | {found}", flush=True)


if __name__ == "__main__":
    main()
