"""The header in C, compiled by cc."""

from __future__ import annotations

import ctypes
import subprocess

import numpy as np
import pytest

DOUBLES = ctypes.POINTER(ctypes.c_double)

WRAPPER = """
#include "seaplant_plant.h"
int acceleration(const double *theta, const double *nu, const double *down, const double *tau, double *out)
{ return seaplant_acceleration(theta, nu, down, tau, out); }
void derivative(const double *x, const double *tau, const double *current, double *dx)
{ seaplant_deriv(x, tau, current, dx); }
int step(double *x, const double *tau, const double *current, double h)
{ return seaplant_step(x, tau, current, h); }
void mass(const double *theta, double *out)
{ seaplant_mass(theta, (double (*)[6])out); }
void theta(double *out)
{ for (int k = 0; k < SEAPLANT_COEFFICIENTS; ++k) out[k] = seaplant_theta[k]; }
int count(void) { return SEAPLANT_COEFFICIENTS; }
void angles(const double *q, double *out) { seaplant_angles(q, out); }
void quaternion(double a, double b, double c, double *q) { seaplant_quaternion(a, b, c, q); }
void wrench(const double *input, double volts, double *tau)
{
#if SEAPLANT_THRUSTERS
    seaplant_wrench(input, volts, tau);
#else
    (void)input, (void)volts, (void)tau;
#endif
}
void actuated(const double *inputs, int count, int each, double volts, double h, double *tau)
{
#if SEAPLANT_THRUSTERS
    seaplant_actuators of;
    seaplant_actuators_begin(&of, inputs);
    for (int k = 0; k < count; ++k)
        seaplant_actuate(&of, &inputs[k / each * SEAPLANT_THRUSTERS], volts, h, &tau[6 * k]);
#else
    (void)inputs, (void)count, (void)each, (void)volts, (void)h, (void)tau;
#endif
}
"""


def pointer(x: np.ndarray):
    return x.ctypes.data_as(DOUBLES)


class Header:
    """The header as functions of arrays."""

    def __init__(self, case, folder) -> None:
        source = folder / "wrapper.c"
        source.write_text(WRAPPER)
        library = folder / "plant.so"
        warnings = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion"]
        include = f"-I{case.file('c')}"
        command = ["cc", "-std=c99", "-O2", "-fPIC", "-shared", *warnings, include]
        subprocess.run([*command, "-o", library, source, "-lm"], check=True)
        self.of = ctypes.CDLL(str(library))
        self.theta = np.zeros(self.of.count())
        self.of.theta(pointer(self.theta))

    def acceleration(self, nu, down, tau, theta=None):
        out = np.zeros(6)
        theta = self.theta if theta is None else theta
        arrays = [np.ascontiguousarray(x, float) for x in (theta, nu, down, tau)]
        assert self.of.acceleration(*map(pointer, arrays), pointer(out)) == 0
        return out

    def derivative(self, x, tau, current):
        out = np.zeros(13)
        arrays = [np.ascontiguousarray(a, float) for a in (x, tau, current)]
        self.of.derivative(*map(pointer, arrays), pointer(out))
        return out

    def step(self, x, tau, h, current=(0.0, 0.0, 0.0)):
        x = np.array(x, float)
        arrays = [np.ascontiguousarray(a, float) for a in (tau, current)]
        assert self.of.step(pointer(x), *map(pointer, arrays), ctypes.c_double(h)) == 0
        return x


@pytest.fixture(scope="session")
def headers(tmp_path_factory):
    """The compiled header of each plant, compiled once."""
    compiled: dict[str, Header] = {}

    def of(case) -> Header:
        if case.name not in compiled:
            compiled[case.name] = Header(case, tmp_path_factory.mktemp(case.name))
        return compiled[case.name]

    return of


@pytest.fixture
def header(request, headers):
    name = "case" if "case" in request.fixturenames else "six"
    return headers(request.getfixturevalue(name))


def test_accelerations(case, header):
    case.check_rates(lambda x, s: header.derivative(x, s["force"], s["current"])[7:])


def test_a_minute(case, header):
    case.check_trajectory(header.step)


def test_coriolis_forces_have_the_sign_of_kirchhoff(six, header, kirchhoff):
    """Without damping and restoring, M nu' = -C nu."""
    mass = np.array(six.reference["mass"])
    bare = masses_alone(six, header)
    for x, _ in list(six.states())[:20]:
        nu = x[7:]
        rate = header.acceleration(nu, (0, 0, 1), np.zeros(6), bare)
        expected = -kirchhoff(mass, nu)
        assert np.allclose(mass @ rate, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def masses_alone(case, header) -> np.ndarray:
    """The coefficients with all but the masses at zero."""
    names = coefficient_names(case)
    return np.where([name.startswith("mass.") for name in names], header.theta, 0.0)


def coefficient_names(case) -> list[str]:
    text = case.file("c", "seaplant_plant.h").read_text()
    block = text.split("seaplant_theta[SEAPLANT_COEFFICIENTS] = {")[1].split("};")[0]
    return [line.split("/* ")[1].split(" [")[0] for line in block.strip().splitlines()]


def test_energy_is_kept_without_damping(six, header):
    """Kinetic and potential energy of weight, buoyancy and lever."""
    names = coefficient_names(six)
    keep = [n.startswith(("mass.", "lever.", "weight")) for n in names]
    theta = np.where(keep, header.theta, 0.0)
    mass = np.array(six.reference["mass"])
    value = dict(zip(names, header.theta, strict=True))
    excess = value.get("weight-minus-buoyancy", 0.0)
    lever = np.array([value.get(f"lever.{axis}", 0.0) for axis in "xyz"])

    def energy(nu, down, depth):
        return 0.5 * nu @ mass @ nu - excess * depth - lever @ down

    x = np.array([0, 0, 0, 1, 0, 0, 0, 0.8, -0.3, 0.2, 0.3, -0.4, 0.5], float)
    first = energy(x[7:], np.array([0, 0, 1.0]), 0.0)
    worst, h = 0.0, 0.005
    for _ in range(2000):
        x = rk4(header, theta, x, h)
        worst = max(worst, abs(energy(x[7:], down_of(x), x[2]) - first))
    assert worst < 1e-6 * max(1.0, abs(first)), worst


def down_of(x):
    w, a, b, c = x[3:7]
    return np.array([2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)])


def rk4(header, theta, x, h):
    """Pose by hand, so that only the acceleration is the header's."""

    def rate(x):
        w, a, b, c = x[3:7]
        p, q, r = x[10:]
        rotation = np.array(
            [
                [1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)],
                [2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)],
                [2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)],
            ]
        )
        turn = 0.5 * np.array(
            [
                -a * p - b * q - c * r,
                w * p + b * r - c * q,
                w * q + c * p - a * r,
                w * r + a * q - b * p,
            ]
        )
        acceleration = header.acceleration(x[7:], down_of(x), np.zeros(6), theta)
        return np.concatenate([rotation @ x[7:10], turn, acceleration])

    k1 = rate(x)
    k2 = rate(x + 0.5 * h * k1)
    k3 = rate(x + 0.5 * h * k2)
    k4 = rate(x + h * k3)
    x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    x[3:7] /= np.linalg.norm(x[3:7])
    return x


def test_top_speed_in_surge(header, case):
    """At the speed that damping allows, thrust is all used up."""
    if case.name not in {"surge", "boat"}:
        pytest.skip("surge of this plant moves other axes")
    value = case.reference["coefficients"]
    linear, quadratic = value.get("surge: u", 0.0), value["surge: |u|u"]
    bias, tau = value.get("surge: 1", 0.0), 100.0 if case.name != "surge" else 2000.0
    top = (-linear + np.sqrt(linear**2 + 4 * quadratic * (tau - bias))) / (2 * quadratic)
    x = np.zeros(13)
    x[3] = 1.0
    for _ in range(20_000):
        x = header.step(x, [tau, 0, 0, 0, 0, 0], 0.02)
    assert abs(x[7] - top) < 1e-6


def test_free_roll_has_the_period_of_its_lever(header, case):
    if case.name != "heavy":
        pytest.skip("one plant with a plain lever is enough")
    value = case.reference["coefficients"]
    lever, inertia = value["lever.z"], value["mass.roll"]
    x = np.zeros(13)
    x[3:7] = np.cos(0.005), np.sin(0.005), 0, 0
    signs, h = [], 0.01
    for _ in range(2000):
        x = header.step(x, np.zeros(6), h)
        signs.append(x[4] > 0)
    turns = np.flatnonzero(np.diff(np.array(signs, int)))
    period = 2 * h * np.diff(turns).mean()
    assert abs(period / (2 * np.pi * np.sqrt(inertia / lever)) - 1) < 0.01


def test_thrusters(case, header):
    thrust = case.reference["thrust"]
    for inputs, expected in zip(thrust["inputs"], thrust["wrench"], strict=True):
        if not inputs:
            return
        tau, given = np.zeros(6), np.array(inputs)
        header.of.wrench(pointer(given), ctypes.c_double(thrust["supply_v"]), pointer(tau))
        assert np.allclose(tau, expected, rtol=1e-12, atol=1e-12)


def test_lag_delay_and_reverse_ratio(case, header):
    """Steps of 0.02 s through the actuators are those of ``seaplant simulate``."""
    actuated = case.reference["actuated"]
    if actuated is None:
        return
    inputs = np.ascontiguousarray(np.array(actuated["inputs"]).T)
    expected = np.array(actuated["wrench"])
    found = np.zeros_like(expected)
    volts, h = ctypes.c_double(actuated["supply_v"]), ctypes.c_double(0.02)
    header.of.actuated(pointer(inputs), len(expected), 25, volts, h, pointer(found))
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    if case.name == "every-term":
        # Lag and delay are no small thing: without them the wrench is another.
        plain = np.zeros(6)
        header.of.wrench(pointer(inputs[1].copy()), volts, pointer(plain))
        assert np.abs(expected[25] - plain)[[0, 1, 5]].min() > 1.0


def test_angles_and_quaternions_are_each_others_inverse(case, header):
    for _, state in case.states():
        q, angles = np.zeros(4), np.zeros(3)
        header.of.quaternion(*map(ctypes.c_double, state["angles"]), pointer(q))
        assert np.allclose(
            q * np.sign(q[0]), state["quaternion"] * np.sign(state["quaternion"][0])
        )
        header.of.angles(pointer(q), pointer(angles))
        assert np.allclose(angles, state["angles"])


ROS2_OF_PLANT = {"package.xml", "plant.py", "seaplant_plant.yaml"}
"""The files of the package that are not the same for every plant."""


def test_every_file_says_what_it_is(case):
    """Units, frames, source and uncertainty stand in each format's files."""
    for path in case.file().rglob("*"):
        if (
            not path.is_file()
            or path.suffix in {".fmu", ".config"}
            or path.parent == case.file()
            or (path.is_relative_to(case.file("ros2")) and path.name not in ROS2_OF_PLANT)
        ):
            continue
        text = path.read_text()
        for word in ("units: SI", "frames:", "source:", "standard deviation"):
            assert word in text, (path, word)
        if not case.own.all():
            assert "NOT KNOWN" in text, path
