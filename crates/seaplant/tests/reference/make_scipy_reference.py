"""Makes scipy.json: what SciPy and NumPy say of the signals that the tests filter.

Run with `python make_scipy_reference.py > scipy.json`; needs numpy and scipy.
The input is a sum of sines with a trend, computed alike in Rust, so that only
outputs are stored.
"""

import json
import sys

import numpy as np
import scipy
from scipy import signal

SAMPLES = 400
SAMPLE_HZ = 10.0
# Degrees of freedom of long logs, where the quantile is nearly that of the normal distribution.
MANY = (10_000, 10_001, 100_000, 10_000_000, 1_000_000_000)


def series(n: int) -> np.ndarray:
    t = np.arange(n) / SAMPLE_HZ
    return np.sin(0.785 * t) + 0.3 * np.sin(7.1 * t + 0.4) + 0.05 * t


def main() -> None:
    x = series(SAMPLES)
    filters = []
    for cutoff_hz, order in [
        (0.125, 2),
        (1.5, 2),
        (0.5, 2),
        (0.5, 1),
        (0.25, 3),
        (1.0, 4),
        (2.0, 5),
        (0.3, 8),
    ]:
        sos = signal.butter(order, cutoff_hz, fs=SAMPLE_HZ, output="sos")
        y = signal.sosfiltfilt(sos, x)
        filters.append({"cutoff_hz": cutoff_hz, "order": order, "y": y.tolist()})
    short = series(10)
    sos = signal.butter(2, 0.125, fs=SAMPLE_HZ, output="sos")
    t = np.cumsum(0.05 + 0.1 * np.abs(np.sin(np.arange(60))))
    json.dump(
        {
            "numpy": np.__version__,
            "scipy": scipy.__version__,
            "filters": filters,
            "shortest": signal.sosfiltfilt(sos, short).tolist(),
            "gradient": np.gradient(x[:60], 1 / SAMPLE_HZ).tolist(),
            "uneven_time_s": t.tolist(),
            "uneven_gradient": np.gradient(np.sin(t), t).tolist(),
            "t_975": {str(n): scipy.stats.t.ppf(0.975, n) for n in (1, 3, 21, 57, *MANY)},
        },
        sys.stdout,
        indent=1,
    )
    print()


if __name__ == "__main__":
    import scipy.stats

    main()
