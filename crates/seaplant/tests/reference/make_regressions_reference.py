"""Makes regressions.json: weighted least squares and a block bootstrap, by NumPy.

Run with `python make_regressions_reference.py > regressions.json`; needs numpy and scipy.
Everything is written out from the definitions, without Seaplant's shortcuts: rows are
filtered by sosfiltfilt, weights and autoregression are fitted by normal equations on the rows
themselves, and each bootstrap record is put together row by row and fitted anew. Thrust is
computed alike in Rust, so that only velocity and results are stored.
"""

import json
import sys

import numpy as np
import scipy
from scipy.signal import butter, sosfiltfilt

SAMPLES = 3000
PERIOD_S = 0.1
# alpha, beta, mu, bias.
PLANT = (8e-5, -0.2, -0.05, 0.015)
VELOCITY_HZ, TERM_HZ, ORDER = 1.5, 0.5, 2
SPACING, HIGHEST = 10, 8


def thrust(k):
    return 1500.0 * np.sin(0.0785 * k) + 500.0 * np.sin(0.0211 * k + 1.0)


def velocity():
    alpha, beta, mu, bias = PLANT
    v, series = 0.1, []
    for k in range(SAMPLES):
        series.append(v)
        for _ in range(20):
            v += 0.05 * PERIOD_S * (alpha * thrust(k) + (beta * abs(v) + mu) * v + bias)
    noise = 0.03 * np.random.default_rng(1).standard_normal(SAMPLES)
    return np.array(series) + noise


def smooth(x, cutoff_hz):
    return sosfiltfilt(butter(ORDER, cutoff_hz, fs=1.0 / PERIOD_S, output="sos"), x)


def columns(v):
    """tau, v|v|, v, 1 and the derivative of v, all filtered alike."""
    k = np.arange(SAMPLES)
    # Held thrust, averaged over the interval around each sample; the first has no past.
    tau = 0.5 * (thrust(k) + thrust(np.maximum(k - 1, 0)))
    v = smooth(v, VELOCITY_HZ)
    terms = [smooth(x, TERM_HZ) for x in (tau, v * np.abs(v), v, np.gradient(v, PERIOD_S))]
    return np.column_stack([*terms[:3], np.ones(SAMPLES)]), terms[3]


def least_squares(f, y):
    return np.linalg.lstsq(f, y, rcond=None)[0]


def weighted(f, y, used):
    """Variance a + c v^2, then an autoregression over rows SPACING apart; repeated."""
    f, v = f[:, used], f[:, 2]
    theta, order = least_squares(f, y), None
    for _ in range(300):
        e = y - f @ theta
        slope, level = np.polyfit(v**2, e**2, 1)
        if slope < 0:
            slope, level = 0.0, np.mean(e**2)
        w = 1 / np.sqrt(max(level, 0.05 * np.mean(e**2)) + slope * v**2)
        u = w * e
        r = np.array(
            [u[lag * SPACING :] @ u[: len(u) - lag * SPACING] for lag in range(HIGHEST + 1)]
        )
        independent = len(u) / SPACING
        orders = range(HIGHEST + 1) if order is None else [order]
        best = None
        for p in orders:
            phi = np.linalg.solve(
                np.array([[r[abs(i - j)] for j in range(p)] for i in range(p)]).reshape(p, p),
                r[1 : p + 1],
            )
            bic = independent * np.log(r[0] - phi @ r[1 : p + 1]) + p * np.log(independent)
            if best is None or bic < best[0]:
                best = (bic, phi)
        phi = best[1]
        order = len(phi)
        lost = order * SPACING

        def whiten(x):
            x = (w * x.T).T
            kept = x[lost:].copy()
            for i, part in enumerate(phi):
                from_row = lost - (i + 1) * SPACING
                kept -= part * x[from_row : from_row + len(kept)]
            return kept

        now = least_squares(whiten(f), whiten(y))
        if np.max(np.abs(now / theta - 1)) < 1e-12:
            break
        theta = now
    return theta, order


def bootstrap(f, y, used, resamples=20000, block=200, seed=3):
    """Circular blocks that begin at each quarter of a block."""
    f = f[:, used]
    rng = np.random.default_rng(seed)
    starts = rng.integers(0, SAMPLES // (block // 4), (resamples, SAMPLES // block)) * (
        block // 4
    )
    draws = []
    for start in starts:
        rows = ((start[:, None] + np.arange(block)) % SAMPLES).ravel()
        draws.append(np.linalg.solve(f[rows].T @ f[rows], f[rows].T @ y[rows]))
    blocks = SAMPLES / block
    return np.std(draws, axis=0, ddof=1) * np.sqrt(blocks / (blocks - len(used)))


def main() -> None:
    v = velocity()
    f, y = columns(v)
    some, every = [0, 1, 3], [0, 1, 2, 3]
    wls, wls_all = weighted(f, y, some), weighted(f, y, every)
    json.dump(
        {
            "numpy": np.__version__,
            "scipy": scipy.__version__,
            "velocity": v.tolist(),
            "least_squares": least_squares(f[:, some], y).tolist(),
            "weighted": wls[0].tolist(),
            "weighted_order": wls[1],
            "weighted_with_linear": wls_all[0].tolist(),
            "bootstrap_std": bootstrap(f, y, some).tolist(),
        },
        sys.stdout,
        indent=1,
    )
    print()


if __name__ == "__main__":
    main()
