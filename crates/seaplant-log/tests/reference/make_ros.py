"""Writes bags of ROS 1 and ROS 2 with mcap-ros2-support, rosbags, mcap and sqlite3.

    python3 make_ros.py FOLDER

Messages are filled at random after the types that rosbags knows or parses; what a reader must find
in them follows from those types, by the rules of docs/src/files.md.
"""

import math
import pathlib
import random
import shutil
import sqlite3
import sys
from types import SimpleNamespace

import numpy
from expected import Expected
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.interfaces import Nodetype
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.spatial.transform import Rotation

START = 1_600_000_000_000_000_000
MOST = 32

INNER = """
bool flag
int16 count
Leaf[2] pair
Leaf leaf
string label
"""
LEAF = """
uint8 tag
float64 value
float32[2] both
"""
COMMON = """
uint8 KIND_A=1
string TEXT=not a # comment
std_msgs/Header header
bool truth
uint8 u8
float64 after_u8
int8 i8
uint16 u16
int16 i16
uint32 u32
int32 i32
uint64 u64
int64 i64
float32 f32
string text
float64 f64
bool[3] truths
int16[5] shorts
float64[3] position_of
float64[40] far_too_long
uint8 before
float64[9] some_covariance
string[2] two_texts
uint8[] bytes_of
int32[] ints
float64[] doubles
float64[] always_empty
float64[] now_and_then
float32[] varying
uint8[] blob
float64[] thousand
string[] words
uint8 odd
Inner inner
Inner[2] inners
Leaf[] leaves
Inner[] nested
Inner[] many
"""
ROS1_ONLY = "time when\nduration lasting\nfloat64 last\n"
ROS2_ONLY = """
byte octet
char letter 65
builtin_interfaces/Time when
builtin_interfaces/Duration lasting
float64[<=4] bounded
string<=10 short_text
sample_msgs/Nothing nothing
float64 last
"""

# Of the marine_msgs repository of UW-APL, as far as a reader needs it.
DVL = """
std_msgs/Header header
uint8 velocity_mode
uint8 dvl_type
geometry_msgs/Vector3 velocity
float64[9] velocity_covar
float64 altitude
float64 course_gnd
float64 speed_gnd
uint8 num_good_beams
float32 sound_speed
bool beam_ranges_valid
bool beam_velocities_valid
geometry_msgs/Vector3[4] beam_unit_vec
float64[4] range
float32[4] range_covar
float32[4] beam_quality
float32[4] beam_velocity
float32[4] beam_velocity_covar
"""

UNITS = {
    ("marine_acoustic_msgs/msg/Dvl", "velocity"): "m/s",
    ("marine_acoustic_msgs/msg/Dvl", "altitude"): "m",
    ("marine_acoustic_msgs/msg/Dvl", "course_gnd"): "rad",
    ("marine_acoustic_msgs/msg/Dvl", "speed_gnd"): "m/s",
    ("marine_acoustic_msgs/msg/Dvl", "sound_speed"): "m/s",
    ("marine_acoustic_msgs/msg/Dvl", "range"): "m",
    ("marine_acoustic_msgs/msg/Dvl", "beam_velocity"): "m/s",
    ("geometry_msgs/msg/Twist", "linear"): "m/s",
    ("geometry_msgs/msg/Twist", "angular"): "rad/s",
    ("geometry_msgs/msg/Accel", "linear"): "m/s2",
    ("geometry_msgs/msg/Accel", "angular"): "rad/s2",
    ("geometry_msgs/msg/Wrench", "force"): "N",
    ("geometry_msgs/msg/Wrench", "torque"): "N m",
    ("geometry_msgs/msg/Pose", "position"): "m",
    ("geometry_msgs/msg/PointStamped", "point"): "m",
    ("geometry_msgs/msg/Transform", "translation"): "m",
    ("geometry_msgs/msg/Quaternion", "x"): "1",
    ("geometry_msgs/msg/Quaternion", "y"): "1",
    ("geometry_msgs/msg/Quaternion", "z"): "1",
    ("geometry_msgs/msg/Quaternion", "w"): "1",
    ("geometry_msgs/msg/Pose2D", "x"): "m",
    ("geometry_msgs/msg/Pose2D", "y"): "m",
    ("geometry_msgs/msg/Pose2D", "theta"): "rad",
    ("sensor_msgs/msg/Imu", "angular_velocity"): "rad/s",
    ("sensor_msgs/msg/Imu", "linear_acceleration"): "m/s2",
    ("sensor_msgs/msg/FluidPressure", "fluid_pressure"): "Pa",
    ("sensor_msgs/msg/Range", "field_of_view"): "rad",
    ("sensor_msgs/msg/Range", "min_range"): "m",
    ("sensor_msgs/msg/Range", "max_range"): "m",
    ("sensor_msgs/msg/Range", "range"): "m",
    ("sensor_msgs/msg/NavSatFix", "latitude"): "deg",
    ("sensor_msgs/msg/NavSatFix", "longitude"): "deg",
    ("sensor_msgs/msg/NavSatFix", "altitude"): "m",
    ("sensor_msgs/msg/BatteryState", "voltage"): "V",
    ("sensor_msgs/msg/BatteryState", "cell_voltage"): "V",
    ("sensor_msgs/msg/BatteryState", "current"): "A",
    ("mavros_msgs/msg/RCOut", "channels"): "us",
}

# The types that a bag of ROS 2 may leave undefined, as far as rosbags has them too.
BUNDLED = """
std_msgs: Header String Bool Byte Char Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Float32
Float64 ColorRGBA MultiArrayDimension MultiArrayLayout ByteMultiArray Int8MultiArray
UInt8MultiArray Int16MultiArray UInt16MultiArray Int32MultiArray UInt32MultiArray Int64MultiArray
UInt64MultiArray Float32MultiArray Float64MultiArray
geometry_msgs: Vector3 Vector3Stamped Point Point32 PointStamped Quaternion QuaternionStamped Pose
Pose2D PoseStamped PoseArray PoseWithCovariance PoseWithCovarianceStamped Twist TwistStamped
TwistWithCovariance TwistWithCovarianceStamped Accel AccelStamped AccelWithCovariance
AccelWithCovarianceStamped Wrench WrenchStamped Transform TransformStamped Polygon PolygonStamped
nav_msgs: Odometry Path
sensor_msgs: Imu MagneticField FluidPressure Temperature RelativeHumidity Illuminance Range
JointState Joy NavSatStatus NavSatFix TimeReference BatteryState Image CompressedImage
RegionOfInterest CameraInfo LaserScan PointField PointCloud2
"""

FIXED_LENGTHS = {
    "bytes_of": 3,
    "ints": 2,
    "doubles": 4,
    "always_empty": 0,
    "blob": 5000,
    "thousand": 1000,
    "leaves": 3,
    "nested": 2,
    "many": 40,
    "bounded": 4,
}


def bundled():
    package = None
    for word in BUNDLED.split():
        if word.endswith(":"):
            package = word[:-1]
        else:
            yield f"{package}/msg/{word}"


class Types:
    """Fills messages of a typestore, and returns their content."""

    def __init__(self, store, dice, ros1=False):
        self.store, self.dice, self.ros1 = store, dice, ros1

    def number(self, kind):
        dice = self.dice
        if kind == "bool":
            return dice.random() < 0.5
        if kind in ("byte", "octet"):
            # Writers of ROS 2 disagree whether a byte has a sign.
            return dice.randrange(-128 if self.ros1 else 0, 128)
        if kind == "char":
            return dice.randrange(128)
        if kind.startswith("float"):
            value = dice.gauss(0, 100)
            return float(numpy.float32(value)) if kind == "float32" else value
        bits = int(kind.lstrip("uint"))
        low = 0 if kind[0] == "u" else -(2 ** (bits - 1))
        return dice.randrange(low, low + 2**bits)

    def elements(self, desc, count):
        if desc[0] == Nodetype.NAME:
            return [self.message(desc[1]) for _ in range(count)]
        kind = desc[1][0]
        if kind == "string":
            return [
                "".join(self.dice.choices("abcdé", k=self.dice.randrange(9)))
                for _ in range(count)
            ]
        dtype = {"byte": "int8" if self.ros1 else "uint8", "octet": "uint8", "char": "uint8"}
        return numpy.array([self.number(kind) for _ in range(count)], dtype.get(kind, kind))

    def field(self, name, desc):
        if desc[0] in (Nodetype.NAME, Nodetype.BASE):
            value = self.elements(desc, 1)[0]
            return value.item() if isinstance(value, numpy.generic) else value
        if desc[0] == Nodetype.ARRAY:
            return self.elements(*desc[1])
        count = FIXED_LENGTHS.get(name, self.dice.randrange(6))
        if name == "now_and_then":
            count = self.dice.choice([0, 2])
        return self.elements(desc[1][0], count)

    def message(self, name):
        cls = self.store.types[name]
        if name == "builtin_interfaces/msg/Time":
            return cls(sec=self.dice.randrange(2**31), nanosec=self.dice.randrange(10**9))
        if name == "builtin_interfaces/msg/Duration":
            return cls(sec=self.dice.randrange(-99, 99), nanosec=self.dice.randrange(10**9))
        fields = self.store.get_msgdef(name).fields
        return cls(**{field: self.field(field, desc) for field, desc in fields})

    def plain(self, value):
        """Returns a message in the form that mcap-ros2-support takes."""
        if isinstance(value, numpy.ndarray):
            return value.tolist()
        if isinstance(value, list):
            return [self.plain(item) for item in value]
        if hasattr(value, "__msgtype__"):
            fields = self.store.get_msgdef(value.__msgtype__).fields
            return SimpleNamespace(**{f: self.plain(getattr(value, f)) for f, _ in fields})
        return value

    def leaves(self, message, path="", unit=None, within=False):
        """Returns every number of a message: path, unit, value; lists give (path, None, length)
        in addition."""
        name = message.__msgtype__
        dot = "." if path else ""
        if name in ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"):
            yield path, "s", message.sec + 1e-9 * message.nanosec
            return
        for field, desc in self.store.get_msgdef(name).fields:
            value, here = getattr(message, field), f"{path}{dot}{field}"
            unit_here = UNITS.get((name, field), unit)
            if here == "header.stamp" or field == "structure_needs_at_least_one_member":
                continue
            kind, elements = desc[0], value
            if kind in (Nodetype.NAME, Nodetype.BASE):
                elements = None
            elif (
                field.endswith(("covariance", "_covar"))
                or (kind == Nodetype.SEQUENCE and within)
                or (kind == Nodetype.ARRAY and desc[1][1] > MOST)
            ):
                continue
            if elements is None:
                yield from self.leaf(value, desc, here, unit_here, within)
                continue
            inner = desc[1][0]
            if kind == Nodetype.SEQUENCE:
                if inner == (Nodetype.BASE, ("string", 0)) or inner[1][0] == "string":
                    continue
                yield here, "length", len(value)
            for k, item in enumerate(elements[:MOST]):
                is_list = within or kind == Nodetype.SEQUENCE
                yield from self.leaf(item, inner, f"{here}[{k}]", unit_here, is_list)
        if name == "geometry_msgs/msg/Quaternion" and not within:
            for angle, value in zip(("roll", "pitch", "yaw"), angles(message)):
                yield f"{path}{dot}{angle}", "rad", value

    def leaf(self, value, desc, path, unit, within):
        if desc[0] == Nodetype.NAME:
            yield from self.leaves(value, path, unit, within)
        elif desc[1][0] != "string":
            yield path, unit, float(value)


def angles(q):
    """Computes roll, pitch and yaw by the textbook formula, as SciPy does."""
    square = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    sine = 2.0 * (q.w * q.y - q.z * q.x) / square
    roll = math.atan2(
        2.0 * (q.w * q.x + q.y * q.z), q.w * q.w - q.x * q.x - q.y * q.y + q.z * q.z
    )
    yaw = math.atan2(
        2.0 * (q.w * q.z + q.x * q.y), q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z
    )
    found = [roll, math.asin(sine), yaw]
    scipy = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_euler("ZYX")[::-1]
    assert numpy.allclose(found, scipy, rtol=0, atol=1e-6), (found, scipy)
    return found


class Topics:
    """Returns messages by topic, and the expected channels."""

    def __init__(self, types):
        self.types, self.messages = types, []

    def add(self, topic, name, count, make=None, period=10_000_000):
        for k in range(count):
            message = make(k) if make else self.types.message(name)
            receipt = START + period * k + self.types.dice.randrange(period)
            fields = [f for f, _ in self.types.store.get_msgdef(name).fields]
            if fields[:1] == ["header"]:
                stamp = receipt - self.types.dice.randrange(1_000_000)
                message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
            self.messages.append((receipt, topic, name, message))
        self.messages.sort(key=lambda entry: entry[0])

    def expect(self, expected, file, upto=None, receive=False, names=None):
        topics = {}
        for receipt, topic, _, message in self.messages[:upto]:
            topics.setdefault(topic, []).append((receipt, message))
        for topic, messages in topics.items():
            self.expect_topic(expected, file, topic, messages, receive, names or {})

    def expect_topic(self, expected, file, topic, messages, receive, names):
        times, columns, lengths = [], {}, {}
        for row, (receipt, message) in enumerate(messages):
            header = getattr(message, "header", None)
            if header is not None:
                stamp = header.stamp.sec + 1e-9 * header.stamp.nanosec
            if header is not None and not receive:
                times.append(stamp)
            else:
                times.append(receipt // 10**9 + 1e-9 * (receipt % 10**9))
            if header is not None and receive:
                columns.setdefault("header.stamp", ("s", {}))[1][row] = stamp
            for path, unit, value in self.types.leaves(message):
                if unit == "length":
                    lengths.setdefault(path, set()).add(value)
                else:
                    columns.setdefault(path, (unit, {}))[1][row] = value
        usable = {
            p for p, found in lengths.items() if len(found - {0}) == 1 and max(found) <= MOST
        }
        unusable = set(lengths) - usable
        for path, (unit, values) in columns.items():
            if any(path.startswith(f"{prefix}[") for prefix in unusable):
                continue
            for prefix, words in names.items():
                for k, word in enumerate(words):
                    if topic.lower().endswith(("/joints", "/jointstate")):
                        path = path.replace(f"{prefix}[{k}]", f"{prefix}[{word}]")
            filled = [values.get(row) for row in range(len(times))]
            expected.channel(file, f"{topic}/{path}", times, filled, unit=unit)


def write_mcap_ros2(path, topics, **options):
    with open(path, "wb") as file:
        writer = Ros2Writer(file, **options)
        schemas = {}
        for receipt, topic, name, message in topics.messages:
            if name not in schemas:
                text, _ = topics.types.store.generate_msgdef(name, ros_version=2)
                schemas[name] = writer.register_msgdef(name, text)
            message = topics.types.plain(message)
            writer.write_message(topic, schemas[name], message, receipt, receipt)
        writer.finish()


def write_mcap_raw(path, topics, encode, profile, schema_encoding, message_encoding, **options):
    """Writes as mcap's own writer does, from bytes that rosbags makes."""
    with open(path, "wb") as file:
        writer = McapWriter(file, **options)
        writer.start(profile=profile, library="test")
        version = 1 if schema_encoding == "ros1msg" else 2
        channels = {}
        for receipt, topic, name, message in topics.messages:
            if topic not in channels:
                text, _ = topics.types.store.generate_msgdef(name, ros_version=version)
                schema = writer.register_schema(name, schema_encoding, text.encode())
                channels[topic] = writer.register_channel(topic, message_encoding, schema)
            writer.add_message(channels[topic], receipt, bytes(encode(message, name)), receipt)
        writer.finish()


def write_bag2(folder, name, topics, version, plugin=StoragePlugin.SQLITE3, packed=False):
    bag = folder / f"{name}-bag"
    shutil.rmtree(bag, ignore_errors=True)
    writer = Bag2Writer(bag, version=version, storage_plugin=plugin)
    if packed:
        writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    store = topics.types.store
    with writer:
        connections = {}
        for receipt, topic, kind, message in topics.messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], receipt, store.serialize_cdr(message, kind))
    ending = "mcap" if plugin == StoragePlugin.MCAP else "db3"
    [written] = bag.glob(f"*.{ending}")
    written.rename(folder / f"{name}.{ending}")


def write_old_db3(path, topics, foreign=()):
    """Writes as ROS 2 Foxy does: no definitions, a table of fewer columns."""
    path.unlink(missing_ok=True)
    base = sqlite3.connect(path)
    base.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,"
        "serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,"
        "timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
    )
    ids = {}
    for receipt, topic, kind, message in topics.messages:
        if topic not in ids:
            ids[topic] = len(ids) + 1
            base.execute("INSERT INTO topics VALUES(?,?,?,'cdr','')", (ids[topic], topic, kind))
        data = bytes(topics.types.store.serialize_cdr(message, kind))
        row = (None, ids[topic], receipt, data)
        base.execute("INSERT INTO messages VALUES(?,?,?,?)", row)
    for topic, kind in foreign:
        base.execute("INSERT INTO topics VALUES(?,?,?,'cdr','')", (len(ids) + 9, topic, kind))
    base.commit()
    base.close()


def write_bag1(path, topics, packing=None):
    path.unlink(missing_ok=True)
    writer = Bag1Writer(path)
    if packing:
        writer.set_compression(packing)
    store = topics.types.store
    with writer:
        connections = {}
        for receipt, topic, kind, message in topics.messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], receipt, store.serialize_ros1(message, kind))


def typestore(base, extra):
    store = get_typestore(base)
    types = get_types_from_msg(INNER, "sample_msgs/msg/Inner")
    types |= get_types_from_msg(LEAF, "sample_msgs/msg/Leaf")
    types |= get_types_from_msg(COMMON + extra, "sample_msgs/msg/Everything")
    types |= get_types_from_msg("", "sample_msgs/msg/Nothing")
    if base != Stores.ROS1_NOETIC:
        rc = "std_msgs/Header header\nuint16[] channels\n"
        types |= get_types_from_msg(rc, "mavros_msgs/msg/RCOut")
        types |= get_types_from_msg(DVL, "marine_acoustic_msgs/msg/Dvl")
    store.register(types)
    return store


def joints(types, k):
    """Writes joints with names, at first without velocity."""
    message = types.message("sensor_msgs/msg/JointState")
    message.name = ["port", "starboard", "vertical"]
    message.position = numpy.array([0.1 * k, 0.2 * k, -0.3 * k])
    message.velocity = numpy.array([k, 2 * k, 3 * k] if k > 3 else [], "float64")
    message.effort = numpy.array([], "float64")
    return message


def rc_out(types, k):
    message = types.message("mavros_msgs/msg/RCOut")
    message.channels = numpy.array([1500 + k, 1500 - k, 1100, 1900, 0, 65535, 1, 2], "uint16")
    return message


def ros2(folder, expected, dice):
    types = Types(typestore(Stores.ROS2_HUMBLE, ROS2_ONLY), dice)
    names = {k: ["port", "starboard", "vertical"] for k in ("position", "velocity", "effort")}

    def some(count):
        topics = Topics(types)
        topics.add("/everything", "sample_msgs/msg/Everything", count)
        topics.add("/imu/data", "sensor_msgs/msg/Imu", 4 * count)
        topics.add("/odometry", "nav_msgs/msg/Odometry", count)
        topics.add("/cmd_vel", "geometry_msgs/msg/Twist", count)
        topics.add("/joints", "sensor_msgs/msg/JointState", count, lambda k: joints(types, k))
        topics.add("/rc/out", "mavros_msgs/msg/RCOut", count, lambda k: rc_out(types, k))
        topics.add("/state", "std_msgs/msg/String", 5)
        return topics

    topics = some(60)
    for name, packing in [
        ("zstd", CompressionType.ZSTD),
        ("lz4", CompressionType.LZ4),
        ("plain", CompressionType.NONE),
    ]:
        write_mcap_ros2(
            folder / f"{name}.mcap", topics, chunk_size=100_000, compression=packing
        )
        topics.expect(expected, f"{name}.mcap", names=names)
    topics.expect(expected, "zstd.mcap/receive", receive=True, names=names)
    store = types.store
    unchunked = {"use_chunking": False, "compression": CompressionType.NONE}
    little = lambda m, n: store.serialize_cdr(m, n)
    big = lambda m, n: store.serialize_cdr(m, n, little_endian=False)
    write_mcap_raw(
        folder / "unchunked.mcap", topics, little, "ros2", "ros2msg", "cdr", **unchunked
    )
    topics.expect(expected, "unchunked.mcap", names=names)
    write_mcap_raw(folder / "big.mcap", topics, big, "ros2", "ros2msg", "cdr")
    topics.expect(expected, "big.mcap", names=names)
    write_bag2(folder, "rosbags", topics, 9, StoragePlugin.MCAP)
    topics.expect(expected, "rosbags.mcap", names=names)

    write_bag2(folder, "iron", topics, 9)
    topics.expect(expected, "iron.db3", names=names)
    write_bag2(folder, "packed", topics, 8, packed=True)
    topics.expect(expected, "packed.db3", names=names)

    # Every common type, undefined in the bag.
    common = Topics(types)
    for kind in bundled():
        topic = "/" + kind.replace("/msg/", "/")
        make = (lambda k: joints(types, k)) if kind.endswith("/JointState") else None
        common.add(topic, kind, 6, make)
    common.add("/mavros/rc/out", "mavros_msgs/msg/RCOut", 6, lambda k: rc_out(types, k))
    common.add("/dvl", "marine_acoustic_msgs/msg/Dvl", 6)
    write_old_db3(folder / "foxy.db3", common, [("/sonar", "my_msgs/msg/Sonar")])
    common.expect(expected, "foxy.db3", names=names)

    seed = Topics(types)
    seed.add("/everything", "sample_msgs/msg/Leaf", 5)
    seed.add("/imu/data", "sensor_msgs/msg/Imu", 6)
    seed.add("/joints", "sensor_msgs/msg/JointState", 6, lambda k: joints(types, k))
    write_mcap_ros2(folder / "seed-zstd.mcap", seed, chunk_size=1000)
    write_mcap_ros2(
        folder / "seed-plain.mcap",
        seed,
        chunk_size=1000,
        compression=CompressionType.NONE,
        enable_crcs=False,
    )
    write_mcap_raw(
        folder / "seed-flat.mcap", seed, little, "ros2", "ros2msg", "cdr", **unchunked
    )
    write_bag2(folder, "seed", seed, 9)


def ros1(folder, expected, dice):
    types = Types(typestore(Stores.ROS1_NOETIC, ROS1_ONLY), dice, ros1=True)
    topics = Topics(types)
    topics.add("/everything", "sample_msgs/msg/Everything", 60)
    topics.add("/imu/data", "sensor_msgs/msg/Imu", 200)
    topics.add("/cmd_vel", "geometry_msgs/msg/Twist", 60)
    topics.add("/state", "std_msgs/msg/String", 5)
    topics.add("/go", "std_msgs/msg/Empty", 5)
    for name, packing in [
        ("plain", None),
        ("bz2", Bag1Writer.CompressionFormat.BZ2),
        ("lz4", Bag1Writer.CompressionFormat.LZ4),
    ]:
        write_bag1(folder / f"{name}.bag", topics, packing)
        topics.expect(expected, f"{name}.bag")
    encode = types.store.serialize_ros1
    write_mcap_raw(folder / "ros1.mcap", topics, encode, "ros1", "ros1msg", "ros1")
    topics.expect(expected, "ros1.mcap")

    seed = Topics(types)
    seed.add("/leaf", "sample_msgs/msg/Leaf", 5)
    seed.add("/imu/data", "sensor_msgs/msg/Imu", 5)
    seed.add("/joints", "sensor_msgs/msg/JointState", 6, lambda k: joints(types, k))
    for name, packing in [("seed-plain", None), ("seed-lz4", Bag1Writer.CompressionFormat.LZ4)]:
        write_bag1(folder / f"{name}.bag", seed, packing)


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)
    dice = random.Random(7)
    ros2(folder, expected, dice)
    ros1(folder, expected, dice)
    expected.save()


if __name__ == "__main__":
    main()
