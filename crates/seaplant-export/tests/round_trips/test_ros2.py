"""The ROS 2 package, built by setuptools; its node with stand-ins for ROS."""

from __future__ import annotations

import importlib
import subprocess
import sys
import types
import xml.etree.ElementTree as ET
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

MODULES = [
    "rclpy",
    "rclpy.node",
    "geometry_msgs",
    "geometry_msgs.msg",
    "nav_msgs",
    "nav_msgs.msg",
    "std_msgs",
    "std_msgs.msg",
]


class Message(SimpleNamespace):
    """A message that has every field that is asked for."""

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        value = Message()
        setattr(self, name, value)
        return value


class Node:
    """What a node offers, kept for the test to call."""

    parameters: ClassVar[dict] = {}

    def __init__(self, name):
        self.name, self.heard, self.sent, self.timer = name, {}, [], None

    def declare_parameter(self, name, default):
        return SimpleNamespace(value=self.parameters.get(name, default))

    def create_publisher(self, kind, topic, depth):
        return SimpleNamespace(publish=self.sent.append)

    def create_subscription(self, kind, topic, callback, depth):
        self.heard[topic] = callback

    def create_timer(self, period, callback):
        self.timer = (period, callback)

    def get_clock(self):
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: "now"))

    def get_logger(self):
        return SimpleNamespace(warning=self.sent.append)


@pytest.fixture
def package(case, monkeypatch):
    """The package as it is imported, with stand-ins for ROS."""
    for name in MODULES:
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    sys.modules["rclpy.node"].Node = Node
    sys.modules["geometry_msgs.msg"].Wrench = Message
    sys.modules["nav_msgs.msg"].Odometry = Message
    sys.modules["std_msgs.msg"].Float64MultiArray = Message
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(case.file("ros2", "seaplant_plant")))
    for name in [n for n in sys.modules if n.split(".")[0] == "seaplant_plant"]:
        monkeypatch.delitem(sys.modules, name)
    yield importlib.import_module("seaplant_plant.node")
    for name in [n for n in sys.modules if n.split(".")[0] == "seaplant_plant"]:
        del sys.modules[name]


def vector(x, y, z):
    return SimpleNamespace(x=x, y=y, z=z)


def test_the_node_moves_as_the_plant_and_speaks_rep_103(case, package):
    """The same wrench, turned by hand, moves the plant's own module alike."""
    start = {"start_heading_rad": 0.3, "start_position_ned_m": [1.0, 2.0, 3.0]}
    Node.parameters = start
    node = package.PlantNode()
    plant = package.plant
    tau = np.array([30.0, 8.0, -5.0, 0.4, 0.3, 2.0])
    force, moment = vector(30.0, -8.0, 5.0), vector(0.4, -0.3, -2.0)
    node.heard["wrench"](SimpleNamespace(force=force, torque=moment))
    x = np.zeros(13)
    x[:3], x[3], x[6] = start["start_position_ned_m"], np.cos(0.15), np.sin(0.15)
    for _ in range(100):
        node.timer[1]()
        x = plant.step(x, tau, node.timer[0])
    found = node.sent[-1]
    at, v, w = found.pose.pose.position, found.twist.twist.linear, found.twist.twist.angular
    assert np.allclose([at.x, at.y, at.z], [x[1], x[0], -x[2]], atol=1e-9)
    assert np.allclose([v.x, v.y, v.z], [x[7], -x[8], -x[9]], atol=1e-9)
    assert np.allclose([w.x, w.y, w.z], [x[10], -x[11], -x[12]], atol=1e-9)
    q = found.pose.pose.orientation
    turned = rotation(q.w, q.x, q.y, q.z)
    # Columns of the matrix: where the body's axes point, east, north and up.
    to_enu = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    expected = to_enu @ rotation(*x[3:7]) @ np.diag([1, -1, -1])
    assert np.allclose(turned, expected, atol=1e-9)
    assert (found.header.frame_id, found.child_frame_id) == ("odom", "base_link")


def rotation(w, x, y, z):
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_thruster_inputs_move_the_plant_and_wrong_ones_are_left_out(case, package):
    Node.parameters = {"supply_v": 15.0}
    node = package.PlantNode()
    if node.actuators is None:
        assert "thruster_inputs" not in node.heard
        return
    node.timer[1]()
    count = len(package.plant.THRUSTERS)
    node.heard["thruster_inputs"](SimpleNamespace(data=[1.0] * (count + 1)))
    assert "are needed" in node.sent[-1]
    before = node.x.copy()
    node.heard["thruster_inputs"](SimpleNamespace(data=case.reference["thrust"]["inputs"][0]))
    for _ in range(50):
        node.timer[1]()
    assert np.abs(node.x[7:] - before[7:]).max() > 1e-4


def test_the_package_builds(case, tmp_path):
    """As colcon does for ament_python: setup.py, here into a wheel."""
    if case.name != "heavy":
        return
    folder = case.file("ros2", "seaplant_plant")
    root = ET.parse(folder / "package.xml").getroot()
    assert root.find("name").text == "seaplant_plant"
    assert root.find("export/build_type").text == "ament_python"
    build = ["build", "--build-base", tmp_path / "build"]
    install = ["install", "--root", tmp_path / "root"]
    command = [sys.executable, "setup.py", *build, *install]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=300)
    installed = {path.name for path in (tmp_path / "root").rglob("*") if path.is_file()}
    assert {"package.xml", "seaplant_plant.yaml", "plant.launch.py", "node.py"} <= installed
    assert any(
        path.parts[-2:] == ("seaplant_plant", "plant")
        for path in (tmp_path / "root").rglob("plant")
    )
