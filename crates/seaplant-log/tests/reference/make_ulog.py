"""Writes ULog files by the specification, and reads them and those of PX4 with pyulog.

SEAPLANT_DATA=... python3 make_ulog.py FOLDER
"""

import math
import os
import pathlib
import struct
import sys

from expected import Expected
from pyulog import ULog

FORMATS = [
    "part:float[2] pair;uint8_t flag;char[3] label;",
    "every:uint64_t timestamp;int8_t a;uint8_t b;int16_t c;uint16_t d;int32_t e;uint32_t f;"
    "int64_t g;uint64_t h;float i;double j;bool k;char[4] text;part[2] parts;uint8_t[3] _padding0;",
    "vehicle_attitude:uint64_t timestamp;float[4] q;",
    "sensor:uint64_t timestamp;float x;uint8_t[4] _padding0;",
]


def message(letter, body):
    return struct.pack("<HB", len(body), ord(letter)) + body


def header(parts=0):
    flags = bytes(8) + bytes([1 if parts else 0]) + bytes(7) + struct.pack("<QQQ", parts, 0, 0)
    start = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000)
    text = b"".join(message("F", text.encode()) for text in FORMATS)
    key = b"char[5] sys_name"
    info = message("I", bytes([len(key)]) + key + b"pilot")
    return start + message("B", flags) + text + info


def setting(name, value):
    key = f"{'float' if isinstance(value, float) else 'int32_t'} {name}".encode()
    packed = struct.pack("<f" if isinstance(value, float) else "<i", value)
    return message("P", bytes([len(key)]) + key + packed)


def subscribe(number, name, instance=0):
    return message("A", struct.pack("<BH", instance, number) + name.encode())


def record(number, body):
    return message("D", struct.pack("<H", number) + body)


def every(k):
    body = struct.pack(
        "<QbBhHiIqQfd?",
        2_000_000 + 20_000 * k,
        -k,
        k,
        -30 * k,
        40 * k,
        -5000 * k,
        6000 * k,
        -(2**40) - k,
        2**41 + k,
        k / 3,
        -k / 7,
        k % 2 == 0,
    )
    body += b"abcd"
    for part in range(2):
        body += struct.pack("<ffB", k + part / 8, -k, part) + b"xyz"
    return body


def attitude(k):
    half = 0.01 * k
    q = (
        (math.cos(half), 0.6 * math.sin(half), 0.0, 0.8 * math.sin(half))
        if k != 3
        else (0.0, 0.0, 0.0, 0.0)
    )
    return struct.pack("<Q4f", 2_000_000 + 10_000 * k, *q)


def all_messages():
    data = header() + setting("CA_ROTOR_COUNT", 6) + setting("MPC_XY_P", 0.95)
    data += subscribe(0, "every") + subscribe(1, "vehicle_attitude")
    data += subscribe(2, "sensor") + subscribe(3, "sensor", 1)
    for k in range(40):
        data += record(0, every(k)) + record(1, attitude(k))
        for number in (2, 3):
            data += record(
                number, struct.pack("<Qf", 2_000_000 + 5_000 * k + number, k * number)
            )
        if k == 20:
            data += message("S", bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12]))
            data += message("O", struct.pack("<H", 12))
            data += message("L", b"6" + struct.pack("<Q", 2_100_000) + b"armed")
    return data


def appended():
    """Writes a file whose last message was incomplete before more was appended."""
    first = header(1) + subscribe(2, "sensor")
    for k in range(10):
        first += record(2, struct.pack("<Qf", 1_000_000 * (k + 2), k))
    first += record(2, struct.pack("<Qf", 99, 99.0))[:9]
    first = header(len(first)) + first[len(header(1)) :]
    rest = subscribe(2, "sensor") + b"".join(
        record(2, struct.pack("<Qf", 1_000_000 * (k + 2), k)) for k in range(10, 15)
    )
    return first + rest


def angles(w, x, y, z):
    size = x * x + y * y + z * z + w * w
    if not size > 0:
        return None, None, None
    return (
        math.atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z),
        math.asin(min(max(2.0 * (w * y - z * x) / size, -1.0), 1.0)),
        math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z),
    )


def expect(expected, path, name):
    log = ULog(str(path))
    instances = {}
    for data in log.data_list:
        instances[data.name] = instances.get(data.name, 0) + 1
    for data in log.data_list:
        topic = f"{data.name}[{data.multi_id}]" if instances[data.name] > 1 else data.name
        # Of records that repeat a time, the first is kept.
        stamps = [int(t) for t in data.data["timestamp"]]
        kept = (
            [k for k, t in enumerate(stamps) if t not in stamps[:k]]
            if len(set(stamps)) < len(stamps)
            else range(len(stamps))
        )
        time_s = [stamps[k] / 1e6 for k in kept]
        fields = [f.field_name for f in data.field_data if f.field_name != "timestamp"]
        texts = {f.field_name for f in data.field_data if f.type_str == "char"}
        for field in fields:
            if field in texts or "_padding" in field:
                continue
            values = [float(data.data[field][k]) for k in kept]
            # A column without any number is no channel.
            if any(math.isfinite(value) for value in values):
                expected.channel(name, f"{topic}.{field}", time_s, values)
        q = [f"q[{k}]" for k in range(4)]
        taken = {"roll", "pitch", "yaw", "q[4]"} & set(fields)
        if all(k in fields for k in q) and not taken:
            rows = [angles(*(float(data.data[k][row]) for k in q)) for row in kept]
            for which, angle in enumerate(("roll", "pitch", "yaw")):
                values = [row[which] for row in rows]
                expected.channel(name, f"{topic}.{angle}", time_s, values, unit="rad")


def main():
    folder = pathlib.Path(sys.argv[1])
    (folder / "all.ulg").write_bytes(all_messages())
    (folder / "appended.ulg").write_bytes(appended())
    seed = (
        header() + setting("A", 1) + subscribe(2, "sensor") + subscribe(1, "vehicle_attitude")
    )
    for k in range(12):
        seed += record(2, struct.pack("<Qf", 2_000_000 + 5_000 * k, k)) + record(1, attitude(k))
    (folder / "seed.ulg").write_bytes(seed)
    expected = Expected(folder)
    # pyulog treats an appended part as a separate log.
    for name in ("all.ulg", "seed.ulg"):
        expect(expected, folder / name, name)
    others = pathlib.Path(os.environ.get("SEAPLANT_DATA", "")) / "formats/ulog"
    for name in ("sample_log_small.ulg", "sample_appended_multiple.ulg"):
        if (others / name).exists():
            expect(expected, others / name, name)
    expected.save()


if __name__ == "__main__":
    main()
