"""Writes DataFlash logs with every kind of field, and reads them again with pymavlink.

python3 make_dataflash.py FOLDER
"""

import pathlib
import random
import struct
import sys

import dataflash
from expected import Expected

UNITS = {
    "s": "s",
    "d": "deg",
    "h": "degheading",
    "n": "m/s",
    "Y": "us",
    "#": "instance",
    "-": "",
    "?": "UNKNOWN",
    "P": "Pa",
    "D": "deglatitude",
    "G": "Gauss",
}
MULTIPLIERS = {
    "-": 0.0,
    "?": 1.0,
    "0": 1.0,
    "2": 100.0,
    "B": 0.01,
    "C": 0.001,
    "G": 1e-7,
    # Some versions rounded to 32 bits before they stored 64.
    "F": struct.unpack("<f", struct.pack("<f", 1e-6))[0],
}


def every_kind(log, dice, records):
    """Writes every letter, in three types of message."""
    log.letters(UNITS, MULTIPLIERS)
    log.define(10, "INTS", "QbBhHiIqQM", "TimeUS,b,B,h,H,i,I,q,Q,M")
    log.define(11, "SCAL", "QcCeELfdg", "TimeUS,c,C,e,E,L,f,d,g")
    log.define(12, "INST", "QBfHB", "TimeUS,I,Press,C1,Flag")
    log.define(13, "TEXT", "QnNZah", "TimeUS,n,N,Z,a,Value")
    log.record(132, 0, 10, "s-?dnnn---", "F-?B2C0---")
    log.record(132, 0, 11, "shhdmDnPP", "FBBBBGC2-")
    log.record(132, 0, 12, "s#PY-", "F-2--")
    whole = {
        "b": (-(2**7), 2**7),
        "B": (0, 2**8),
        "h": (-(2**15), 2**15),
        "H": (0, 2**16),
        "i": (-(2**31), 2**31),
        "I": (0, 2**32),
        "q": (-(2**53), 2**53),
        "Q": (0, 2**53),
    }

    def number(letter):
        low, high = whole[
            {"c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "b"}.get(letter, letter)
        ]
        low = max(low, 0) if letter == "M" else low
        return dice.choice([low, high - 1, 0, dice.randrange(low, high)])

    for k in range(records):
        now = 1_000_000 + 10_000 * k
        log.record(10, now, *(number(letter) for letter in "bBhHiIqQM"))
        numbers = [number(letter) for letter in "cCeEL"]
        log.record(11, now, *numbers, dice.gauss(0, 1), dice.gauss(0, 1e9), dice.gauss(0, 100))
        log.record(12, now + 1, k % 3, dice.gauss(1e5, 10), 1500 + k % 400, k % 2)
        values = [dice.randrange(256) for _ in range(64)]
        log.record(13, now, "four", "name", "a text", bytes(values), number("h"))


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)
    dice = random.Random(11)
    for name, records in [("all.BIN", 400), ("seed.BIN", 6)]:
        log = dataflash.Writer()
        every_kind(log, dice, records)
        (folder / name).write_bytes(log.content)
        dataflash.expect(expected, folder / name, name)

    # A satellite's date, a clock in milliseconds, and types whose records cannot be read.
    log = dataflash.Writer()
    log.define(10, "GPS", "QBIH", "TimeUS,Status,GMS,GWk")
    log.define(11, "OLD", "Ih", "TimeMS,Value")
    log.define(12, "BARE", "B", "Value")
    log.record(128, 13, 3 + 9, "LONG", "QH", "TimeUS,Value")
    log.record(128, 14, 3 + 9, "NEW", "Qx", "TimeUS,Value")
    for k in range(10):
        # 2022-03-10, 00:00 by the satellites' clock, is ten seconds after the start.
        log.record(10, 10_000_000 + 1_000_000 * k, 3, 4 * 86_400_000 + 1000 * k, 2200)
        log.record(11, 10_000 + 100 * k, k)
        log.record(12, k)
        log.content += bytes([0xA3, 0x95, 13]) + bytes(9) + bytes([0xA3, 0x95, 14]) + bytes(9)
    (folder / "odd.BIN").write_bytes(log.content)
    expected.channel("odd.BIN", "OLD.Value", [10 + 0.1 * k for k in range(10)], range(10))
    seconds = [10 + k for k in range(10)]
    expected.channel("odd.BIN", "GPS.Status", seconds, [3] * 10)
    expected.channel(
        "odd.BIN", "GPS.GMS", seconds, [4 * 86_400_000 + 1000 * k for k in range(10)]
    )
    expected.channel("odd.BIN", "GPS.GWk", seconds, [2200] * 10)

    # Three starts of the autopilot in one file, the definitions before each.
    content = bytearray()
    times, values = [], []
    ends = [0.0]
    for start in range(3):
        log = dataflash.Writer()
        log.define(10, "ATT", "Qc", "TimeUS,Roll")
        for k in range(50):
            roll = dice.randrange(-18000, 18000)
            log.record(10, 2_000_000 + 100_000 * k, roll)
            # Later starts follow 100 s after the last record before.
            times.append(2.0 + 0.1 * k if start == 0 else ends[start] + 100.0 + 0.1 * k)
            values.append(roll / 100)
        ends.append(times[-1])
        content += log.content
    (folder / "starts.BIN").write_bytes(content)
    expected.channel("starts.BIN", "ATT.Roll", times, values)
    expected.save()


if __name__ == "__main__":
    main()
