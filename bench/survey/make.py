"""Writes logs of about so many megabytes each, from log.csv to log.parquet.

    make.py FOLDER MEGABYTES [NAME...]

A block of records is made once, by the packers that the tests trust; it is repeated with times that
go on.
"""

import pathlib
import sqlite3
import sys

import numpy
import pyarrow
import pyarrow.parquet

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "side_by_side_logs"))

from make import flash, telemetry
from mcap.writer import CompressionType
from mcap.writer import Writer as Mcap
from rosbags.rosbag1 import Writer as Bag
from rosbags.typesys import Stores, get_typestore

BLOCK = 2000
"""Ticks in a block, 20 ms apart."""
STEP_NS = 20_000_000
START_NS = 1_700_000_000_000_000_000


def table(path, megabytes, columns=12):
    """Formats floats with seventeen digits, as programs without rounding write them."""
    dice = numpy.random.default_rng(1)
    rows = 100_000
    header = "time [s]," + ",".join(f"channel {k} [m/s]" for k in range(columns)) + "\n"
    lines = [
        f"{0:012.3f}," + ",".join(repr(float(x)) for x in row) + "\n"
        for row in dice.normal(size=(rows, columns))
    ]
    starts = numpy.cumsum([0] + [len(line) for line in lines[:-1]])
    block = numpy.frombuffer("".join(lines).encode(), numpy.uint8).copy()
    places = starts[:, None] + numpy.array([0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11])
    powers = 10 ** numpy.arange(10, -1, -1)
    with open(path, "wb") as file:
        file.write(header.encode())
        for k in range(max(1, round(megabytes * 1e6 / len(block)))):
            milliseconds = (numpy.arange(rows) + k * rows) * 10
            block[places] = milliseconds[:, None] // powers % 10 + ord("0")
            file.write(block.tobytes())


def parquet(path, megabytes, columns=12):
    dice = numpy.random.default_rng(1)
    rows = 1_000_000
    names = ["time [s]", *(f"channel {k} [m/s]" for k in range(columns))]
    schema = pyarrow.schema([(name, pyarrow.float64()) for name in names])
    with pyarrow.parquet.ParquetWriter(
        path, schema, compression="zstd", use_dictionary=False
    ) as writer:
        for k in range(max(1, round(megabytes * 1e6 / (rows * 93)))):
            times = (numpy.arange(rows) + k * rows) * 0.01
            numbers = [times, *(dice.normal(size=rows) for _ in range(columns))]
            writer.write_table(pyarrow.table(numbers, schema=schema))


def messages(store, prefix):
    """Builds the messages of a block: ticks, topics, and bytes with the stamp at a known
    position."""
    dice = numpy.random.default_rng(2)
    kinds = store.types
    make = lambda name, **fields: kinds[name](**fields)
    time = make("builtin_interfaces/msg/Time", sec=0x11223344, nanosec=0x55667788)
    extra = {"seq": 0} if prefix == "ros1" else {}
    header = lambda frame: make("std_msgs/msg/Header", stamp=time, frame_id=frame, **extra)
    xyz = lambda: make("geometry_msgs/msg/Vector3", **dict(zip("xyz", dice.normal(size=3))))
    point = lambda: make("geometry_msgs/msg/Point", **dict(zip("xyz", dice.normal(size=3))))
    turn = lambda: make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.6, w=0.8)
    packed = store.serialize_ros1 if prefix == "ros1" else store.serialize_cdr
    for tick in range(BLOCK):
        for j in range(2):
            imu = make(
                "sensor_msgs/msg/Imu",
                header=header("imu_link"),
                orientation=turn(),
                orientation_covariance=dice.normal(size=9),
                angular_velocity=xyz(),
                angular_velocity_covariance=dice.normal(size=9),
                linear_acceleration=xyz(),
                linear_acceleration_covariance=dice.normal(size=9),
            )
            yield tick * STEP_NS + j * STEP_NS // 2, "/imu", bytes(packed(imu, imu.__msgtype__))
        pose = make("geometry_msgs/msg/Pose", position=point(), orientation=turn())
        twist = make("geometry_msgs/msg/Twist", linear=xyz(), angular=xyz())
        odometry = make(
            "nav_msgs/msg/Odometry",
            header=header("odom"),
            child_frame_id="base_link",
            pose=make(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=pose,
                covariance=dice.normal(size=36),
            ),
            twist=make(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=twist,
                covariance=dice.normal(size=36),
            ),
        )
        yield tick * STEP_NS, "/odometry", bytes(packed(odometry, odometry.__msgtype__))
        if tick % 500 == 0:
            pressure = make(
                "sensor_msgs/msg/FluidPressure",
                header=header("depth"),
                fluid_pressure=1e5 + tick,
                variance=0.0,
            )
            yield tick * STEP_NS, "/pressure", bytes(packed(pressure, pressure.__msgtype__))


TYPES = {
    "/imu": "sensor_msgs/msg/Imu",
    "/odometry": "nav_msgs/msg/Odometry",
    "/pressure": "sensor_msgs/msg/FluidPressure",
}


def stamped(block, megabytes):
    """Repeats the block: time of receipt, topic, bytes."""
    size = sum(len(content) for _, _, content in block)
    marks = (0x11223344).to_bytes(4, "little")
    block = [
        (at, topic, bytearray(content), content.index(marks)) for at, topic, content in block
    ]
    for k in range(max(1, round(megabytes * 1e6 / size))):
        for at, topic, content, place in block:
            stamp = START_NS + k * BLOCK * STEP_NS + at
            content[place : place + 4] = (stamp // 10**9).to_bytes(4, "little")
            content[place + 4 : place + 8] = (stamp % 10**9).to_bytes(4, "little")
            yield stamp + 1_000_000, topic, bytes(content)


def mcap(path, megabytes):
    store = get_typestore(Stores.ROS2_HUMBLE)
    with open(path, "wb") as file:
        # As rosbag2 writes it unless told otherwise: chunks, not packed.
        writer = Mcap(file, chunk_size=768 * 1024, compression=CompressionType.NONE)
        writer.start("ros2", "")
        channels = {}
        for topic, kind in TYPES.items():
            text, _ = store.generate_msgdef(kind, ros_version=2)
            schema = writer.register_schema(kind, "ros2msg", text.encode())
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        for receipt, topic, content in stamped(list(messages(store, "ros2")), megabytes):
            writer.add_message(channels[topic], receipt, content, receipt)
        writer.finish()


def db3(path, megabytes):
    store = get_typestore(Stores.ROS2_HUMBLE)
    path.unlink(missing_ok=True)
    database = sqlite3.connect(path)
    database.executescript(
        "PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF;"
        "CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,"
        "serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,"
        "timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
    )
    numbers = {topic: k + 1 for k, topic in enumerate(TYPES)}
    for topic, kind in TYPES.items():
        row = (numbers[topic], topic, kind, "cdr", "")
        database.execute("INSERT INTO topics VALUES(?,?,?,?,?)", row)
    rows = (
        (numbers[topic], receipt, content)
        for receipt, topic, content in stamped(list(messages(store, "ros2")), megabytes)
    )
    database.executemany("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", rows)
    database.commit()
    database.close()


def bag(path, megabytes):
    store = get_typestore(Stores.ROS1_NOETIC)
    path.unlink(missing_ok=True)
    with Bag(path) as writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=store)
            for topic, kind in TYPES.items()
        }
        for receipt, topic, content in stamped(list(messages(store, "ros1")), megabytes):
            writer.write(connections[topic], receipt, content)


WRITERS = {
    "log.csv": table,
    "log.BIN": flash,
    "log.tlog": telemetry,
    "log.mcap": mcap,
    "log.db3": db3,
    "log.bag": bag,
    "log.parquet": parquet,
}


def main():
    folder, megabytes = pathlib.Path(sys.argv[1]), float(sys.argv[2])
    for name in sys.argv[3:] or WRITERS:
        WRITERS[name](folder / name, megabytes)


if __name__ == "__main__":
    main()
