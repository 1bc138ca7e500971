"""Equation error of a long surge trial with NumPy and SciPy, timed: the other side of run.sh.

`python equation_error.py FILE` reads N velocities, then N forces (little-endian doubles,
10 Hz) and prints one `name value` a line.

The mathematics is that of `seaplant::estimate::EquationError::fit` without covariance.
The choices below are the fastest sound ones of those tried; each other costs more:
sosfiltfilt of one column at a time (a stacked (4, n) call takes five times as long, and
filtfilt on polynomials as long), one reused work array, and normal equations of columns scaled to unit length, whose
condition number here is below 10 (lstsq takes eight times, QR six times as long).
"""

import sys
import time

import numpy as np
from scipy import signal

SAMPLE_HZ = 10.0


def fit(v, tau, split):
    clock = time.perf_counter
    started = clock()

    # Force is held from each sample to the next: its mean around each instant.
    force = np.empty_like(tau)
    force[0] = tau[0]
    np.add(tau[1:], tau[:-1], out=force[1:])
    force[1:] *= 0.5
    split["uniform_s"] = clock() - started

    started = clock()
    light = signal.butter(2, 1.5, fs=SAMPLE_HZ, output="sos")
    alike = signal.butter(2, 0.5, fs=SAMPLE_HZ, output="sos")
    v = signal.sosfiltfilt(light, v)
    columns = np.empty((4, v.size))
    columns[0] = signal.sosfiltfilt(alike, force)
    work = np.abs(v, out=force)
    work *= v
    columns[1] = signal.sosfiltfilt(alike, work)
    work[1:-1] = v[2:]
    work[1:-1] -= v[:-2]
    work[1:-1] *= 0.5 * SAMPLE_HZ
    work[0] = (v[1] - v[0]) * SAMPLE_HZ
    work[-1] = (v[-1] - v[-2]) * SAMPLE_HZ
    columns[3] = signal.sosfiltfilt(alike, work)
    columns[2] = 1.0
    split["filter_s"] = clock() - started

    started = clock()
    gram = columns @ columns.T
    scale = 1.0 / np.sqrt(np.diag(gram)[:3])
    scaled = gram[:3, :3] * np.outer(scale, scale)
    found = scale * np.linalg.solve(scaled, scale * gram[:3, 3])
    split["solve_s"] = clock() - started
    return found


def main():
    v, tau = np.fromfile(sys.argv[1], dtype="<f8").reshape(2, -1)
    split = {}
    started = time.perf_counter()
    alpha, beta, bias = fit(v, tau, split)
    split["fit_s"] = time.perf_counter() - started
    for name, value in split.items():
        print(f"{name} {value:e}")
    print(f"alpha {alpha:.17e}\nbeta {beta:.17e}\nbias {bias:.17e}")


if __name__ == "__main__":
    main()
