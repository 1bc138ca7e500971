"""Makes output_error.json: what SciPy makes of a small output error problem.

Run with `python make_output_error_reference.py > output_error.json`; needs numpy and scipy.
Velocity is simulated by DOP853 from one change of force to the next, a tone stands for
noise, and least_squares fits [alpha, beta, mu, bias, v0] with the sensitivities
integrated alongside. Thrust and the tone are computed alike in Rust, so that only
results are stored. A position that drifts besides is fitted under the dense covariance
of white noise and a random walk, which maximum likelihood tells apart.
"""

import json
import sys

import numpy as np
import scipy
from scipy.integrate import solve_ivp
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares, minimize_scalar

SAMPLES = 300
PERIOD_S = 0.1
# alpha, beta, mu, bias, v0.
TRUTH = np.array([8e-5, -0.2, -0.02, 0.015, 0.2])
SCALE = np.array([1e-5, 1e-1, 1e-1, 1e-2, 1e-1])


def thrust(k: np.ndarray) -> np.ndarray:
    return 1500.0 * np.sin(0.0785 * k) + 400.0 * np.sin(0.0211 * k + 1.0)


def tone(k: np.ndarray) -> np.ndarray:
    return 0.003 * np.sin(2.3 * k) + 0.002 * np.cos(0.61 * k * k)


def motion(theta: np.ndarray) -> np.ndarray:
    """Velocity, its five derivatives, position and its five, at each sample."""
    alpha, beta, mu, bias, v0 = theta

    def slope(force):
        def at(_, y):
            v, s = y[0], y[1:6]
            direct = np.array([force, v * abs(v), v, 1.0, 0.0])
            v_dot = alpha * force + (beta * abs(v) + mu) * v + bias
            return np.concatenate([[v_dot], (2 * beta * abs(v) + mu) * s + direct, [v], s])

        return at

    y = np.zeros(12)
    y[0], y[5] = v0, 1.0
    states = [y]
    for k in range(SAMPLES - 1):
        span = (0.0, PERIOD_S)
        # Force is held over the interval.
        run = solve_ivp(
            slope(thrust(np.array(k))), span, y, method="DOP853", rtol=1e-12, atol=1e-14
        )
        y = run.y[:, -1]
        states.append(y)
    return np.array(states)


def fit(
    values: np.ndarray,
    is_position: bool,
    factor: np.ndarray | None = None,
    start: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """The unknowns, scaled, and their residuals; factor is Cholesky's of the covariance."""
    known = {}

    def states(scaled):
        key = scaled.tobytes()
        if key not in known:
            known.clear()
            known[key] = motion(scaled[:5] * SCALE)
        return known[key]

    def whitened(x):
        return x if factor is None else solve_triangular(factor, x, lower=True)

    def raw_residual(scaled):
        moved = states(scaled)
        return (moved[:, 6] + scaled[5] if is_position else moved[:, 0]) - values

    def residual(scaled):
        return whitened(raw_residual(scaled))

    def jacobian(scaled):
        moved = states(scaled)
        if is_position:
            return whitened(np.column_stack([moved[:, 7:12] * SCALE, np.ones(SAMPLES)]))
        return whitened(moved[:, 1:6] * SCALE)

    if start is None:
        start = 0.8 * TRUTH / SCALE
        if is_position:
            start = np.append(start, values[0])
    found = least_squares(
        residual, start, jacobian, method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    return found.x, raw_residual(found.x)


def plant(found: tuple[np.ndarray, np.ndarray]) -> list[float]:
    return (found[0][:4] * SCALE[:4]).tolist()


def covariance(walk: float) -> np.ndarray:
    time_s = PERIOD_S * np.arange(SAMPLES)
    return np.eye(SAMPLES) + walk * np.minimum(time_s[:, None], time_s[None, :])


def likeliest_walk(residual: np.ndarray) -> float:
    def cost(log_walk):
        matrix = covariance(np.exp(log_walk))
        variance = residual @ np.linalg.solve(matrix, residual) / SAMPLES
        return SAMPLES * np.log(variance) + np.linalg.slogdet(matrix)[1]

    return float(np.exp(minimize_scalar(cost, bounds=(-7, 7), options={"xatol": 1e-9}).x))


def fit_drifting(values: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], float]:
    found, walk, before = fit(values, True), 0.0, np.inf
    while abs(walk - before) > 1e-9 * walk:
        before, walk = walk, likeliest_walk(found[1])
        found = fit(values, True, np.linalg.cholesky(covariance(walk)), found[0])
    return found, walk


def main() -> None:
    k = np.arange(SAMPLES)
    moved = motion(TRUTH)
    velocity, position = moved[:, 0] + tone(k), moved[:, 6] + 1.5 + tone(k)
    steps = np.random.default_rng(1).normal(0.0, 0.003, SAMPLES)
    drifting = position + np.cumsum(steps)
    fit_of_drifting, walk = fit_drifting(drifting)
    json.dump(
        {
            "numpy": np.__version__,
            "scipy": scipy.__version__,
            "velocity": velocity.tolist(),
            "position": position.tolist(),
            "fit_of_velocity": plant(fit(velocity, False)),
            "fit_of_position": plant(fit(position, True)),
            "drifting": drifting.tolist(),
            "fit_of_drifting": plant(fit_of_drifting),
            "walk_of_drifting": walk,
        },
        sys.stdout,
        indent=1,
    )
    print()


if __name__ == "__main__":
    main()
