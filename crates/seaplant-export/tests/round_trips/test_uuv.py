"""uuv_simulator's description, by the arithmetic of its plugin.

uuv_simulator needs ROS 1 and Gazebo 11. What its plugin computes of the description is written
down here: y and z turned on the way in and out, M_A and C_A full, D = -D_l - u D_lf - diag(D_q |nu|).
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

TURN = np.diag([1.0, -1, -1, 1, -1, -1])
GRAVITY = 9.80665


def cross(r):
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


class Description:
    """What the plugin and the engine read."""

    def __init__(self, case) -> None:
        (path,) = case.file("uuv-simulator").glob("*.urdf")
        root = ET.parse(path).getroot()
        inertial = root.find("link/inertial")
        self.mass = float(inertial.find("mass").get("value"))
        self.com = np.array(inertial.find("origin").get("xyz").split(), float)
        i = inertial.find("inertia").attrib
        rows = [["ixx", "ixy", "ixz"], ["ixy", "iyy", "iyz"], ["ixz", "iyz", "izz"]]
        self.inertia = np.array([[float(i[name]) for name in row] for row in rows])
        link = root.find("gazebo/plugin/link")
        model = link.find("hydrodynamic_model")
        assert model.findtext("type") == "fossen"
        self.added, self.linear, self.forward, self.quadratic = (
            np.array(model.findtext(tag).split(), float).reshape(6, 6)
            for tag in (
                "added_mass",
                "linear_damping",
                "linear_damping_forward_speed",
                "quadratic_damping",
            )
        )
        self.volume = float(link.findtext("volume"))
        self.density = float(root.findtext("gazebo/plugin/fluid_density"))
        self.buoyancy = np.array(link.findtext("center_of_buoyancy").split(), float)

    def rigid(self) -> np.ndarray:
        s = cross(self.com)
        m = np.zeros((6, 6))
        m[:3, :3] = self.mass * np.eye(3)
        m[:3, 3:] = -self.mass * s
        m[3:, :3] = self.mass * s
        m[3:, 3:] = self.inertia - self.mass * s @ s
        return m

    def damping(self, nu):
        """The plugin's D nu; off-diagonals of the quadratic matrix are read and not used."""
        d = -self.linear - nu[0] * self.forward
        d = d - np.diag(np.diag(self.quadratic) * np.abs(nu))
        return d @ nu


def test_signs(case):
    """Added mass positive, damping negative: each other simulator has it differently."""
    of = Description(case)
    known = np.flatnonzero(case.own)
    assert (np.diag(of.linear)[known] <= 0).all() and (np.diag(of.quadratic)[known] <= 0).all()
    whole = TURN @ of.rigid() @ TURN + of.added
    expected = np.array(case.reference["mass"])
    at = np.ix_(case.own, case.own)
    assert np.allclose(whole[at], expected[at], rtol=1e-12, atol=1e-9)


def test_accelerations(case, kirchhoff):
    """Of plants that the plugin can hold."""
    if case.name not in {"heavy", "rexrov"}:
        return
    from test_python import module

    plant = module(case.file("python", "seaplant_plant.py"))
    of = Description(case)
    mass = TURN @ of.rigid() @ TURN + of.added
    for x, s in case.states():
        nu = s["velocity"]
        down = plant.to_body(x[3:7], (0, 0, 1.0))
        weight, lift = of.mass * GRAVITY, of.density * of.volume * GRAVITY
        com, cob = TURN[:3, :3] @ of.com, TURN[:3, :3] @ of.buoyancy
        restoring = np.concatenate(
            [(weight - lift) * down, np.cross(com, weight * down) - np.cross(cob, lift * down)]
        )
        force = s["force"] + restoring - of.damping(nu) - kirchhoff(mass, nu)
        expected = plant.derivative(x, s["force"])[7:]
        found = np.linalg.solve(mass, force)
        assert np.abs(found - expected).max() < 1e-9 * max(1.0, np.abs(expected).max())
