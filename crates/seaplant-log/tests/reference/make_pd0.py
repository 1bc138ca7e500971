"""Writes PD0 files by the tables of Teledyne's published format.

python3 make_pd0.py FOLDER
"""

import calendar
import pathlib
import random
import struct
import sys

from expected import Expected

FRAMES = [
    ("beam", ["1", "2", "3", "4"]),
    ("instrument", ["x", "y", "z", "error"]),
    ("ship", ["starboard", "forward", "up", "error"]),
    ("earth", ["east", "north", "up", "error"]),
]
NMEA = b"$GPGGA,101500.00,4736.45,N,12220.47,W,4,12,0.9,3.1,M,-17.2,M,,*4D\r\n"


class Log:
    """Builds ensembles, with the expected channels."""

    def __init__(self, seed):
        self.dice = random.Random(seed)
        self.bytes = b""
        self.time_s = []
        self.columns = {}
        self.count = 0

    def put(self, column, unit, value):
        _, values = self.columns.setdefault(column, (unit, [None] * (len(self.time_s) - 1)))
        values += [None] * (len(self.time_s) - 1 - len(values))
        values.append(value)

    def variable_leader(self, clock, with_century):
        dice, number = self.dice, self.count
        year, month, day, hour, minute, second, hundredth = clock
        short = bytes([year % 100, month, day, hour, minute, second, hundredth])
        sound, depth, heading = (
            dice.randrange(1400, 1600),
            dice.randrange(9999),
            dice.randrange(36000),
        )
        pitch, roll = dice.randrange(-2000, 2001), dice.randrange(-2000, 2001)
        salinity, temperature = dice.randrange(41), dice.randrange(-500, 4001)
        pressure = dice.randrange(-100, 1 << 24)
        leader = struct.pack("<HH", 0x0080, number & 0xFFFF) + short
        leader += struct.pack(
            "<BHHHHhhHh",
            number >> 16,
            0,
            sound,
            depth,
            heading,
            pitch,
            roll,
            salinity,
            temperature,
        )
        leader = leader.ljust(48, b"\0") + struct.pack("<ii", pressure, 0)
        if with_century:
            leader += b"\0" + bytes([year // 100]) + short
        self.time_s.append(calendar.timegm(clock[:6]) + hundredth / 100)
        self.put("ensemble", None, number)
        self.put("speed_of_sound", "m/s", sound)
        self.put("transducer.depth", "m", depth / 10)
        self.put("heading", "deg", heading / 100)
        self.put("pitch", "deg", pitch / 100)
        self.put("roll", "deg", roll / 100)
        self.put("salinity", None, salinity)
        self.put("temperature", None, temperature / 100)
        self.put("pressure", "dbar", pressure / 1000)
        return leader

    def bottom_track(self, frame):
        dice = self.dice
        ranges = [
            dice.choice([0, dice.randrange(1, 65536), dice.randrange(65536, 1 << 17)])
            for _ in range(4)
        ]
        speeds = [dice.choice([-32768, dice.randrange(-32767, 32768)]) for _ in range(4)]
        bottom = struct.pack("<H", 0x0600).ljust(16, b"\0")
        bottom += struct.pack("<4H", *[r & 0xFFFF for r in ranges]) + struct.pack(
            "<4h", *speeds
        )
        bytes_of = {"correlation": [], "percent_good": []}
        for key in ("correlation", "amplitude", "percent_good"):
            four = [dice.randrange(101 if key == "percent_good" else 256) for _ in range(4)]
            bytes_of[key] = four
            bottom += bytes(four)
        bottom = bottom.ljust(77, b"\0") + bytes(r >> 16 for r in ranges)
        name, axes = FRAMES[frame]
        for k in range(4):
            speed = None if speeds[k] == -32768 else speeds[k] / 1000
            self.put(f"bottom_track.{name}.velocity_{axes[k]}", "m/s", speed)
            self.put(f"bottom_track.range_{k + 1}", "m", ranges[k] / 100 if ranges[k] else None)
            self.put(f"bottom_track.correlation_{k + 1}", None, bytes_of["correlation"][k])
            self.put(f"bottom_track.percent_good_{k + 1}", "%", bytes_of["percent_good"][k])
        return bottom

    def ensemble(self, clock, frame=None, with_century=True, profile=False):
        """Adds an ensemble; returns its bytes, for damage."""
        self.count += 1
        types = [
            struct.pack("<H", 0x0000).ljust(25, b"\0") + bytes([(frame or 0) << 3 | 0b111])
        ]
        types[0] = types[0].ljust(59, b"\0")
        types.append(self.variable_leader(clock, with_century))
        if profile:
            types.append(struct.pack("<H", 0x0100) + struct.pack("<8h", *range(8)))
        if frame is not None:
            types.append(self.bottom_track(frame))
        return pack(types)

    def expect(self, expected, file):
        for column, (unit, values) in self.columns.items():
            values = values + [None] * (len(self.time_s) - len(values))
            expected.channel(file, column, self.time_s, values, unit=unit)


def pack(types):
    offsets, at = [], 6 + 2 * len(types)
    for one in types:
        offsets.append(at)
        at += len(one)
    body = struct.pack("<BBHBB", 0x7F, 0x7F, at, 0, len(types))
    body += struct.pack(f"<{len(types)}H", *offsets) + b"".join(types)
    return body + struct.pack("<H", sum(body) & 0xFFFF)


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)

    def clock(k, year=2031):
        return (year, 2, 28, 23, 58 + k // 60 % 2, k % 60, k * 7 % 100)

    # Every frame in turn, past 65 535 ensembles, through the end of a February.
    log = Log(1)
    log.count = 65_530
    for k in range(100):
        log.bytes += log.ensemble(clock(k), frame=k // 25, profile=True)
    (folder / "frames.pd0").write_bytes(log.bytes)
    log.expect(expected, "frames.pd0")

    # The clock of old instruments, which knows no century; no bottom in reach.
    log = Log(2)
    for k in range(20):
        log.bytes += log.ensemble(clock(k, 1999), with_century=False)
    (folder / "old.pd0").write_bytes(log.bytes)
    log.expect(expected, "old.pd0")

    # The rest of an ensemble, text in between, damage, and an end within an ensemble.
    log, spare = Log(3), Log(4)
    log.bytes += spare.ensemble(clock(0), frame=3)[100:]
    for k in range(30):
        log.bytes += NMEA * (k % 3)
        if k == 7:
            damaged = bytearray(spare.ensemble(clock(k), frame=3))
            damaged[60] ^= 0x10
            log.bytes += damaged
        if k == 12:
            log.bytes += b"\x7f\x7f\x00\x80" + bytes(range(200))
        log.bytes += log.ensemble(clock(k), frame=3)
    log.bytes += spare.ensemble(clock(31), frame=3)[:-1]
    (folder / "port.pd0").write_bytes(log.bytes)
    log.expect(expected, "port.pd0")

    log = Log(5)
    seed = b"".join(log.ensemble(clock(k), frame=k % 4) + NMEA * (k % 2) for k in range(12))
    (folder / "seed.pd0").write_bytes(seed)
    expected.save()


main()
