"""Reads and writes DataFlash logs with pymavlink.

pymavlink gives numbers in the unit of the stored value where FMTU states a multiplier, and so they
are multiplied here.
"""

import math
import numbers
import struct

from pymavlink import DFReader

# The symbols of UNIT records that stand for a unit known to Seaplant.
UNITS = {
    symbol: symbol
    for symbol in [
        "A",
        "deg",
        "deg/s",
        "rad/s",
        "rad/s/s",
        "deg/s/s",
        "m",
        "m/s",
        "m/s/s",
        "%",
        "s",
        "rpm",
        "rad",
        "V",
        "Pa",
        "us",
    ]
} | {"degheading": "deg", "deglatitude": "deg", "deglongitude": "deg"}

ABOUT_THE_LOG = {"FMT", "FMTU", "UNIT", "MULT", "PARM"}


def sorted_once(samples):
    """Sorts by time, keeping the first of equal times."""
    found = []
    for time, value in sorted((s for s in samples if math.isfinite(s[1])), key=lambda s: s[0]):
        if not found or found[-1][0] != time:
            found.append((time, value))
    return found


def expect(expected, path, name):
    """Returns every number of every message of a log."""
    reader = DFReader.DFReader_binary(str(path))
    letters = {}
    messages = []
    while (message := reader.recv_msg()) is not None:
        if message.get_type() == "FMTU":
            letters[message.FmtType] = (message.UnitIds, message.MultIds)
        messages.append(message)
    channels = {}
    for message in messages:
        kind = message.get_type()
        if kind in ABOUT_THE_LOG or "TimeUS" not in message.fmt.columns:
            continue
        form = message.fmt
        units, multipliers = letters.get(form.type, ("", ""))
        group = kind
        if form.instance_field:
            group += f"[{getattr(message, form.instance_field)}]"
        for k, field in enumerate(form.columns[: len(form.msg_fmts)]):
            if field in ("TimeUS", form.instance_field) or not field:
                continue
            value = getattr(message, field)
            if isinstance(value, bool) or not isinstance(value, numbers.Real):
                continue
            factor = reader.mult_lookup.get(multipliers[k : k + 1], 0)
            if form.msg_mults[k] is None and factor not in (0, 1):
                value = value * factor if factor > 1 else value / round(1 / factor)
            unit = UNITS.get(reader.unit_lookup.get(units[k : k + 1]))
            entry = channels.setdefault(f"{group}.{field}", (unit, []))
            entry[1].append((message.TimeUS / 1e6, float(value)))
    for column, (unit, samples) in channels.items():
        samples = sorted_once(samples)
        if samples:
            times, values = zip(*samples)
            expected.channel(name, column, times, values, unit=unit)


class Writer:
    """Writes records with the storage types of pymavlink's table of letters."""

    def __init__(self):
        self.content = bytearray()
        self.forms = {128: "BBnNZ"}
        self.define(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")

    def define(self, number, name, letters, columns):
        self.forms[number] = letters
        length = 3 + struct.calcsize(self.layout(number))
        self.record(128, number, length, name, letters, columns)

    def layout(self, number):
        stored = DFReader.FORMAT_TO_STRUCT
        return "<" + "".join(stored[letter][0] for letter in self.forms[number])

    def letters(self, units, multipliers):
        """Writes the meanings of letters: UNIT, MULT and FMTU are 130, 131 and 132."""
        self.define(130, "UNIT", "QbZ", "TimeUS,Id,Label")
        self.define(131, "MULT", "Qbd", "TimeUS,Id,Mult")
        self.define(132, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
        for letter, label in units.items():
            self.record(130, 0, ord(letter), label)
        for letter, factor in multipliers.items():
            self.record(131, 0, ord(letter), factor)

    def record(self, number, *values):
        """Writes a record; numbers as they are stored."""
        values = [v.encode() if isinstance(v, str) else v for v in values]
        self.content += bytes([0xA3, 0x95, number]) + struct.pack(self.layout(number), *values)
