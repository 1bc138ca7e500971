"""Output error of a surge trial with other tools, timed: the other side of run.sh.

`python output_error.py TOOL FILE TIMES` reads N velocities, then N forces (little-endian
doubles, 10 Hz) from FILE and a start [alpha, beta, mu, bias, v0] from FILE.start, fits
them TIMES times with TOOL (scipy, numba, casadi or jax) and prints one `name value` a line.

All minimise the sum of squares between measured velocity and one RK4 step a sample under
held force, over the five numbers, and stop at the same relative tolerance. Everything but
reading the file and importing the tool counts into `cold_s`: compilation is part of a first fit.
"""

import sys
import time

import numpy as np

STEP_S = 0.1
# Convergence tolerance of the step, relative to the scaled unknowns: some millionths of a
# standard deviation.
TOLERANCE = 1e-8
MOST_ITERATIONS = 30
# Steps in the unknowns that move the simulation by about the same amount.
SCALE = np.array([1e-5, 1e-2, 1e-2, 1e-3, 1e-2])


def scipy_tool(v, tau):
    """Runs least_squares over an RK4 loop in Python, with its finite-difference Jacobian."""
    from scipy.optimize import least_squares

    forces = tau.tolist()

    def residual(theta):
        alpha, beta, mu, bias, x = theta.tolist()
        simulated = [x]
        for k in range(len(forces) - 1):
            c = alpha * forces[k] + bias
            k1 = c + (beta * abs(x) + mu) * x
            y = x + 0.5 * STEP_S * k1
            k2 = c + (beta * abs(y) + mu) * y
            y = x + 0.5 * STEP_S * k2
            k3 = c + (beta * abs(y) + mu) * y
            y = x + STEP_S * k3
            k4 = c + (beta * abs(y) + mu) * y
            x += STEP_S / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            simulated.append(x)
        return np.array(simulated) - v

    def fit(start):
        # MINPACK's Levenberg-Marquardt takes fewer evaluations here than trf.
        return least_squares(
            residual, start, method="lm", x_scale=SCALE, xtol=TOLERANCE, ftol=1e-15, gtol=1e-15
        ).x

    return fit


def gauss_newton(normal):
    """Runs Gauss-Newton over a function that returns JᵀJ and Jᵀr; it needs no damping here."""

    def fit(start):
        theta = start.copy()
        for _ in range(MOST_ITERATIONS):
            information, score = normal(theta)
            information, score = np.asarray(information), np.asarray(score)
            step = SCALE * np.linalg.solve(information * np.outer(SCALE, SCALE), SCALE * score)
            theta = theta + step
            if np.linalg.norm(step / SCALE) < TOLERANCE * np.linalg.norm(theta / SCALE):
                return theta
        raise SystemExit("Gauss-Newton did not converge")

    return fit


def numba_tool(v, tau):
    """Runs compiled RK4 with forward sensitivities; JᵀJ and Jᵀr are summed in the same loop."""
    import numba

    @numba.njit
    def normal(theta):
        alpha, beta, mu, bias, x = theta[0], theta[1], theta[2], theta[3], theta[4]
        s = np.zeros(5)
        s[4] = 1.0
        k = np.zeros((4, 5))
        information = np.zeros((5, 5))
        score = np.zeros(5)
        h = STEP_S
        for n in range(v.size):
            r = v[n] - x
            for i in range(5):
                score[i] += s[i] * r
                for j in range(i + 1):
                    information[i, j] += s[i] * s[j]
            if n == v.size - 1:
                break
            force = tau[n]
            c = alpha * force + bias
            total = 0.0
            y = x
            kx = 0.0
            for stage in range(4):
                part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
                y = x + part * h * kx
                kx = c + (beta * abs(y) + mu) * y
                slope = 2.0 * beta * abs(y) + mu
                for i in range(5):
                    before = k[stage - 1, i] if stage > 0 else 0.0
                    k[stage, i] = slope * (s[i] + part * h * before)
                k[stage, 0] += force
                k[stage, 1] += y * abs(y)
                k[stage, 2] += y
                k[stage, 3] += 1.0
                total += kx * (1.0 if stage == 0 or stage == 3 else 2.0)
            x += h / 6.0 * total
            for i in range(5):
                s[i] += h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
        for i in range(5):
            for j in range(i):
                information[j, i] = information[i, j]
        return information, score

    return gauss_newton(normal)


def casadi_tool(v, tau):
    """Runs a mapped accumulation of one RK4 step, with CasADi's Jacobian of the complete
    accumulation."""
    import casadi as ca

    x, theta, force = ca.SX.sym("x"), ca.SX.sym("theta", 4), ca.SX.sym("force")

    def slope(x):
        return theta[0] * force + (theta[1] * ca.fabs(x) + theta[2]) * x + theta[3]

    k1 = slope(x)
    k2 = slope(x + 0.5 * STEP_S * k1)
    k3 = slope(x + 0.5 * STEP_S * k2)
    k4 = slope(x + STEP_S * k3)
    after = x + STEP_S / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    step = ca.Function("step", [x, theta, force], [after])
    # Forward sensitivities of one step, accumulated, are faster here than a Jacobian of the
    # complete accumulation.
    s = ca.SX.sym("s", 1, 5)
    by_theta = ca.horzcat(ca.jacobian(after, theta), ca.SX(1, 1))
    moved = ca.Function(
        "moved",
        [ca.vertcat(x, s.T), theta, force],
        [ca.vertcat(after, (ca.jacobian(after, x) * s + by_theta).T)],
    )
    assert step.n_in() == 3
    whole = moved.mapaccum("whole", v.size - 1)

    def normal(theta):
        first = np.concatenate([theta[4:], [0.0, 0.0, 0.0, 0.0, 1.0]])
        later = whole(first, np.tile(theta[:4, None], v.size - 1), tau[None, :-1]).full()
        all_states = np.column_stack([first, later])
        jacobian = all_states[1:]
        return jacobian @ jacobian.T, jacobian @ (v - all_states[0])

    return gauss_newton(normal)


def jax_tool(v, tau):
    """Runs lax.scan with forward-mode Jacobian under jit, in double precision."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    measured, forces = jnp.asarray(v), jnp.asarray(tau[:-1])

    def residual(theta):
        alpha, beta, mu, bias = theta[0], theta[1], theta[2], theta[3]

        def step(x, force):
            c = alpha * force + bias

            def slope(x):
                return c + (beta * jnp.abs(x) + mu) * x

            k1 = slope(x)
            k2 = slope(x + 0.5 * STEP_S * k1)
            k3 = slope(x + 0.5 * STEP_S * k2)
            k4 = slope(x + STEP_S * k3)
            after = x + STEP_S / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            return after, after

        _, later = jax.lax.scan(step, theta[4], forces)
        return measured - jnp.concatenate([theta[4:], later])

    @jax.jit
    def normal(theta):
        jacobian = -jax.jacfwd(residual)(theta)
        return jacobian.T @ jacobian, jacobian.T @ residual(theta)

    return gauss_newton(normal)


TOOLS = {"scipy": scipy_tool, "numba": numba_tool, "casadi": casadi_tool, "jax": jax_tool}
IMPORTS = {"scipy": "scipy.optimize"}


def main():
    tool, file, times = sys.argv[1], sys.argv[2], int(sys.argv[3])
    v, tau = np.fromfile(file, dtype="<f8").reshape(2, -1)
    start = np.loadtxt(file + ".start")
    __import__(IMPORTS.get(tool, tool))

    started = time.perf_counter()
    fit = TOOLS[tool](v, tau)
    found = fit(start)
    print(f"cold_s {time.perf_counter() - started:e}")
    for _ in range(times):
        started = time.perf_counter()
        found = fit(start)
        print(f"fit_s {time.perf_counter() - started:e}")
    for name, value in zip(("alpha", "beta", "mu", "bias"), found):
        print(f"{name} {value:.17e}")


if __name__ == "__main__":
    main()
