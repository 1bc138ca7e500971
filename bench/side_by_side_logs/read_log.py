"""Reads a log with pymavlink into columns of numbers, timed: prints one `name value` a line."""

import os
import sys
import time

os.environ["MAVLINK20"] = "1"

from pymavlink import DFReader, mavutil

ABOUT_THE_LOG = {"FMT", "FMTU", "UNIT", "MULT"}


def flash(path):
    reader = DFReader.DFReader_binary(path)
    columns = {}
    while (message := reader.recv_msg()) is not None:
        form = message.fmt
        if form.name in ABOUT_THE_LOG:
            continue
        key = (
            form.name,
            message.__getattr__(form.instance_field) if form.instance_field else 0,
        )
        if key not in columns:
            columns[key] = [[] for _ in form.columns]
        for column, field in zip(columns[key], form.columns):
            column.append(message.__getattr__(field))
    return columns


def telemetry(path):
    reader = mavutil.mavlink_connection(path, dialect="ardupilotmega")
    columns = {}
    while (message := reader.recv_msg()) is not None:
        key = (message.id, message.get_srcSystem(), message.get_srcComponent())
        if key not in columns:
            columns[key] = [[] for _ in range(1 + len(message._fieldnames))]
        into = columns[key]
        into[0].append(message._timestamp)
        for column, field in zip(into[1:], message._fieldnames):
            column.append(getattr(message, field))
    return columns


def main():
    path = sys.argv[1]
    started = time.perf_counter()
    columns = flash(path) if path.endswith(".BIN") else telemetry(path)
    print(f"read_s {time.perf_counter() - started:e}")
    print(f"records {sum(len(of_kind[0]) for of_kind in columns.values())}")


if __name__ == "__main__":
    main()
