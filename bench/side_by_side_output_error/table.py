"""Prints medians of the times that run.sh measured: `python table.py DIRECTORY SAMPLES ROUNDS`."""

import pathlib
import statistics
import sys

# Relative tolerance between estimates of different tools that stop at the same tolerance.
AGREE = 1e-6

SIDES = {
    "rust": "Seaplant",
    "numba": "numba, RK4 and Gauss-Newton",
    "jax": "JAX, jit of scan and jacfwd",
    "casadi": "CasADi, mapaccum",
    "scipy": "SciPy least_squares over a Python loop",
}


def read(path):
    found = {}
    for line in path.read_text().splitlines():
        name, value = line.split()
        found.setdefault(name, []).append(float(value))
    return found


def main():
    work, samples, rounds = pathlib.Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    runs = {}
    for side in SIDES:
        paths = [work / f"{side}.{k + 1}" for k in range(rounds)]
        if all(path.exists() for path in paths):
            runs[side] = [read(path) for path in paths]

    def times(side, name):
        return [1e3 * value for run in runs[side] for value in run[name]]

    print(f"{samples} samples, 5 unknowns, {rounds} rounds; ms, one thread")
    print(f"{'':<40} {'first fit':>10} {'median':>10} {'min':>10} {'max':>10}")
    for side in runs:
        fits = times(side, "fit_s")
        cold = statistics.median(times(side, "cold_s"))
        print(
            f"{SIDES[side]:<40} {cold:10.3f} {statistics.median(fits):10.3f} "
            f"{min(fits):10.3f} {max(fits):10.3f}"
        )
    whole = times("rust", "whole_s")
    print(
        f"{'Seaplant, its start by equation error too':<40} {'':>9} {statistics.median(whole):10.3f} "
        f"{min(whole):10.3f} {max(whole):10.3f}"
    )
    mine = runs["rust"][0]
    worst = 0.0
    for side in runs:
        off = max(
            abs(runs[side][0][name][0] / mine[name][0] - 1.0)
            for name in ("alpha", "beta", "bias")
        )
        # True linear drag is zero: its error is relative to the drag at 0.5 m/s.
        off = max(off, abs(runs[side][0]["mu"][0] - mine["mu"][0]) / abs(0.5 * mine["beta"][0]))
        worst = max(worst, off)
    print(f"estimates agree to {worst:.1e} relative")
    if worst > AGREE:
        sys.exit(f"that is worse than {AGREE:.0e}")


if __name__ == "__main__":
    main()
