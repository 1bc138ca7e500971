"""gz-sim's model: DART with full added mass, beside Hydrodynamics as its equations are.

gz-sim is not to be had from package registries. Its engine, DART, is; what its plugins add is
written down here: the damping of Hydrodynamics, the force of Buoyancy, gravity at the centre of
mass.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import dartpy as dart
import numpy as np

AXES = "xyzkmn"
COLUMNS = "UVWPQR"
TURN = np.diag([1.0, -1, -1, 1, -1, -1])
"""From x forward, y starboard, z down to x forward, y port, z up, and back."""

GRAVITY = 9.80665
DENSITY = 1000.0

DART = 1e-9
"""Accelerations by another algorithm, as a part of the greatest."""


class Model:
    """What a simulator reads of model.sdf."""

    def __init__(self, case) -> None:
        (path,) = case.file("gazebo").glob("*/model.sdf")
        self.root = ET.parse(path).getroot()
        link = self.root.find("model/link[@name='base_link']")
        inertial = link.find("inertial")
        self.mass = float(inertial.findtext("mass"))
        self.com = np.array(inertial.findtext("pose").split(), float)[:3]
        inertia = {e.tag: float(e.text) for e in inertial.find("inertia")}
        x, y, z = "ixx", "iyy", "izz"
        xy, xz, yz = "ixy", "ixz", "iyz"
        rows = [[x, xy, xz], [xy, y, yz], [xz, yz, z]]
        self.inertia = np.array([[inertia[name] for name in row] for row in rows])
        letters = "xyzpqr"
        entries = {e.tag: float(e.text) for e in inertial.find("fluid_added_mass")}
        self.added = np.zeros((6, 6))
        for tag, value in entries.items():
            i, j = (letters.index(c) for c in tag)
            self.added[i, j] = self.added[j, i] = value
        box = np.array(link.findtext("collision/geometry/box/size").split(), float)
        self.volume = box.prod()
        self.buoyancy = np.array(link.findtext("collision/pose").split(), float)[:3]
        plugin = self.root.find("model/plugin[@name='gz::sim::systems::Hydrodynamics']")
        assert plugin.findtext("disable_added_mass") == "true"
        assert plugin.findtext("disable_coriolis") == "true"
        self.terms = [(e.tag, float(e.text)) for e in plugin if e.tag[1:2].isupper()]

    def mass_matrix(self) -> np.ndarray:
        """Of the link about its origin."""

        def cross(r):
            return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])

        s = cross(self.com)
        m = np.zeros((6, 6))
        m[:3, :3] = self.mass * np.eye(3)
        m[:3, 3:] = -self.mass * s
        m[3:, :3] = self.mass * s
        m[3:, 3:] = self.inertia - self.mass * s @ s
        return m

    def damping(self, nu: np.ndarray) -> np.ndarray:
        """Force of Hydrodynamics: -D nu, D_ij = -lin - sum abs |nu_k| - sum quad nu_k."""
        force = np.zeros(6)
        for tag, value in self.terms:
            row = AXES.index(tag[0])
            j = COLUMNS.index(tag[1])
            if len(tag) == 2:
                force[row] += value * nu[j]
            elif "abs" in tag:
                force[row] += value * nu[j] * abs(nu[COLUMNS.index(tag[-1])])
            else:
                force[row] += value * nu[j] * nu[COLUMNS.index(tag[-1])]
        return force


def accelerate(model: Model, angles, nu, tau):
    """nu' of DART's free body, all in x forward, y port, z up."""
    skeleton = dart.dynamics.Skeleton("vehicle")
    joint, body = skeleton.createFreeJointAndBodyNodePair()
    inertia = dart.dynamics.Inertia()
    # Angular before linear, as DART has it.
    whole = model.mass_matrix() + model.added
    order = [3, 4, 5, 0, 1, 2]
    inertia.setSpatialTensor(whole[np.ix_(order, order)])
    body.setInertia(inertia)
    skeleton.setGravity([0, 0, 0])
    roll, pitch, yaw = angles
    rotation = euler(roll, -pitch, -yaw)
    pose = np.eye(4)
    pose[:3, :3] = rotation
    joint.setTransform(dart.math.Isometry3(pose))
    joint.setVelocities(np.linalg.solve(body.getJacobian(body), nu[[3, 4, 5, 0, 1, 2]]))
    up = rotation.T @ [0, 0, 1.0]
    weight, buoyancy = model.mass * GRAVITY, DENSITY * model.volume * GRAVITY
    wrench = tau + model.damping(nu)
    wrench[:3] += (buoyancy - weight) * up
    wrench[3:] += np.cross(model.com, -weight * up) + np.cross(model.buoyancy, buoyancy * up)
    body.setExtForce(wrench[:3], [0, 0, 0], True, True)
    body.addExtTorque(wrench[3:], True)
    skeleton.computeForwardDynamics()
    return np.array(body.getSpatialAcceleration())[[3, 4, 5, 0, 1, 2]]


def euler(roll, pitch, yaw):
    a, b, c = np.cos([roll, pitch, yaw])
    d, e, f = np.sin([roll, pitch, yaw])
    x = np.array([[1, 0, 0], [0, a, -d], [0, d, a]])
    y = np.array([[b, 0, e], [0, 1, 0], [-e, 0, b]])
    z = np.array([[c, -f, 0], [f, c, 0], [0, 0, 1]])
    return z @ y @ x


def left_out(case) -> bool:
    """Whether the format says that it leaves terms out."""
    text = next(iter(case.file("gazebo").glob("*/model.sdf"))).read_text()
    return "left out" in text


def test_mass_and_added_mass_are_the_plants(case):
    model = Model(case)
    whole = TURN @ (model.mass_matrix() + model.added) @ TURN
    expected = np.array(case.reference["mass"])
    known = np.ix_(case.own, case.own)
    assert np.allclose(whole[known], expected[known], rtol=1e-12, atol=1e-9)


def test_damping_brakes(case):
    """Negative coefficients, as gz-sim has them; VRX has them positive."""
    for tag, value in Model(case).terms:
        own = AXES.index(tag[0]) == COLUMNS.index(tag[1])
        if own and (len(tag) == 2 or tag[2:] == f"abs{tag[1]}"):
            assert value <= 0.0, tag


def test_quadratic_damping_has_a_modulus(case):
    """xUU is u u since 2022, xUabsU is u |u|."""
    tags = [tag for tag, _ in Model(case).terms]
    assert "xUabsU" in tags or not case.own[0]
    assert "xUU" not in tags


def test_accelerations_in_dart(six):
    model = Model(six)
    assert not left_out(six)
    for x, s in list(six.states())[::4]:
        # The library's rate in still water.
        expected = still(six, x, s)
        found = TURN @ accelerate(model, s["angles"], TURN @ s["velocity"], TURN @ s["force"])
        assert np.abs(found - expected).max() < DART * max(1.0, np.abs(expected).max())


def still(case, x, s):
    from test_python import module

    plant = module(case.file("python", "seaplant_plant.py"))
    return plant.derivative(x, s["force"])[7:]
