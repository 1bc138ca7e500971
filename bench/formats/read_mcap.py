"""Makes a large MCAP file, and reads it with mcap-ros2-support.

python read_mcap.py make FILE MEGABYTES
python read_mcap.py read FILE
"""

import math
import sys
import time

from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START = 1_700_000_000_000_000_000
RC_OUT = "std_msgs/Header header\nuint16[] channels\n"


def header(stamp, frame):
    return {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": frame}


def xyz(*values):
    return dict(zip("xyz", values))


def orientation(k):
    return {"x": 0.0, "y": 0.0, "z": math.sin(k / 999), "w": math.cos(k / 999)}


def imu(k, stamp):
    return {
        "header": header(stamp, "imu_link"),
        "orientation": orientation(k),
        "angular_velocity": xyz(math.sin(k), math.cos(k), math.sin(k / 7)),
        "linear_acceleration": xyz(math.sin(k / 3), math.cos(k / 3), 9.81),
    }


def odometry(k, stamp):
    pose = {"position": xyz(k / 99, -k / 77, math.sin(k / 9)), "orientation": orientation(k)}
    twist = {"linear": xyz(math.sin(k), 0.1, 0.0), "angular": xyz(0.0, 0.0, math.cos(k))}
    return {
        "header": header(stamp, "odom"),
        "child_frame_id": "base_link",
        "pose": {"pose": pose, "covariance": [math.sin(k + j) for j in range(36)]},
        "twist": {"twist": twist, "covariance": [math.cos(k + j) for j in range(36)]},
    }


def make(path, megabytes):
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(RC_OUT, "mavros_msgs/msg/RCOut"))
    kinds = {
        "/imu/data": ("sensor_msgs/msg/Imu", imu, 4),
        "/odometry": ("nav_msgs/msg/Odometry", odometry, 1),
        "/rc/out": (
            "mavros_msgs/msg/RCOut",
            lambda k, stamp: {
                "header": header(stamp, ""),
                "channels": [1500 + (k * j) % 400 for j in range(16)],
            },
            2,
        ),
        "/pressure": (
            "sensor_msgs/msg/FluidPressure",
            lambda k, stamp: {"header": header(stamp, "depth"), "fluid_pressure": 1e5 + k},
            1,
        ),
        "/cmd_vel": (
            "geometry_msgs/msg/Twist",
            lambda k, stamp: {
                "linear": xyz(math.sin(k), 0.0, 0.0),
                "angular": xyz(0.0, 0.0, 0.1),
            },
            1,
        ),
    }
    with open(path, "wb") as file:
        writer = Writer(file)
        schemas = {}
        for kind, _, _ in kinds.values():
            text, _ = store.generate_msgdef(kind, ros_version=2)
            schemas[kind] = writer.register_msgdef(kind, text)
        tick = 0
        # mcap packs chunks of a mebibyte; the size of the file shows what was written.
        while file.tell() < megabytes * 1_000_000:
            for topic, (kind, fill, often) in kinds.items():
                for j in range(often):
                    stamp = START + 20_000_000 * tick + 5_000_000 * j
                    message = fill(often * tick + j, stamp)
                    writer.write_message(topic, schemas[kind], message, stamp + 1_000_000)
            tick += 1
        writer.finish()


def read(path):
    """Decodes every message and keeps nothing: less than a log needs."""
    start = time.perf_counter()
    count, total = 0, 0.0
    for message in read_ros2_messages(path):
        count += 1
        decoded = message.ros_msg
        if message.channel.topic == "/imu/data":
            total += decoded.angular_velocity.z
    print(f"read_s {time.perf_counter() - start}")
    print(f"messages {count}")
    print(f"sum {total}")


if __name__ == "__main__":
    if sys.argv[1] == "make":
        make(sys.argv[2], float(sys.argv[3]))
    else:
        read(sys.argv[2])
