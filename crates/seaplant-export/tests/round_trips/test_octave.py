"""The m-files, run by Octave."""

from __future__ import annotations

import os
import subprocess

import numpy as np
import pytest

OCTAVE = os.environ.get("OCTAVE")

SCRIPT = """
addpath('{folder}');
in = load('-ascii', '{states}');
out = zeros(rows(in), 12);
for k = 1:rows(in)
    x = in(k, 1:12)';
    [xdot, U, M] = seaplant_plant(x, in(k, 13:18)', in(k, 19), in(k, 20));
    out(k, :) = xdot';
end
f = fopen('{rates}', 'w'); fprintf(f, [repmat('%.17g ', 1, 12) '\\n'], out'); fclose(f);
forces = load('-ascii', '{forces}');
x = zeros(12, 1); x(12) = {heading};
V = {speed}; beta = {direction};
last = {last};
out = zeros(last + 1, 12);
for k = 0:last
    out(k + 1, :) = x';
    tau = forces(:, min(floor(k / 10) + 1, columns(forces)));
    for n = 1:25
        a = seaplant_plant(x, tau, V, beta);
        b = seaplant_plant(x + 0.01 * a, tau, V, beta);
        c = seaplant_plant(x + 0.01 * b, tau, V, beta);
        d = seaplant_plant(x + 0.02 * c, tau, V, beta);
        x = x + 0.02 / 6 * (a + 2 * b + 2 * c + d);
    end
end
f = fopen('{trajectory}', 'w'); fprintf(f, [repmat('%.17g ', 1, 12) '\\n'], out'); fclose(f);
"""

FOLLOWED = {"every-term", "boat"}
"""Plants that Octave follows for a minute; it takes its time."""

EULER = 1e-5
"""Euler angles and quaternions in steps of 0.02 s, m/s and rad/s."""


@pytest.mark.skipif(not OCTAVE, reason="there is no Octave")
def test_octave(case, tmp_path):
    states = list(case.states())
    rows = []
    for _, s in states:
        # The m-file has a level current, as MSS does.
        speed, direction = (
            np.hypot(*s["current"][:2]),
            np.arctan2(s["current"][1], s["current"][0]),
        )
        rows.append([*s["velocity"], 0, 0, 0, *s["angles"], *s["force"], speed, direction])
    np.savetxt(tmp_path / "states.txt", rows, fmt="%.17g")
    trajectory = case.reference["trajectory"]
    np.savetxt(tmp_path / "forces.txt", trajectory["forces"], fmt="%.17g")
    current = trajectory["current"]
    script = SCRIPT.format(
        folder=case.file("octave"),
        heading=trajectory["heading"],
        last=120 if case.name in FOLLOWED else 0,
        speed=np.hypot(*current[:2]),
        direction=np.arctan2(current[1], current[0]),
        **{
            name: tmp_path / f"{name}.txt"
            for name in ("states", "rates", "forces", "trajectory")
        },
    )
    (tmp_path / "run.m").write_text(script)
    command = [*OCTAVE.split(), "--no-gui", "--norc", "--quiet", tmp_path / "run.m"]
    subprocess.run(command, check=True, timeout=120)
    rates = np.loadtxt(tmp_path / "rates.txt")
    plant = level(case)
    for (x, s), found in zip(states, rates, strict=True):
        expected = plant.derivative(x, s["force"], [*s["current"][:2], 0.0])
        scale = max(1.0, np.abs(expected).max())
        assert np.abs(found[:6] - expected[7:])[case.own].max() < 1e-9 * scale
        assert np.allclose(found[6:9], expected[:3])
    found = np.loadtxt(tmp_path / "trajectory.txt", ndmin=2)[:, :6]
    expected = np.array(trajectory["velocity"])[: len(found)]
    assert np.abs(found - expected)[:, case.own].max() < EULER


DRIVEN = """
addpath('{folder}');
inputs = load('-ascii', '{inputs}');
state = seaplant_thrusters([], inputs(:, 1));
out = zeros(6, {steps});
for k = 1:{steps}
    [state, out(:, k)] = seaplant_thrusters(state, inputs(:, floor((k - 1) / 25) + 1), 0.02, {volts});
end
f = fopen('{wrench}', 'w'); fprintf(f, [repmat('%.17g ', 1, 6) '\\n'], out); fclose(f);
"""


@pytest.mark.skipif(not OCTAVE, reason="there is no Octave")
def test_lag_delay_and_reverse_ratio_of_octave(case, tmp_path):
    actuated = case.reference["actuated"]
    if actuated is None:
        assert not case.file("octave", "seaplant_thrusters.m").exists()
        return
    np.savetxt(tmp_path / "inputs.txt", actuated["inputs"], fmt="%.17g")
    expected = np.array(actuated["wrench"])
    script = DRIVEN.format(
        folder=case.file("octave"),
        inputs=tmp_path / "inputs.txt",
        wrench=tmp_path / "wrench.txt",
        steps=len(expected),
        volts=actuated["supply_v"],
    )
    (tmp_path / "run.m").write_text(script)
    command = [*OCTAVE.split(), "--no-gui", "--norc", "--quiet", tmp_path / "run.m"]
    subprocess.run(command, check=True, timeout=120)
    found = np.loadtxt(tmp_path / "wrench.txt", ndmin=2)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def level(case):
    """The module for NumPy, itself held against Seaplant in a current of three components."""
    from test_python import module

    return module(case.file("python", "seaplant_plant.py"))
