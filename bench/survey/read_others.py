"""Reads a log with the usual Python tool into columns or messages, timed: prints one `name
value` per line.

read_others.py TOOL FILE      TOOL: pandas, pyarrow, polars, rosbags, memory
"""

import pathlib
import resource
import sys
import time


def pandas(path):
    import pandas

    return lambda: pandas.read_csv(path).size


def pyarrow(path):
    import pyarrow
    from pyarrow import csv

    pyarrow.set_cpu_count(1)
    options = csv.ReadOptions(use_threads=False)

    def read():
        table = csv.read_csv(path, read_options=options)
        return table.num_rows * table.num_columns

    return read


def polars(path):
    # One thread, as for all others here: POLARS_MAX_THREADS=1.
    import polars

    def read():
        table = polars.read_csv(path)
        return table.height * table.width

    return read


def rosbags(path):
    """Decodes every message and keeps nothing."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)

    def read():
        count = 0
        with AnyReader([pathlib.Path(path)], default_typestore=store) as reader:
            for connection, _, content in reader.messages():
                reader.deserialize(content, connection.msgtype)
                count += 1
        return count

    return read


def memory(path):
    """Measures the time of reading the bytes of the file from memory once, summed as integers."""
    import numpy

    content = numpy.fromfile(path, numpy.uint8)
    content = content[: len(content) // 8 * 8].view(numpy.uint64)
    return lambda: content.sum()


def main():
    tool, path = sys.argv[1:]
    read = {
        "pandas": pandas,
        "pyarrow": pyarrow,
        "polars": polars,
        "rosbags": rosbags,
        "memory": memory,
    }[tool](path)
    used = lambda: sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    started, before = time.perf_counter(), used()
    count = read()
    print(
        f"read_s {time.perf_counter() - started:e}\nprocessor_s {used() - before:e}\ncount {count}"
    )


if __name__ == "__main__":
    main()
