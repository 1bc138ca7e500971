"""Writes Parquet and Arrow files with pyarrow.

python3 make_arrow.py FOLDER
"""

import datetime
import decimal
import pathlib
import random
import struct
import sys

import numpy
import pyarrow as pa
import pyarrow.feather
import pyarrow.ipc
import pyarrow.parquet as pq
from expected import Expected

ROWS = 2500
START_NS = 1_596_203_428_123_456_000


def holed(dice, values):
    """Returns values with one in seven missing."""
    return [None if dice.random() < 1 / 7 else value for value in values]


def every_type(dice):
    """Returns a table with a column of every type, and the expected channels."""
    columns, truth = {}, {}

    def add(name, kind, values, as_number=float, unit=None, metadata=None):
        values = holed(dice, values)
        field = pa.field(name, kind, metadata=metadata)
        columns[name] = (field, pa.array(values, kind))
        truth[name] = ([None if v is None else as_number(v) for v in values], unit)

    rows = range(ROWS)
    for bits in (8, 16, 32, 64):
        top = 2 ** (bits - 1)
        add(f"i{bits}", getattr(pa, f"int{bits}")(), [dice.randrange(-top, top) for _ in rows])
        add(f"u{bits}", getattr(pa, f"uint{bits}")(), [dice.randrange(2 * top) for _ in rows])
    halves = [numpy.float16(dice.gauss(0, 10)) for _ in rows]
    add("f16", pa.float16(), halves)
    singles = [struct.unpack("f", struct.pack("f", dice.gauss(0, 1)))[0] for _ in rows]
    add("f32", pa.float32(), singles)
    doubles = [dice.gauss(0, 1) if k % 50 else float("nan") for k in rows]
    add("f64", pa.float64(), doubles, unit="m/s", metadata={"unit": "m/s"})
    add("named (deg)", pa.float64(), [dice.gauss(0, 1) for _ in rows], unit="deg")
    add("armed", pa.bool_(), [dice.random() < 0.5 for _ in rows])
    for name, kind in [("d128", pa.decimal128(12, 3)), ("d256", pa.decimal256(40, 5))]:
        numbers = [decimal.Decimal(dice.randrange(-(10**9), 10**9)).scaleb(-3) for _ in rows]
        add(name, kind, numbers)
    states = [dice.choice(["1.5", "2", "NaN", "idle"]) for _ in rows]

    def number(text):
        return float(text) if text != "idle" else None

    add("text", pa.string(), states, number)
    add("coded text", pa.dictionary(pa.int8(), pa.string()), states, number)
    gears = [dice.choice([10.5, 20.25, -3.0]) for _ in rows]
    add("coded", pa.dictionary(pa.int16(), pa.float64()), gears)
    day = datetime.date(2020, 7, 31)
    days = [day + datetime.timedelta(days=k % 300) for k in rows]
    epoch = datetime.date(1970, 1, 1)
    add("date32", pa.date32(), days, lambda d: (d - epoch).days * 86400.0, unit="s")
    add("date64", pa.date64(), days, lambda d: (d - epoch).days * 86400.0, unit="s")
    for unit, size in [("s", 1), ("ms", 10**3), ("us", 10**6), ("ns", 10**9)]:
        counts = [dice.randrange(10**15) for _ in rows]

        def seconds(count, size=size):
            return count // size + (count % size) / size

        add(f"duration {unit}", pa.duration(unit), counts, seconds, unit="s")
        short = [dice.randrange(86_400 * size) for _ in rows]
        kind = pa.time32(unit) if unit in ("s", "ms") else pa.time64(unit)
        add(f"clock {unit}", kind, short, seconds, unit="s")

    # A struct of structs, missing here and there at every level.
    inner = pa.struct(
        [pa.field("x", pa.float64(), metadata={"Units": "m"}), ("flag", pa.bool_())]
    )
    outer = pa.struct([("gyro", inner), ("n", pa.int32())])
    poses = []
    for k in rows:
        gyro = None if k % 5 == 1 else {"x": dice.gauss(0, 1), "flag": k % 2 == 0}
        poses.append(None if k % 11 == 2 else {"gyro": gyro, "n": k})
    columns["pose"] = (pa.field("pose", outer), pa.array(poses, outer))

    def at(pose, *route):
        for name in route:
            pose = None if pose is None else pose[name]
        return None if pose is None else float(pose)

    truth["pose.gyro.x"] = ([at(pose, "gyro", "x") for pose in poses], "m")
    truth["pose.gyro.flag"] = ([at(pose, "gyro", "flag") for pose in poses], None)
    truth["pose.n"] = ([at(pose, "n") for pose in poses], None)

    # Columns that are not series of numbers.
    columns["ranges"] = (
        pa.field("ranges", pa.list_(pa.float64())),
        pa.array([[1.0, 2.0]] * ROWS),
    )
    columns["blob"] = (pa.field("blob", pa.binary()), pa.array([b"x"] * ROWS))
    columns["void"] = (pa.field("void", pa.null()), pa.nulls(ROWS))
    return columns, truth


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)
    dice = random.Random(6)
    stamps = [START_NS + k * 12_345_000 for k in range(ROWS)]
    times = [stamp // 10**9 + (stamp % 10**9) / 1e9 for stamp in stamps]
    columns, truth = every_type(dice)
    instant = (
        pa.field("time", pa.timestamp("ns", "UTC")),
        pa.array(stamps, pa.timestamp("ns", "UTC")),
    )

    def table(names):
        fields = [instant] + [columns[name] for name in names]
        return pa.table(
            [array for _, array in fields], pa.schema([field for field, _ in fields])
        )

    def expect(file, names, time_s=times):
        for name in names:
            values, unit = truth[name]
            expected.channel(file, name, time_s, values, unit=unit)

    whole = table(columns)
    narrow = ["f64", "i16", "coded text"]
    few = table(narrow)
    for file, content, settings in [
        ("types.parquet", whole, {"compression": "snappy", "row_group_size": 700}),
        (
            "old.parquet",
            few,
            {"compression": "gzip", "version": "1.0", "use_dictionary": False},
        ),
        (
            "pages.parquet",
            few,
            {"compression": "zstd", "data_page_version": "2.0", "data_page_size": 512},
        ),
        ("lz4.parquet", few, {"compression": "lz4"}),
        ("plain.parquet", few, {"compression": "none", "store_schema": False}),
        ("legacy.parquet", few, {"use_deprecated_int96_timestamps": True}),
    ]:
        pq.write_table(content, folder / file, **settings)
        expect(file, truth if content is whole else narrow)
    # Without pyarrow's own schema, no unit is kept.
    for channel in expected.channels:
        if channel["file"] == "plain.parquet":
            channel["unit"] = None
    for file, content, compression in [
        ("types.feather", whole, "lz4"),
        ("zstd.feather", few, "zstd"),
        ("plain.arrow", few, "uncompressed"),
    ]:
        pyarrow.feather.write_feather(
            content, folder / file, compression=compression, chunksize=600
        )
        expect(file, truth if content is whole else narrow)
    with pyarrow.ipc.new_stream(folder / "log.arrows", few.schema) as writer:
        writer.write_table(few, max_chunksize=600)
    expect("log.arrows", narrow)

    # A file is a stream after eight bytes; pyarrow tells how many rows are complete before a
    # cut.
    file = (folder / "plain.arrow").read_bytes()
    cut = file[: int(len(file) * 0.7)]
    (folder / "cut.arrow").write_bytes(cut)
    kept, stream = 0, pyarrow.ipc.open_stream(cut[8:])
    try:
        while True:
            kept += stream.read_next_batch().num_rows
    except (OSError, pa.ArrowInvalid):
        assert 0 < kept < ROWS, kept
    for name in narrow:
        values, unit = truth[name]
        expected.channel("cut.arrow", name, times[:kept], values[:kept], unit=unit)

    # A time index that pandas left without a name, coarser units of it, and text for time.
    texts = [f"2020-07-31T13:50:{k % 60:02}.{k:03}Z" for k in range(60)]
    for file, field, values in [
        (
            "index.parquet",
            pa.field("__index_level_0__", pa.timestamp("us")),
            [s // 1000 for s in stamps[:60]],
        ),
        ("text.parquet", pa.field("timestamp", pa.string()), texts),
        (
            "seconds.parquet",
            pa.field("t", pa.float64(), metadata={"unit": "ms"}),
            [1000.0 * k for k in range(60)],
        ),
    ]:
        speeds = [dice.gauss(0, 1) for _ in range(60)]
        schema = pa.schema([field, pa.field("u", pa.float64())])
        pq.write_table(pa.table([pa.array(values, field.type), speeds], schema), folder / file)
        if file == "text.parquet":
            zero = datetime.datetime(
                2020, 7, 31, 13, 50, tzinfo=datetime.timezone.utc
            ).timestamp()
            time_s = [zero + k + k / 1000 for k in range(60)]
        elif file == "index.parquet":
            time_s = [(s // 1000) / 1e6 for s in stamps[:60]]
        else:
            time_s = range(60)
        expected.channel(file, "u", time_s, speeds)

    pq.write_table(few.slice(0, 50), folder / "brotli.parquet", compression="brotli")
    constant = pa.table(
        {
            "t": pa.array(range(3_000_000)),
            **{f"u{k}": pa.array([0] * 3_000_000) for k in range(40)},
        }
    )
    sorted_t = {
        "column_encoding": {"t": "DELTA_BINARY_PACKED"},
        "use_dictionary": [f"u{k}" for k in range(40)],
    }
    pq.write_table(constant, folder / "bomb.parquet", compression="zstd", **sorted_t)

    small = whole.slice(0, 40).combine_chunks()
    for codec in ("none", "snappy", "zstd", "lz4", "gzip"):
        pq.write_table(small, folder / f"seed-{codec}.parquet", compression=codec)
    for codec in ("uncompressed", "lz4", "zstd"):
        pyarrow.feather.write_feather(
            small, folder / f"seed-{codec}.arrow", compression=codec, chunksize=20
        )
    with pyarrow.ipc.new_stream(folder / "seed.arrows", small.schema) as writer:
        writer.write_table(small, max_chunksize=20)
    expected.save()


if __name__ == "__main__":
    main()
