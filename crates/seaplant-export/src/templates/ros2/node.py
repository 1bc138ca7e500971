"""Moves the plant and publishes where it is, by the frames of REP 103.

Subscribes `wrench` (geometry_msgs/Wrench, N and N m, body x forward, y port, z up) and, where the plant
has thrusters, `thruster_inputs` (std_msgs/Float64MultiArray, in the order of plant.THRUSTERS and in the
units of their curves). The last of each holds; before the first nothing pushes. Publishes `odom`
(nav_msgs/Odometry): pose in a world of east, north, up, twist over ground in the body.
"""

import numpy as np
import rclpy
from geometry_msgs.msg import Wrench
from nav_msgs.msg import Odometry
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray

from . import plant

LONGEST_STEP_S = 0.02
"""Steps follow roll, pitch and lags of thrusters."""

FLIPPED = np.array([1.0, -1.0, -1.0])
"""Between x forward, y starboard, z down and x forward, y port, z up."""


def turned(a, b):
    """The product of two quaternions w, x, y, z."""
    (w, x, y, z), (s, a, b, c) = a, b
    return np.array(
        [
            w * s - x * a - y * b - z * c,
            w * a + x * s + y * c - z * b,
            w * b - x * c + y * s + z * a,
            w * c + x * b - y * a + z * s,
        ]
    )


def attitude_enu(q):
    """From body (port, up) to east, north, up, of one from body (starboard, down) to NED."""
    half = np.sqrt(0.5)
    return turned(turned((0.0, half, half, 0.0), q), (0.0, 1.0, 0.0, 0.0))


class PlantNode(Node):
    """A vehicle without hull: forces come in, motion goes out."""

    def __init__(self):
        super().__init__("seaplant_plant")
        value = self.declared
        self.rate_hz = value("rate_hz", 50.0)
        self.current = np.array(value("current_ned_m_per_s", [0.0, 0.0, 0.0]))
        self.supply_v = value("supply_v", 0.0)
        self.frames = value("world_frame", "odom"), value("body_frame", "base_link")
        self.x = np.zeros(13)
        self.x[:3] = value("start_position_ned_m", [0.0, 0.0, 0.0])
        heading = value("start_heading_rad", 0.0)
        self.x[3], self.x[6] = np.cos(0.5 * heading), np.sin(0.5 * heading)
        self.wrench = np.zeros(6)
        self.inputs, self.actuators = None, None
        self.publisher = self.create_publisher(Odometry, "odom", 10)
        self.create_subscription(Wrench, "wrench", self.on_wrench, 10)
        if getattr(plant, "THRUSTERS", None):
            self.inputs = np.array(plant.NEUTRAL)
            self.actuators = plant.Actuators(self.inputs)
            self.create_subscription(
                Float64MultiArray, "thruster_inputs", self.on_inputs, 10
            )
        self.create_timer(1.0 / self.rate_hz, self.on_time)

    def declared(self, name, default):
        """A parameter's value."""
        return self.declare_parameter(name, default).value

    def on_wrench(self, message):
        """Takes a wrench to the axes of the plant."""
        force, torque = message.force, message.torque
        both = np.array([[force.x, force.y, force.z], [torque.x, torque.y, torque.z]])
        if not np.isfinite(both).all():
            self.get_logger().warning("a wrench that is not finite is left out")
            return
        self.wrench = (both * FLIPPED).ravel()

    def on_inputs(self, message):
        """Takes the inputs of all thrusters."""
        inputs = np.array(message.data, dtype=float)
        if inputs.shape != self.inputs.shape or not np.isfinite(inputs).all():
            self.get_logger().warning(
                f"{len(inputs)} thruster inputs came; {len(self.inputs)} finite ones are needed"
            )
            return
        self.inputs = inputs

    def on_time(self):
        """Moves the plant on by one period, and publishes."""
        period = 1.0 / self.rate_hz
        steps = max(1, int(np.ceil(period / LONGEST_STEP_S - 1e-9)))
        for _ in range(steps):
            tau = self.wrench
            if self.actuators is not None:
                tau = tau + self.actuators.wrench(self.inputs, period / steps, self.supply_v)
            self.x = plant.step(self.x, tau, period / steps, self.current)
        self.publisher.publish(self.odometry())

    def odometry(self):
        """The state as a message."""
        message = Odometry()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id, message.child_frame_id = self.frames
        at, pose, twist = self.x, message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y, pose.position.z = at[1], at[0], -at[2]
        q, o = pose.orientation, attitude_enu(at[3:7])
        q.w, q.x, q.y, q.z = o
        v, w = at[7:10] * FLIPPED, at[10:] * FLIPPED
        twist.linear.x, twist.linear.y, twist.linear.z = v
        twist.angular.x, twist.angular.y, twist.angular.z = w
        return message


def main():
    rclpy.init()
    node = PlantNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
