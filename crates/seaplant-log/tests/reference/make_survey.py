"""Writes logs long enough to be surveyed: the same steady recordings in every format.

python3 make_survey.py FOLDER
"""

import math
import pathlib
import random
import sqlite3
import sys

import dataflash
import pyarrow
import pyarrow.parquet
from expected import Expected
from make_tlog import Writer as Telemetry
from mcap.writer import CompressionType
from mcap.writer import Writer as Mcap
from pymavlink.dialects.v20 import ardupilotmega as dialect
from rosbags.rosbag1 import Writer as Bag
from rosbags.typesys import Stores, get_typestore

TICKS = 6000
STEP_NS = 20_000_000
START_NS = 1_700_000_000_000_000_000


def table(path):
    dice = random.Random(1)
    rows = [f"{0.01 * k:.2f},{dice.gauss(0, 1)!r},{math.sin(0.01 * k)!r}" for k in range(TICKS)]
    path.write_text("\n".join(["time [s],u [m/s],depth [m]", *rows]) + "\n")


def parquet(path):
    dice = random.Random(1)
    columns = {
        "time [s]": [0.01 * k for k in range(2 * TICKS)],
        "u [m/s]": [dice.gauss(0, 1) for _ in range(2 * TICKS)],
        "depth [m]": [math.sin(0.01 * k) for k in range(2 * TICKS)],
    }
    table = pyarrow.table(columns)
    pyarrow.parquet.write_table(
        table, path, row_group_size=2500, data_page_size=2000, use_dictionary=False
    )


def flash(path):
    dice = random.Random(2)
    log = dataflash.Writer()
    log.define(1, "IMU", "QBfff", "TimeUS,I,GyrX,GyrY,GyrZ")
    log.define(2, "BARO", "Qff", "TimeUS,Alt,Press")
    for k in range(TICKS):
        for instance in (0, 1):
            log.record(
                1, 1_000_000 + 20_000 * k, instance, *(dice.gauss(0, 1) for _ in range(3))
            )
        if k % 4 == 0:
            log.record(2, 1_000_000 + 20_000 * k, math.sin(0.01 * k), 1e5 + k)
    path.write_bytes(log.content)


def telemetry(path):
    dice = random.Random(3)
    log = Telemetry()
    for k in range(TICKS):
        now_s = 1_700_000_000 + 0.02 * k
        angles = [dice.gauss(0, 1) for _ in range(6)]
        log.receive(now_s, dialect.MAVLink_attitude_message(5000 + 20 * k, *angles))
        if k % 4 == 0:
            pressure = dialect.MAVLink_scaled_pressure_message(5000 + 20 * k, 1000 + k, 0, 2000)
            log.receive(now_s + 0.001, pressure)
    path.write_bytes(log.content)


def messages(store, ros_1):
    """Yields time of receipt, topic, bytes: pressure often, a temperature only in the middle."""
    extra = {"seq": 0} if ros_1 else {}
    packed = store.serialize_ros1 if ros_1 else store.serialize_cdr
    make = lambda kind, **fields: store.types[kind](**fields)
    for k in range(TICKS):
        stamp = START_NS + k * STEP_NS
        time = make("builtin_interfaces/msg/Time", sec=stamp // 10**9, nanosec=stamp % 10**9)
        header = make("std_msgs/msg/Header", stamp=time, frame_id="a", **extra)
        kind = "sensor_msgs/msg/FluidPressure"
        fields = {"fluid_pressure": 1e5 + math.sin(0.01 * k), "variance": 0.0}
        yield stamp, "/pressure", bytes(packed(make(kind, header=header, **fields), kind))
        if 2000 <= k < 2300:
            kind = "sensor_msgs/msg/Temperature"
            fields = {"temperature": 8.0 + 0.001 * k, "variance": 0.0}
            yield (
                stamp,
                "/temperature",
                bytes(packed(make(kind, header=header, **fields), kind)),
            )


TYPES = {
    "/pressure": "sensor_msgs/msg/FluidPressure",
    "/temperature": "sensor_msgs/msg/Temperature",
}


def mcap(path, compression):
    store = get_typestore(Stores.ROS2_HUMBLE)
    with open(path, "wb") as file:
        writer = Mcap(file, chunk_size=8192, compression=compression)
        writer.start("ros2", "")
        channels = {}
        for topic, kind in TYPES.items():
            text, _ = store.generate_msgdef(kind, ros_version=2)
            schema = writer.register_schema(kind, "ros2msg", text.encode())
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        for receipt, topic, content in messages(store, False):
            writer.add_message(channels[topic], receipt, content, receipt)
        writer.finish()


def db3(path):
    path.unlink(missing_ok=True)
    database = sqlite3.connect(path)
    database.executescript(
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
        (number, receipt, content)
        for receipt, topic, content in messages(get_typestore(Stores.ROS2_HUMBLE), False)
        for number in ([numbers[topic], 9] if topic == "/pressure" else [numbers[topic]])
    )
    # An unknown type: its messages count, and are not read.
    database.execute("INSERT INTO topics VALUES(9,'/secret','secret_msgs/msg/Secret','cdr','')")
    database.executemany("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", rows)
    database.commit()
    database.close()


def bag(path):
    store = get_typestore(Stores.ROS1_NOETIC)
    path.unlink(missing_ok=True)
    writer = Bag(path)
    writer.chunk_threshold = 8192
    with writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=store)
            for topic, kind in TYPES.items()
        }
        for receipt, topic, content in messages(store, True):
            writer.write(connections[topic], receipt, content)


def write(folder, name, ticks):
    global TICKS
    TICKS = ticks
    table(folder / f"{name}.csv")
    parquet(folder / f"{name}.parquet")
    flash(folder / f"{name}.BIN")
    telemetry(folder / f"{name}.tlog")
    mcap(folder / f"{name}.mcap", CompressionType.NONE)
    db3(folder / f"{name}.db3")
    bag(folder / f"{name}.bag")


def main():
    folder = pathlib.Path(sys.argv[1])
    write(folder, "log", 6000)
    mcap(folder / "packed.mcap", CompressionType.ZSTD)
    # Just long enough, to be damaged.
    write(folder, "small", 300)
    Expected(folder).save()


if __name__ == "__main__":
    main()
