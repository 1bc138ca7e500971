"""Prints medians of the times that run.sh measured: `python table.py DIRECTORY SAMPLES PAIRS`."""

import pathlib
import statistics
import sys

# Relative rounding error of other operations in another order.
AGREE = 1e-9


def read(path):
    lines = (line.split() for line in path.read_text().splitlines())
    return {name: float(value) for name, value in lines}


def main():
    work, samples, pairs = pathlib.Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    runs = {
        side: [read(work / f"{side}.{pair + 1}") for pair in range(pairs)]
        for side in ("rust", "numpy", "threads")
    }

    def row(what, values):
        low, middle, high = min(values), statistics.median(values), max(values)
        print(f"{what:<52} {1e3 * middle:8.1f} {1e3 * low:8.1f} {1e3 * high:8.1f}")

    def times(side, stage):
        return [run[stage] for run in runs[side]]

    print(f"{samples} samples, {pairs} pairs; ms {'median':>31} {'min':>8} {'max':>8}")
    row("Seaplant, one thread, with covariance", times("rust", "fit_s"))
    row("  (building its records from arrays, not in that)", times("rust", "record_s"))
    row("  (uniform grids alone, for scale)", times("rust", "uniform_s"))
    row("NumPy and SciPy, one thread, without covariance", times("numpy", "fit_s"))
    row("  force averaged", times("numpy", "uniform_s"))
    row("  filters, v|v| and derivative", times("numpy", "filter_s"))
    row("  least squares", times("numpy", "solve_s"))
    row("NumPy and SciPy, default threads", times("threads", "fit_s"))
    row("both signals read from memory once", times("rust", "memory_s"))

    ratios = [
        numpy["fit_s"] / rust["fit_s"] for numpy, rust in zip(runs["numpy"], runs["rust"])
    ]
    print(
        f"NumPy/SciPy over Seaplant, pair by pair: median {statistics.median(ratios):.2f}, "
        f"{min(ratios):.2f} to {max(ratios):.2f}"
    )
    rust, numpy = runs["rust"][0], runs["numpy"][0]
    worst = max(abs(rust[name] / numpy[name] - 1.0) for name in ("alpha", "beta", "bias"))
    print(f"estimates agree to {worst:.1e} relative")
    if worst > AGREE:
        sys.exit(f"that is worse than {AGREE:.0e}")


if __name__ == "__main__":
    main()
