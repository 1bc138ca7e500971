"""Decodes the recordings in SEAPLANT_DATA/formats/pd0 by the tables of the format.

python3 make_pd0_recordings.py FOLDER
"""

import calendar
import os
import pathlib
import struct
import sys

from expected import Expected

WORKSPACE = pathlib.Path(__file__).resolve().parents[4]
DATA = WORKSPACE / os.environ.get("SEAPLANT_DATA", "../shared/data") / "formats/pd0"
AXES = [
    ("beam", ["1", "2", "3", "4"]),
    ("instrument", ["x", "y", "z", "error"]),
    ("ship", ["starboard", "forward", "up", "error"]),
    ("earth", ["east", "north", "up", "error"]),
]


def ensembles(data):
    at = 0
    while (at := data.find(b"\x7f\x7f", at)) >= 0:
        size = struct.unpack_from("<H", data, at + 2)[0] if at + 6 <= len(data) else 0
        body, check = data[at : at + size], data[at + size : at + size + 2]
        if size < 8 or len(check) < 2 or sum(body) % 65536 != int.from_bytes(check, "little"):
            at += 1
            continue
        starts = struct.unpack_from(f"<{body[5]}H", body, 6)
        yield {int.from_bytes(body[s : s + 2], "little"): body[s:] for s in reversed(starts)}
        at += size + 2


def main():
    expected = Expected(sys.argv[1])
    for name in ("RDI_withBT.000", "RiverPro_test01.PD0"):
        times, columns = [], {}

        def put(column, unit, value):
            columns.setdefault(column, (unit, []))[1].append(value)

        for types in ensembles((DATA / name).read_bytes()):
            fixed, leader, bottom = types[0x0000], types[0x0080], types[0x0600]
            century, year, *rest, hundredth = leader[57:65]
            times.append(calendar.timegm((100 * century + year, *rest)) + hundredth / 100)
            put("ensemble", None, leader[2] + 256 * leader[3] + 65536 * leader[11])
            numbers = struct.unpack_from("<HHHhhHh", leader, 14)
            put("speed_of_sound", "m/s", numbers[0])
            put("transducer.depth", "m", numbers[1] / 10)
            put("heading", "deg", numbers[2] / 100)
            put("pitch", "deg", numbers[3] / 100)
            put("roll", "deg", numbers[4] / 100)
            put("salinity", None, numbers[5])
            put("temperature", None, numbers[6] / 100)
            put("pressure", "dbar", struct.unpack_from("<i", leader, 48)[0] / 1000)
            frame, axes = AXES[fixed[25] // 8 % 4]
            ranges = struct.unpack_from("<4H", bottom, 16)
            speeds = struct.unpack_from("<4h", bottom, 24)
            for k in range(4):
                far = ranges[k] + 65536 * bottom[77 + k]
                put(f"bottom_track.range_{k + 1}", "m", far / 100 if far else None)
                speed = speeds[k] / 1000 if speeds[k] != -32768 else None
                put(f"bottom_track.{frame}.velocity_{axes[k]}", "m/s", speed)
                put(f"bottom_track.correlation_{k + 1}", None, bottom[32 + k])
                put(f"bottom_track.percent_good_{k + 1}", "%", bottom[40 + k])
        for column, (unit, values) in columns.items():
            expected.channel(name, column, times, values, unit=unit)
    expected.save()


main()
