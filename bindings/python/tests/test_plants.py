"""Exported plants, against SciPy, CasADi, python-control and the command line."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi
import numpy as np
import pytest
import seaplant as sp
from scipy.integrate import solve_ivp

# SciPy's steps at a relative tolerance of 1e-10 against ours of 0.02 s over 20 s.
INTEGRATION = 1e-6
# Central differences over 1e-6 of numbers up to a hundred.
DIFFERENCE = 1e-6

AT = [1.0, 2.0, 3.0, 0.3, -0.4, 2.0, 0.8, -0.3, 0.2, 0.1, -0.2, 0.3]


@pytest.fixture(scope="module")
def rov() -> sp.Plant:
    return sp.Plant.open("published:bluerov2-heavy-von-benzon-2022")


def test_the_derivative_integrated_by_scipy_is_the_simulation(rov: sp.Plant) -> None:
    inputs = {"force.surge": 20.0, "force.yaw": 2.0, "force.heave": -5.0}
    u = rov.wrench(inputs)
    t = np.linspace(0.0, 20.0, 41)
    run = solve_ivp(
        lambda _, x: rov.derivative(x, u, current=(0.1, -0.2, 0.0)),
        (0.0, 20.0),
        np.zeros(12),
        t_eval=t,
        rtol=1e-10,
        atol=1e-12,
    )
    moved = rov.simulate(t, inputs, current=(0.1, -0.2))
    assert np.allclose(run.y[6:].T, moved.velocity, atol=INTEGRATION)
    assert np.allclose(run.y[3:6].T, np.unwrap(moved.pose[:, 3:], axis=0), atol=INTEGRATION)


def test_inputs_are_held_and_a_start_is_taken(rov: sp.Plant) -> None:
    t = np.arange(0.0, 10.5, 0.5)
    push = np.where(t < 5.0, 30.0, 0.0)
    moved = rov.simulate(t, {"force.surge": push}, start={"u": 0.5, "north": 7.0})
    assert moved.velocity[0, 0] == 0.5
    assert moved.pose[0, 0] == 7.0
    assert moved.velocity[10, 0] > moved.velocity[20, 0] > 0.0
    assert moved.to_pandas().loc[5.0, "u"] == moved.velocity[10, 0]


def test_the_simulation_is_the_command_lines(
    fit: sp.Fit, tmp_path: Path, command_line: Callable[..., Any]
) -> None:
    fit.save(tmp_path)
    told = command_line("simulate", tmp_path, "--step", "surge 500 N", "--for", "30")
    moved = fit.simulate(told["time_s"], {"force.surge": 500.0})
    assert np.array_equal(moved.velocity, told["velocity"])
    assert np.array_equal(moved.pose, told["pose"])
    assert np.array_equal(moved.band95, told["band95"])
    assert [of.value for of in moved.consequences] == [
        of["value"] for of in told["consequences"]
    ]


def test_jacobians_are_those_of_the_derivative(rov: sp.Plant) -> None:
    linear = rov.linearise(AT)
    assert linear.states == sp.plants.STATES
    found = np.zeros((12, 12))
    for k in range(12):
        step = np.zeros(12)
        step[k] = 1e-6
        ahead, back = (rov.derivative(AT + sign * step, linear.u0) for sign in (1, -1))
        found[:, k] = (ahead - back) / 2e-6
    assert np.allclose(linear.a, found, atol=DIFFERENCE)
    assert np.allclose(rov.derivative(AT, linear.u0)[6:], 0.0, atol=1e-12)


def test_a_single_axis_has_the_state_space_of_the_closed_form(fit: sp.Fit) -> None:
    linear = fit.linearise({"u": 0.5})
    p = fit["surge"].by_axis["surge"]
    assert linear.states == ("north", "u")
    slope = 2.0 * p.quadratic_drag.value * 0.5 + (p.linear_drag.value if p.linear_drag else 0.0)
    assert np.isclose(linear.poles.real.min(), -slope / p.mass.value, rtol=1e-12)
    assert np.allclose(linear.b, [[0.0], [1.0 / p.mass.value]])


def test_python_control_takes_it(fit: sp.Fit) -> None:
    import control

    linear = fit.linearise({"u": 0.5})
    system = linear.to_control()
    assert system.state_labels == ["north", "u"]
    assert system.input_labels == ["surge"]
    assert isinstance(system, control.StateSpace)
    response = system(0.3j)[system.output_index["u"], 0]
    assert np.isclose(response, linear.b[1, 0] / (0.3j - linear.a[1, 1]))


def test_casadi_has_the_same_derivative(rov: sp.Plant) -> None:
    module = rov.casadi()
    f = module.plant()
    assert isinstance(f, casadi.Function)
    u = np.array([10.0, -5.0, 3.0, 0.5, -0.2, 2.0])
    roll, pitch, heading = 0.5 * np.array(AT[3:6])
    (a, b), (c, d), (e, g) = ((np.cos(x), np.sin(x)) for x in (roll, pitch, heading))
    q = [
        a * c * e + b * d * g,
        b * c * e - a * d * g,
        a * d * e + b * c * g,
        a * c * g - b * d * e,
    ]
    found = np.array(f([*AT[:3], *q, *AT[6:]], u, module.PARAMETERS)).ravel()
    ours = rov.derivative(AT, u)
    assert np.allclose(found[:3], ours[:3], atol=1e-9)
    assert np.allclose(found[7:], ours[6:], atol=1e-9)


def test_thrusters_drive_it_by_name(fit: sp.Fit) -> None:
    plant = fit.plant()
    name = plant.thrusters[0]
    wrench = plant.wrench({f"thruster.{name}": 100.0})
    assert wrench[0] > 0.0
    moved = fit.simulate(np.arange(0.0, 60.0, 1.0), {f"thruster.{name}": 100.0})
    assert moved.velocity[-1, 0] > 0.0


def test_speeds_beyond_the_trials_are_said(fit: sp.Fit) -> None:
    moved = fit.simulate([0.0, 100.0], {"force.surge": 50_000.0})
    assert any("extrapolated" in note for note in moved.notes)


def test_disturbances_widen_the_band() -> None:
    dive = sp.twin(dofs=["surge"], duration_s=120.0, hold_out_s=60.0, disturbances=["tether"])
    plant = sp.identify(dive.trials, dive.vehicle).plant()
    t = np.arange(0.0, 60.0, 1.0)
    calm, rough = (
        plant.simulate(t, {"force.surge": 500.0}, disturbed=disturbed)
        for disturbed in (False, True)
    )
    assert calm.band95 is not None and rough.band95 is not None
    widths = [np.diff(of.band95[-1, 0])[0] for of in (calm, rough)]
    assert widths[1] > 1.1 * widths[0]


def test_results_hold_what_follows_from_the_plant(fit: sp.Fit) -> None:
    names = [of.name for of in fit.results.consequences]
    assert any(name.startswith("top speed at ") for name in names)
    first = fit.results.consequences[0]
    assert first.interval95 is not None
    assert first.interval95[0] < first.value < first.interval95[1]


def test_exports_are_the_command_lines(
    fit: sp.Fit, tmp_path: Path, command_line: Callable[..., Any]
) -> None:
    fit.save(tmp_path / "run")
    notes = fit.plant().export("c", tmp_path / "python")
    told = command_line("export", tmp_path / "run", "--to", "c", "--out", tmp_path / "program")
    assert list(notes) == told["notes"]
    texts = [
        re.sub(r"source: .*", "", (tmp_path / of / "seaplant_plant.h").read_text())
        for of in ("python", "program")
    ]
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda p: p.derivative([0.0] * 11, [0.0] * 6), "x has 11 numbers and needs 12"),
        (lambda p: p.derivative([np.nan] * 12, [0.0] * 6), "not finite"),
        (lambda p: p.derivative({"pitch": np.pi / 2}, [0.0] * 6), "straight up or down"),
        (lambda p: p.linearise({"speed": 1.0}), "unknown 'speed' of a state"),
        (lambda p: p.simulate([0, 1], {"surge": 1.0}), "unknown input `surge`"),
        (lambda p: p.simulate([0, 1], {"force.surge": [1.0] * 3}), r"shape \(3,\)"),
        (lambda p: p.simulate([0, 1], {"thruster.bow": 1.0}), "no such thruster"),
        (lambda p: p.simulate([0, 1], {"force.surge": "fast"}), "expected numbers"),
        (lambda p: p.export("simulink", "nowhere"), "simulink"),
    ],
)
def test_what_cannot_be_is_refused(
    rov: sp.Plant, call: Callable[[sp.Plant], Any], message: str
) -> None:
    with pytest.raises(sp.InputError, match=message):
        call(rov)


def test_a_table_is_no_fit_by_a_method() -> None:
    with pytest.raises(sp.InputError, match="leave method out"):
        sp.Plant.open("published:rexrov", method="paper")


def test_times_without_inputs_are_refused(fit: sp.Fit) -> None:
    with pytest.raises(sp.InputError, match="times and inputs"):
        fit.simulate([0.0, 1.0])  # type: ignore[call-overload]
