"""Reads MAVLink telemetry logs with pymavlink."""

import os

os.environ["MAVLINK20"] = "1"

from dataflash import sorted_once
from pymavlink import mavutil

# Symbols of definitions: Seaplant's unit, and the divisor of values.
UNITS = {
    symbol: (symbol, 1)
    for symbol in [
        "m",
        "cm",
        "mm",
        "m/s",
        "cm/s",
        "mm/s",
        "m/s/s",
        "rad",
        "deg",
        "rad/s",
        "mrad/s",
        "deg/s",
        "s",
        "ms",
        "ns",
        "%",
        "V",
        "mV",
        "A",
        "mA",
        "rpm",
        "W",
        "kg",
        "Pa",
        "kPa",
        "hPa",
        "mbar",
        "us",
        "mG",
    ]
} | {
    "degE7": ("deg", 1e7),
    "degE5": ("deg", 1e5),
    "cdeg": ("deg", 100),
    "cdeg/s": ("deg/s", 100),
    "ddeg/s": ("deg/s", 10),
    "deg/2": ("deg", 0.5),
    "dm": ("m", 10),
    "dam": ("m", 0.1),
    "dm/s": ("m/s", 10),
    "m/s*5": ("m/s", 5),
    "cA": ("A", 100),
    "cV": ("V", 100),
    "c%": ("%", 100),
    "d%": ("%", 10),
    "cs": ("s", 100),
    "ds": ("s", 10),
}
BYTES = {"uint8_t", "char"}


def messages(path):
    reader = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    while (message := reader.recv_msg()) is not None:
        if message.get_type() != "BAD_DATA" and not message.get_type().startswith("UNKNOWN"):
            yield message


def numbers(message):
    """Returns numeric fields; elements of arrays of them, except arrays of many bytes."""
    lengths = dict(zip(message.ordered_fieldnames, message.array_lengths))
    types = dict(zip(message.fieldnames, message.fieldtypes))
    for field in message.fieldnames:
        value = getattr(message, field)
        if types[field] == "char" or (types[field] == "uint8_t" and lengths[field] > 16):
            continue
        if lengths[field]:
            for k, element in enumerate(value):
                yield field, f"{field}[{k}]", float(element)
        else:
            yield field, field, float(value)


def expect(expected, path, name):
    """Returns every number of every message, at the time of its receipt."""
    found = [m for m in messages(path) if m.get_type() not in ("PARAM_VALUE",)]
    senders, instances = {}, {}
    for message in found:
        kind = message.get_type()
        sender = (message.get_srcSystem(), message.get_srcComponent())
        senders.setdefault(kind, set()).add(sender)
        if message._instance_field:
            value = getattr(message, message._instance_field)
            instances.setdefault((kind, sender), set()).add(value)
    channels = {}
    for message in found:
        kind = message.get_type()
        sender = (message.get_srcSystem(), message.get_srcComponent())
        group = kind
        if len(senders[kind]) > 1:
            group += f"[{sender[0]}.{sender[1]}]"
        instance = message._instance_field
        several = len(instances.get((kind, sender), ())) > 1
        if several:
            group += f"[{getattr(message, instance)}]"
        for field, column, value in numbers(message):
            if several and field == instance:
                continue
            unit, divisor = UNITS.get(message.fieldunits_by_name.get(field), (None, 1))
            entry = channels.setdefault(f"{group}.{column}", (unit, []))
            entry[1].append((message._timestamp, value / divisor))
    for column, (unit, samples) in channels.items():
        samples = sorted_once(samples)
        if samples:
            times, values = zip(*samples)
            expected.channel(name, column, times, values, unit=unit)
