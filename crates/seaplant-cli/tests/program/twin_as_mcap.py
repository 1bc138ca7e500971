"""The logs of a twin's campaign as a ROS 2 vehicle would have recorded them.

    python3 twin_as_mcap.py CAMPAIGN_FOLDER FOLDER

Reads campaign.toml and its CSV logs; writes an MCAP file a trial, by mcap-ros2-support, and a
campaign.toml that reads those. Attitude is a quaternion by REP 103: x forward, y to port, z up, in
a world with z up, so pitch and yaw are of the other sign, as are the DVL's velocities along y and z.
"""

import csv
import math
import pathlib
import shutil
import sys

import tomllib
from mcap_ros2.writer import Writer
from rosbags.typesys import Stores, get_typestore


def columns(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    names = [name.split(" [")[0] for name in rows[0]]
    return [dict(zip(names, map(float, row))) for row in rows[1:]]


def quaternion(roll, pitch, yaw):
    """Of turns about z, y and x, each about the axes that the one before left."""
    halves = (roll / 2, pitch / 2, yaw / 2)
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, halves), map(math.sin, halves)
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }


def imu(row):
    roll, pitch, heading = (math.radians(row[k]) for k in ("roll", "pitch", "heading"))
    return {"orientation": quaternion(roll, -pitch, -heading)}


def dvl(row):
    x, y, z = (row[f"velocity {axis}"] for axis in "xyz")
    return {"twist": {"linear": {"x": x, "y": -y, "z": -z}}}


def depth(row):
    return {"point": {"x": 0.0, "y": 0.0, "z": row["depth"]}}


def thrusters(row):
    names = [name for name in row if name != "time"]
    speeds = [row[name] * math.pi / 30.0 for name in names]
    return {"name": names, "position": [], "velocity": speeds, "effort": []}


TOPICS = {
    "attitude": ("/imu/data", "sensor_msgs/msg/Imu", imu),
    "dvl": ("/dvl/twist", "geometry_msgs/msg/TwistStamped", dvl),
    "depth": ("/depth", "geometry_msgs/msg/PointStamped", depth),
    "thrusters": ("/thrusters", "sensor_msgs/msg/JointState", thrusters),
}


def write(path, logs, start_ns):
    store = get_typestore(Stores.ROS2_HUMBLE)
    messages = []
    for log in logs:
        topic, kind, fill = TOPICS[log.stem]
        for row in columns(log):
            stamp = start_ns + round(row["time"] * 1e9)
            header = {
                "stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9},
                "frame_id": "",
            }
            messages.append((stamp, topic, kind, {"header": header} | fill(row)))
    messages.sort(key=lambda message: message[0])
    with open(path, "wb") as file:
        writer = Writer(file)
        schemas = {}
        for stamp, topic, kind, message in messages:
            if kind not in schemas:
                text, _ = store.generate_msgdef(kind, ros_version=2)
                schemas[kind] = writer.register_msgdef(kind, text)
            # The network delays them, the stamp does not say so.
            writer.write_message(topic, schemas[kind], message, stamp + 40_000_000)
        writer.finish()


def channel(quantity):
    if quantity.startswith("thruster."):
        name = quantity.removeprefix("thruster.").removesuffix(".speed")
        return f'column = "/thrusters/velocity[{name}]", unit = "rad/s"'
    last = quantity.rsplit(".", 1)[-1]
    if quantity.startswith("dvl."):
        negate = "" if last == "x" else ", negate = true"
        return f'column = "/dvl/twist/twist.linear.{last}"{negate}'
    if quantity == "depth":
        return 'column = "/depth/point.z"'
    angle = {"roll": "roll", "pitch": "pitch", "heading": "yaw"}[last]
    negate = "" if angle == "roll" else ", negate = true"
    return f'column = "/imu/data/orientation.{angle}"{negate}'


def main():
    source, target = map(pathlib.Path, sys.argv[1:3])
    start_ns = int(sys.argv[3])
    campaign = tomllib.loads((source / "campaign.toml").read_text())
    lines = ['vehicle = "vehicle.toml"']
    for trial in campaign["trial"]:
        logs = [source / log for log in trial["log"]]
        name = f"{logs[0].parent.name}.mcap"
        write(target / name, logs, start_ns)
        dof = ", ".join(f'"{dof}"' for dof in trial["dof"])
        lines += ["[[trial]]", f'name = "{trial["name"]}"', f'log = "{name}"']
        lines += [f"dof = [{dof}]", f'role = "{trial["role"]}"']
    lines.append("[channels]")
    lines += [f'"{quantity}" = {{ {channel(quantity)} }}' for quantity in campaign["channels"]]
    (target / "campaign.toml").write_text("\n".join(lines) + "\n")
    shutil.copy(source / "vehicle.toml", target)


if __name__ == "__main__":
    main()
