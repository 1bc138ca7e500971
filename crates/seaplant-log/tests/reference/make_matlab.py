"""Writes MATLAB files: of version 5 by SciPy, of version 7.3 in MATLAB's layout by h5py.

python3 make_matlab.py FOLDER
"""

import pathlib
import shutil
import struct
import sys

import h5py
import numpy as np
import scipy.io
import scipy.sparse
from expected import Expected

RANDOM = np.random.default_rng(7)
CLASSES = [
    "float64",
    "float32",
    "int8",
    "uint8",
    "int16",
    "uint16",
    "int32",
    "uint32",
    "int64",
    "uint64",
]


def variables():
    """Returns the content of the logs, and their channels as (column, time vector, values)."""
    t = np.arange(100) / 10
    fast = 5 + np.arange(300) / 50
    held, channels = {"t": t}, []
    for k, name in enumerate(CLASSES):
        kind = np.dtype(name)
        if kind.kind == "f":
            values = RANDOM.normal(size=100).astype(kind)
            values[k + 3] = np.nan
        else:
            limits = np.iinfo(kind)
            values = RANDOM.integers(limits.min, limits.max, 100, kind, endpoint=True)
        held[f"c_{name}"] = values if k % 2 else values.reshape(-1, 1)
        channels.append((f"c_{name}", t, values))
    held["armed"] = t > 4
    channels.append(("armed", t, held["armed"]))
    held["tall"] = RANDOM.normal(size=(100, 3))
    held["wide"] = RANDOM.normal(size=(2, 100))
    channels += [(f"tall(:,{k + 1})", t, held["tall"][:, k]) for k in range(3)]
    channels += [(f"wide({k + 1},:)", t, held["wide"][k]) for k in range(2)]
    held["deep"] = RANDOM.normal(size=(1, 1, 100))
    channels.append(("deep", t, held["deep"].ravel()))
    held["dvl"] = {
        "time": fast,
        "u": RANDOM.normal(size=300),
        "beams": {"ranges": RANDOM.normal(size=(300, 4))},
        "on_t": RANDOM.normal(size=100),
    }
    channels.append(("dvl.u", fast, held["dvl"]["u"]))
    for k in range(4):
        channels.append(
            (f"dvl.beams.ranges(:,{k + 1})", fast, held["dvl"]["beams"]["ranges"][:, k])
        )
    channels.append(("dvl.on_t", t, held["dvl"]["on_t"]))
    held["mass"] = 23.5
    held["gains"] = np.array([1.0, 2.0, 3.0])
    return held, channels


def expect(expected, file, channels):
    for column, times, values in channels:
        expected.channel(file, column, times, values)


def version_5(folder, expected):
    held, channels = variables()
    held["vehicle"] = "Bolt"
    held["steps"] = np.array([np.zeros(3), "two"], dtype=object)
    held["thrusters"] = np.array([(1.0, 2.0), (3.0, 4.0)], dtype=[("x", object), ("y", object)])
    held["grid"] = scipy.sparse.eye_array(5, format="csc")
    held["echo"] = np.exp(1j * np.arange(100))
    held["none"] = np.zeros((0, 0))
    for name, compressed, oned_as in [("v5.mat", False, "column"), ("v7.mat", True, "row")]:
        scipy.io.savemat(folder / name, held, do_compression=compressed, oned_as=oned_as)
        expect(expected, name, channels)
    # A time of another name; days of the calendar; no time at all.
    clock = 1700000000.25 + np.arange(50)
    scipy.io.savemat(
        folder / "named.mat", {"u": clock * 2, "ms": clock * 1e3, "log": {"v": -clock}}
    )
    expect(expected, "named.mat", [("u", clock, clock * 2), ("log.v", clock, -clock)])
    days = clock / 86400 + 719529
    scipy.io.savemat(folder / "days.mat", {"time": days, "u": clock * 2})
    expect(expected, "days.mat", [("u", clock, clock * 2)])
    table = np.column_stack([clock, RANDOM.normal(size=(50, 2))])
    rows = np.vstack([np.arange(70.0), RANDOM.normal(size=(2, 70))])
    scipy.io.savemat(folder / "matrix.mat", {"log": table, "nav": {"rows": rows}})
    expect(expected, "matrix.mat", [(f"log(:,{k})", clock, table[:, k - 1]) for k in (2, 3)])
    expect(
        expected,
        "matrix.mat/rows",
        [(f"nav.rows({k},:)", rows[0], rows[k - 1]) for k in (2, 3)],
    )
    even = {
        "u": np.arange(8.0),
        "v": np.arange(8.0) + 1,
        "w": np.ones((8, 2)),
        "odd": np.arange(9.0),
    }
    scipy.io.savemat(folder / "even.mat", even)
    equal = np.arange(8) / 4
    expect(
        expected,
        "even.mat",
        [
            ("u", equal, even["u"]),
            ("v", equal, even["v"]),
            ("w(:,1)", equal, even["w"][:, 0]),
            ("w(:,2)", equal, even["w"][:, 1]),
        ],
    )
    seed = {
        "t": np.arange(6.0),
        "nav": {"time": np.arange(5.0), "u": np.ones(5), "w": np.ones((5, 2))},
        "name": "x",
        "cells": np.array([1.0, "two"], dtype=object),
        "flag": np.arange(6) > 2,
    }
    scipy.io.savemat(folder / "seed5.mat", seed)
    scipy.io.savemat(folder / "seed7.mat", seed, do_compression=True)


def big_endian(folder, expected):
    """Writes elements that no current program writes, by the description of the format."""

    def element(kind, body):
        return struct.pack(">II", kind, len(body)) + body + bytes(-len(body) % 8)

    def small(kind, body):
        return struct.pack(">HH", len(body), kind) + body.ljust(4, b"\0")

    def matrix(name, numbers, kind, code):
        dimensions = element(5, struct.pack(">ii", len(numbers), 1))
        title = small(1, name) if len(name) <= 4 else element(1, name)
        body = element(6, struct.pack(">II", 6, 0)) + dimensions + title
        return element(
            14, body + element(kind, struct.pack(f">{len(numbers)}{code}", *numbers))
        )

    times, depth, pulse = (
        [k / 8 for k in range(40)],
        [k * k / 7 for k in range(40)],
        range(1500, 1540),
    )
    text = b"MATLAB 5.0 MAT-file, Platform: SOL2".ljust(124) + b"\x01\x00MI"
    text += (
        matrix(b"t", times, 9, "d")
        + matrix(b"depth", depth, 9, "d")
        + matrix(b"T1", pulse, 4, "H")
    )
    (folder / "big.mat").write_bytes(text)
    expect(expected, "big.mat", [("depth", times, depth), ("T1", times, pulse)])


def matlab_73(path, held):
    """Writes as MATLAB does: classes as attributes, reversed dimensions, cells as references."""

    def text(of, name, value):
        of.attrs[name] = np.bytes_(value)

    def put(group, name, value):
        if isinstance(value, dict):
            inner = group.create_group(name)
            text(inner, "MATLAB_class", "struct")
            for field, of in value.items():
                put(inner, field, of)
            return
        if isinstance(value, str):
            codes = np.array([[ord(c)] for c in value], np.uint16)
            text(group.create_dataset(name, data=codes), "MATLAB_class", "char")
            return
        value = np.atleast_1d(np.asarray(value))
        if value.ndim == 1:
            value = value.reshape(-1, 1)
        kind = {"float64": "double", "float32": "single", "bool": "logical"}.get(
            value.dtype.name, value.dtype.name
        )
        stored = np.ascontiguousarray(
            value.T.astype(np.uint8) if kind == "logical" else value.T
        )
        packed = {"compression": "gzip", "shuffle": True} if value.size > 200 else {}
        data = group.create_dataset(name, data=stored, **packed)
        text(data, "MATLAB_class", kind)

    with h5py.File(path, "w", userblock_size=512, libver=("earliest", "v108")) as file:
        for name, value in held.items():
            put(file, name, value)
        refs = file.create_group("#refs#")
        for k in range(2):
            put(refs, "ab"[k], np.arange(3.0))
        pointers = np.array([[refs["a"].ref], [refs["b"].ref]], dtype=h5py.ref_dtype)
        text(
            file.create_dataset("steps", data=pointers, dtype=h5py.ref_dtype),
            "MATLAB_class",
            "cell",
        )
        thrusters = file.create_group("thrusters")
        text(thrusters, "MATLAB_class", "struct")
        thrusters.create_dataset("x", data=pointers, dtype=h5py.ref_dtype)
        table = file.create_dataset("trials", data=np.zeros((1, 6), np.uint32))
        text(table, "MATLAB_class", "table")
        table.attrs["MATLAB_object_decode"] = np.int32(3)
        sparse = file.create_group("grid")
        text(sparse, "MATLAB_class", "double")
        sparse.attrs["MATLAB_sparse"] = np.uint64(5)
        put(sparse, "data", np.ones(5))
        pair = np.zeros((1, 100), [("real", "f8"), ("imag", "f8")])
        text(file.create_dataset("echo", data=pair), "MATLAB_class", "double")
        none = file.create_dataset("none", data=np.zeros(2, np.uint64))
        text(none, "MATLAB_class", "double")
        none.attrs["MATLAB_empty"] = np.uint8(1)
    header = (
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64, HDF5 schema 1.00 .".ljust(124) + b"\x00\x02IM"
    )
    with open(path, "r+b") as file:
        file.write(header)


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)
    version_5(folder, expected)
    big_endian(folder, expected)
    held, channels = variables()
    matlab_73(folder / "v73.mat", {**held, "vehicle": "Bolt"})
    expect(expected, "v73.mat", channels)
    matlab_73(
        folder / "seed73.mat",
        {
            "t": np.arange(6.0),
            "u": np.ones((6, 2)),
            "nav": {"time": np.arange(300.0), "u": np.arange(300.0)},
        },
    )

    # Old files by MATLAB itself, from SciPy's own tests.
    tests = pathlib.Path(scipy.io.__file__).parent / "matlab/tests/data"
    for path in [
        *tests.glob("testdouble_[67]*"),
        *tests.glob("testmatrix_[67]*"),
        *tests.glob("testhdf5*"),
    ]:
        shutil.copy(path, folder)
        if path.name.startswith("testhdf5"):
            continue
        held = {k: v for k, v in scipy.io.loadmat(path).items() if not k.startswith("__")}
        for column, value in held.items():
            if 1 in value.shape:
                expected.channel(path.name, column, range(value.size), value.ravel())
                continue
            for k in range(value.shape[1]):
                expected.channel(
                    path.name, f"{column}(:,{k + 1})", range(value.shape[0]), value[:, k]
                )
    for name, columns in [("table.mat", ["trials"]), ("datetime.mat", ["t", "u"])]:
        with h5py.File(folder / name, "w", userblock_size=512) as file:
            for column in columns:
                data = file.create_dataset(
                    column, data=np.ones((1, 6), "f8" if column == "u" else "u4")
                )
                data.attrs["MATLAB_class"] = np.bytes_(
                    {"t": "datetime", "u": "double"}.get(column, "table")
                )

    # Not MATLAB's: groups of columns, with units, in the order of C.
    times = np.arange(40) / 4
    with h5py.File(folder / "log.h5", "w") as file:
        imu = file.create_group("imu")
        imu["time"] = times
        imu["time"].attrs["units"] = "s"
        imu["rate"] = RANDOM.normal(size=(40, 3))
        imu["rate"].attrs["units"] = "deg/s"
        imu["still"] = times < 2
        imu["name"] = "unit 4"
        imu.create_dataset("planned", (40,), "f8")
        imu.create_dataset("begun", (40,), "f8", chunks=(10,))[:15] = 1
        for k in range(3):
            expected.channel(
                "log.h5", f"imu.rate(:,{k + 1})", times, imu["rate"][:, k], unit="deg/s"
            )
        expected.channel("log.h5", "imu.still", times, imu["still"][:])
    expected.save()


main()
