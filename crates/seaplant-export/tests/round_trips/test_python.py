"""The modules for NumPy and CasADi, and the one in Rust."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import numpy as np


def module(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    loaded = importlib.util.module_from_spec(spec)
    sys.dont_write_bytecode = True
    spec.loader.exec_module(loaded)
    return loaded


def test_numpy(case):
    plant = module(case.file("python", "seaplant_plant.py"))
    case.check_rates(lambda x, s: plant.derivative(x, s["force"], s["current"])[7:])
    x, state = next(iter(case.states()))
    derivative = plant.derivative(x, state["force"], state["current"])
    assert np.abs(derivative[3:7] @ x[3:7]) < 1e-12
    thrust = case.reference["thrust"]
    for inputs, expected in zip(thrust["inputs"], thrust["wrench"], strict=True):
        if inputs:
            assert np.allclose(plant.wrench(inputs, thrust["supply_v"]), expected)
    if plant.COVARIANCE is not None:
        draws = plant.draws(4000, 1)
        assert np.allclose(draws.std(axis=0), np.sqrt(np.diag(plant.COVARIANCE)), rtol=0.1)
        assert np.array_equal(draws, plant.draws(4000, 1))


def test_lag_delay_and_reverse_ratio_of_numpy(case):
    actuated = case.reference["actuated"]
    if actuated is None:
        return
    plant = module(case.file("python", "seaplant_plant.py"))
    inputs, expected = np.array(actuated["inputs"]).T, np.array(actuated["wrench"])
    actuators = plant.Actuators(inputs[0])
    volts = actuated["supply_v"]
    found = [actuators.wrench(inputs[k // 25], 0.02, volts) for k in range(len(expected))]
    assert np.abs(np.array(found) - expected).max() < 1e-9 * np.abs(expected).max()


def test_the_lag_is_that_of_its_differential_equation(case):
    """The speed behind a lag, by SciPy's closed form of a first-order system."""
    if case.name != "every-term":
        return
    plant = module(case.file("python", "seaplant_plant.py"))
    start, goal = np.full(len(plant.THRUSTERS), 1500.0), np.full(len(plant.THRUSTERS), 1900.0)
    actuators = plant.Actuators(start)
    for _ in range(50):
        actuators.wrench(goal, 0.02, 15.0)
    # A second after the step, delayed by 0.12 s, with a lag of 0.3 s, of 0.6 s for starboard, and of none for stern.
    left = [np.exp(-(1.0 - 0.12) / lag) if lag else 0.0 for lag in (0.3, 0.6, 0.0, 0.3)]
    assert np.allclose(actuators.speed[0], 1900.0 - 400.0 * np.array(left), rtol=1e-12)


def test_a_minute_of_numpy(case):
    if case.name != "every-term":
        return
    plant = module(case.file("python", "seaplant_plant.py"))
    case.check_trajectory(plant.step)


def test_casadi(case):
    plant = module(case.file("casadi", "seaplant_casadi.py"))
    f = plant.plant()

    def parameters(current):
        return np.concatenate([plant.THETA, current])

    case.check_rates(
        lambda x, s: np.array(f(x, s["force"], parameters(s["current"]))).ravel()[7:]
    )

    def step(x, tau, h, current):
        def rate(x):
            return np.array(f(x, tau, parameters(current))).ravel()

        a = rate(x)
        b = rate(x + 0.5 * h * a)
        c = rate(x + 0.5 * h * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + rate(x + h * c))
        x[3:7] /= np.linalg.norm(x[3:7])
        return x

    case.check_trajectory(step)


MAIN = """
#[path = "PLANT"]
mod plant;
use std::io::Read;
fn main() {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).unwrap();
    for line in text.lines() {
        let all: Vec<f64> = line.split_whitespace().map(|x| x.parse().unwrap()).collect();
        let x: [f64; 13] = all[..13].try_into().unwrap();
        let tau: [f64; 6] = all[13..19].try_into().unwrap();
        let current: [f64; 3] = all[19..22].try_into().unwrap();
        let dx = plant::derivative(&plant::THETA, &x, &tau, &current).unwrap();
        let next = plant::step(&plant::THETA, &x, &tau, &current, 0.02).unwrap();
        let words: Vec<String> = dx.iter().chain(&next).map(|x| format!("{x:e}")).collect();
        println!("{}", words.join(" "));
    }
}
"""


def test_rust(case, tmp_path):
    main = tmp_path / "main.rs"
    main.write_text(MAIN.replace("PLANT", str(case.file("rust", "seaplant_plant.rs"))))
    program = tmp_path / "program"
    command = [
        "rustc",
        "--edition=2024",
        "-D",
        "warnings",
        "-A",
        "dead_code",
        "-o",
        program,
        main,
    ]
    subprocess.run(command, check=True)
    states = list(case.states())
    lines = [np.concatenate([x, s["force"], s["current"]]) for x, s in states]
    text = "\n".join(" ".join(map(repr, map(float, line))) for line in lines)
    ran = subprocess.run([program], input=text, capture_output=True, text=True, check=True)
    rows = [np.array(line.split(), float) for line in ran.stdout.splitlines()]
    found = iter(rows)
    case.check_rates(lambda x, s: next(found)[7:13])
    # The step is that of the module for NumPy.
    plant = module(case.file("python", "seaplant_plant.py"))
    for (x, s), row in list(zip(states, rows, strict=True))[:20]:
        assert np.allclose(row[13:], plant.step(x, s["force"], 0.02, s["current"]), rtol=1e-9)


DRIVEN = """
#[path = "PLANT"]
mod plant;
use std::io::Read;
fn main() {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).unwrap();
    let read = |line: &str| -> [f64; plant::THRUSTERS] {
        let all: Vec<f64> = line.split_whitespace().map(|x| x.parse().unwrap()).collect();
        all.try_into().unwrap()
    };
    let rows: Vec<[f64; plant::THRUSTERS]> = text.lines().map(read).collect();
    let mut actuators = plant::Actuators::new(rows[0]);
    for k in 0..STEPS {
        let tau = actuators.wrench(rows[k / 25], 0.02, VOLTS);
        println!("{}", tau.map(|x| format!("{x:e}")).join(" "));
    }
}
"""


def test_lag_delay_and_reverse_ratio_of_rust(case, tmp_path):
    actuated = case.reference["actuated"]
    if actuated is None:
        return
    inputs, expected = np.array(actuated["inputs"]).T, np.array(actuated["wrench"])
    text = DRIVEN.replace("PLANT", str(case.file("rust", "seaplant_plant.rs")))
    text = text.replace("STEPS", str(len(expected)))
    (tmp_path / "main.rs").write_text(text.replace("VOLTS", repr(float(actuated["supply_v"]))))
    program = tmp_path / "program"
    command = ["rustc", "--edition=2024", "-D", "warnings", "-A", "dead_code", "-o", program]
    subprocess.run([*command, tmp_path / "main.rs"], check=True)
    rows = "\n".join(" ".join(map(repr, map(float, row))) for row in inputs)
    ran = subprocess.run([program], input=rows, capture_output=True, text=True, check=True)
    found = np.array([line.split() for line in ran.stdout.splitlines()], float)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


ACTUATED = 1e-8
"""A lag followed by Runge-Kutta steps of 0.01 s, as a part of the greatest force."""

INTEGRATED = 3e-5
"""The same where a propeller's speed changes its sign or its lag within a step."""


def test_lag_delay_and_reverse_ratio_of_casadi(case):
    """The differential equation of the lags, its inputs delayed here, makes the same wrench."""
    actuated = case.reference["actuated"]
    if actuated is None:
        return
    plant = module(case.file("casadi", "seaplant_casadi.py"))
    inputs, expected = np.array(actuated["inputs"]).T, np.array(actuated["wrench"])
    volts, f = actuated["supply_v"], plant.actuated()
    p = np.append(plant.PARAMETERS, volts)
    z, count, found = plant.start(case.start(), inputs[0], volts), 6 * inputs.shape[1], []
    for k in range(len(expected)):
        since = [max(0, int((0.02 * (k + 0.5) - delay) // 0.5)) for delay in plant.DELAY_S]
        u = np.concatenate([inputs[at] for at in since])
        for half in range(2):

            def rate(z, u=u):
                out = np.zeros(len(z))
                out[13:] = np.array(f(z, u, p)[0]).ravel()[13:]
                return out

            a = rate(z)
            b = rate(z + 0.005 * a)
            c = rate(z + 0.005 * b)
            z = z + 0.01 / 6 * (a + 2 * b + 2 * c + rate(z + 0.01 * c))
            if half == 0:
                found.append(np.array(f(z, u, p)[1]).ravel())
    assert count == len(u)
    assert np.abs(np.array(found) - expected).max() < INTEGRATED * np.abs(expected).max()
