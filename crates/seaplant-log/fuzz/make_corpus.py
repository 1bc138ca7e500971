"""Writes the intact files of the corpus, small ones for each reader, with other software.

    python3 make_corpus.py FOLDER

Writes to FOLDER/READER. What the fuzzer found from these on stands beside them, named by
`scripts/fuzz keep` after its content, and what a reader once failed on, named after what it was.
"""

import datetime
import gzip
import io
import pathlib
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile
import zipfile

import h5py
import numpy
import openpyxl
import pyarrow
import pyarrow.ipc
import pyarrow.parquet
import zstandard
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

REFERENCE = pathlib.Path(__file__).parent.parent / "tests/reference"

# The smallest files that the scripts of the other tests write.
BORROWED = {
    "dataflash": ("dataflash", ["seed.BIN", "odd.BIN"]),
    "mat5": ("matlab", ["seed5.mat", "seed7.mat", "big.mat"]),
    "nmea": ("nmea", ["seed.log", "seed-bare.log", "rough.log"]),
    "pd0": ("pd0", ["seed.pd0", "old.pd0"]),
    "tlog": ("tlog", ["seed.tlog", "private.tlog"]),
    "ulog": ("ulog", ["seed.ulg", "appended.ulg"]),
}
TABLE = "time [s],u [m/s],T1 (us)\n" + "".join(
    f"{k / 10},{k % 3}e-2,{1500 + k}\n" for k in range(12)
)
VECTOR = "std_msgs/Header header\ngeometry_msgs/Vector3 vector\n" + "".join(
    f"{'=' * 80}\nMSG: {text}\n"
    for text in (
        "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
        "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z",
    )
)
JOINTS = "string[] name\nfloat64[] velocity\nuint8[<=3] mode\nbool[2] on\n"


def borrow(folder):
    for reader, (script, names) in BORROWED.items():
        with tempfile.TemporaryDirectory() as made:
            command = [sys.executable, "-B", str(REFERENCE / f"make_{script}.py"), made]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            for name in names:
                shutil.copyfile(pathlib.Path(made) / name, folder / reader / name)


def tables(folder):
    rows = [f"2020-07-31T13:50:{k:02}.5Z;0,{k};idle\n" for k in range(12)]
    (folder / "text/commas.csv").write_text("# a comment\n" + TABLE)
    (folder / "text/dates.csv").write_text("time;u [m/s];state\n" + "".join(rows))
    (folder / "text/utf-16.tsv").write_bytes(
        ("\ufeff" + TABLE.replace(",", "\t")).encode("utf-16-le")
    )
    (folder / "text/units.dat").write_text(
        "t u depth\ns m/s m\n" + "".join(f"{k} .{k} -{k}\n" for k in range(12))
    )
    packed = TABLE.encode()
    (folder / "gzip/table.gz").write_bytes(gzip.compress(packed, mtime=0))
    halves = [
        gzip.compress(part, level, mtime=0)
        for part, level in ((packed[:99], 0), (packed[99:], 9))
    ]
    (folder / "gzip/members.gz").write_bytes(b"".join(halves))
    for name, checksum in (("plain", False), ("checksum", True)):
        writer = zstandard.ZstdCompressor(
            write_checksum=checksum, write_content_size=not checksum
        )
        (folder / f"zstd/{name}.zst").write_bytes(writer.compress(packed))


def workbooks(folder):
    """Removes the parts that no reader needs: styles and metadata."""
    book = openpyxl.Workbook()
    book.active.append(["time", "u [m/s]", "state"])
    for k in range(12):
        moment = datetime.datetime(2020, 7, 31, 13, 50, k)
        book.active.append([moment, "#N/A" if k == 5 else k / 8, f"mode {k % 2}"])
    whole = io.BytesIO()
    book.save(whole)
    for name, packing in (("deflated", zipfile.ZIP_DEFLATED), ("stored", zipfile.ZIP_STORED)):
        with (
            zipfile.ZipFile(whole) as source,
            zipfile.ZipFile(folder / f"xlsx/{name}.xlsx", "w", packing) as target,
        ):
            for part in source.namelist():
                if "theme" not in part and "docProps" not in part:
                    target.writestr(zipfile.ZipInfo(part), source.read(part), packing)


def columnar(folder):
    rows = range(12)
    instants = pyarrow.array(
        [1_596_203_428_000 + 100 * k for k in rows], pyarrow.timestamp("ms", "UTC")
    )
    fields = [
        pyarrow.field("time", instants.type),
        pyarrow.field("u", pyarrow.float64(), metadata={"unit": "m/s"}),
        pyarrow.field("mode", pyarrow.dictionary(pyarrow.int8(), pyarrow.string())),
    ]
    columns = [
        instants,
        pyarrow.array([None if k == 5 else k / 8 for k in rows]),
        pyarrow.array([f"{k % 2}" for k in rows]).dictionary_encode().cast(fields[2].type),
    ]
    table = pyarrow.table(columns, pyarrow.schema(fields))
    for codec in ("none", "snappy", "zstd"):
        pyarrow.parquet.write_table(
            table,
            folder / f"parquet/{codec}.parquet",
            compression=codec,
            store_schema=codec == "zstd",
        )
    nested = pyarrow.table(
        {"t": pyarrow.array(rows), "p": pyarrow.array([{"a": k, "b": k > 3} for k in rows])}
    )
    pyarrow.parquet.write_table(
        nested, folder / "parquet/nested.parquet", data_page_version="2.0"
    )
    for codec in (None, "lz4", "zstd"):
        options = pyarrow.ipc.IpcWriteOptions(compression=codec)
        with pyarrow.ipc.new_file(
            folder / f"arrow/{codec or 'plain'}.arrow", table.schema, options=options
        ) as writer:
            writer.write_table(table, 8)
    with pyarrow.ipc.new_stream(folder / "arrow/nested.arrows", nested.schema) as writer:
        writer.write_table(nested, 8)


def vectors():
    for k in range(5):
        stamp = {"sec": 1_600_000_000 + k, "nanosec": 5 * k}
        header = {"stamp": stamp, "frame_id": "imu"}
        yield k, {"header": header, "vector": {"x": k / 8, "y": -k, "z": 0.5}}


def ros_2(folder):
    for name, options in (
        ("plain", {"compression": CompressionType.NONE, "enable_crcs": False}),
        ("lz4", {"compression": CompressionType.LZ4}),
        ("zstd", {"compression": CompressionType.ZSTD}),
    ):
        with open(folder / f"mcap/{name}.mcap", "wb") as file:
            writer = McapWriter(file, chunk_size=300, **options)
            vectors_of = writer.register_msgdef("geometry_msgs/msg/Vector3Stamped", VECTOR)
            joints_of = writer.register_msgdef("a/msg/Joints", JOINTS)
            for k, message in vectors():
                writer.write_message(
                    "/v", vectors_of, message, 1_600_000_000_000_000_000 + k * 10**9
                )
                held = {
                    "name": ["port", "stbd"],
                    "velocity": [k / 2, 3.0],
                    "mode": [k] * (k % 3),
                    "on": [True, False],
                }
                writer.write_message(
                    "/j", joints_of, held, 1_600_000_000_500_000_000 + k * 10**9
                )
            writer.finish()
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, definitions in (("defined", True), ("undefined", False)):
        path = folder / f"db3/{name}.db3"
        path.unlink(missing_ok=True)
        database = sqlite3.connect(path)
        database.execute("PRAGMA page_size = 512")
        database.execute(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)"
        )
        database.execute(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        )
        database.execute(
            "INSERT INTO topics VALUES (1, '/v', 'geometry_msgs/msg/Vector3Stamped', 'cdr')"
        )
        if definitions:
            database.execute(
                "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, encoded_message_definition TEXT)"
            )
            database.execute(
                "INSERT INTO message_definitions VALUES (1, 'geometry_msgs/msg/Vector3Stamped', 'ros2msg', ?)",
                [VECTOR],
            )
        for k, message in vectors():
            data = store.serialize_cdr(
                vector(store, message), "geometry_msgs/msg/Vector3Stamped"
            )
            database.execute(
                "INSERT INTO messages VALUES (?, 1, ?, ?)",
                [k, 1_600_000_000_000_000_000 + k * 10**9, bytes(data)],
            )
        database.commit()
        database.close()


def vector(store, message, **more):
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](**message["header"]["stamp"])
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="imu", **more)
    return types["geometry_msgs/msg/Vector3Stamped"](
        header, types["geometry_msgs/msg/Vector3"](**message["vector"])
    )


def ros_1(folder):
    store = get_typestore(Stores.ROS1_NOETIC)
    kind = "geometry_msgs/msg/Vector3Stamped"
    formats = BagWriter.CompressionFormat
    for name, packing in (("plain", None), ("lz4", formats.LZ4), ("bz2", formats.BZ2)):
        path = folder / f"bag/{name}.bag"
        path.unlink(missing_ok=True)
        writer = BagWriter(path)
        if packing:
            writer.set_compression(packing)
        with writer:
            definition = VECTOR.replace(
                "builtin_interfaces/Time stamp", "uint32 seq\ntime stamp"
            )
            connection = writer.add_connection("/v", kind, msgdef=definition, md5sum="0" * 32)
            for k, message in vectors():
                data = store.serialize_ros1(vector(store, message, seq=k), kind)
                writer.write(connection, 1_600_000_000_000_000_000 + k * 10**9, data)
        path.write_bytes(unpadded(path.read_bytes()))


def unpadded(bag):
    """Removes the padding of a bag's first record."""
    start = len(b"#ROSBAG V2.0\n")
    data = start + 4 + struct.unpack_from("<I", bag, start)[0]
    blanks = struct.unpack_from("<I", bag, data)[0]
    bag = bytearray(bag[:data] + bytes(4) + bag[data + 4 + blanks :])
    at = bag.index(b"index_pos=") + len(b"index_pos=")
    struct.pack_into("<Q", bag, at, struct.unpack_from("<Q", bag, at)[0] - blanks)
    return bytes(bag)


def hdf5(folder):
    time = numpy.arange(12.0) / 8
    with h5py.File(folder / "hdf5/plain.h5", "w", libver=("earliest", "v108")) as file:
        file["time"] = time
        file["time"].attrs["units"] = "s"
        file["on"] = time > 1
    with h5py.File(folder / "hdf5/nested.h5", "w", libver="v108") as file:
        file["nav/time"] = time
        file["nav/u"] = numpy.outer(time, [1, 2]).astype("f4")
    for name, version in (("chunks", "v108"), ("chunks-new", "v110")):
        with h5py.File(folder / f"hdf5/{name}.h5", "w", libver=version) as file:
            file["time"] = time
            file.create_dataset(
                "u",
                data=numpy.outer(time, [1, 2]),
                chunks=(12, 2),
                compression="gzip",
                shuffle=True,
                fletcher32=True,
            )


def main():
    folder = pathlib.Path(sys.argv[1])
    for reader in [
        "arrow",
        "bag",
        "dataflash",
        "db3",
        "gzip",
        "hdf5",
        "mat5",
        "mcap",
        "nmea",
        "parquet",
        "pd0",
        "text",
        "tlog",
        "ulog",
        "xlsx",
        "zstd",
    ]:
        (folder / reader).mkdir(parents=True, exist_ok=True)
    borrow(folder)
    tables(folder)
    workbooks(folder)
    columnar(folder)
    ros_2(folder)
    ros_1(folder)
    hdf5(folder)


if __name__ == "__main__":
    main()
