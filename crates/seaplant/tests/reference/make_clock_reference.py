"""Makes clock.json: the cross-correlation of two series with gaps, by SciPy's own sums.

Run with `python make_clock_reference.py > clock.json`; needs numpy and scipy.
The input is computed alike in Rust, so that only outputs are stored. Of each lag at which both
series share LEAST instants: the lag (instant k of y goes with k + lag of x), the normalised
correlation over the instants that both have, and how many these are.
"""

import json
import sys

import numpy as np
import scipy
from scipy import signal, stats

LEAST = 40


def y_series() -> np.ndarray:
    k = np.arange(150)
    y = 3.0 + np.sin(0.002 * (k + 60) ** 2) + 0.2 * np.cos(1.3 * k)
    y[40:55] = np.nan
    return y


def x_series() -> np.ndarray:
    k = np.arange(260)
    x = -700.0 + 50.0 * np.sin(0.002 * k**2) + 9.0 * np.cos(0.4 * k)
    x[100:108] = np.nan
    return x


def main() -> None:
    y, x = y_series(), x_series()
    lags = signal.correlation_lags(len(x), len(y))
    both = signal.correlate(
        (~np.isnan(x)).astype(float), (~np.isnan(y)).astype(float), method="direct"
    )
    rows = []
    for lag, instants in zip(lags, both):
        if round(instants) < LEAST:
            continue
        k = np.arange(max(0, -lag), min(len(y), len(x) - lag))
        pairs = ~np.isnan(y[k]) & ~np.isnan(x[k + lag])
        r = stats.pearsonr(y[k][pairs], x[k + lag][pairs]).statistic
        rows.append([int(lag), float(r), round(instants)])
    json.dump({"scipy": scipy.__version__, "numpy": np.__version__, "lags": rows}, sys.stdout)
    print()


if __name__ == "__main__":
    main()
