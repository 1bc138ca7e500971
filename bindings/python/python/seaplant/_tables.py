"""Tables in memory, whatever holds them: arrays, frames, datasets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from seaplant._record import Floats
from seaplant.errors import InputError

Data: TypeAlias = Any
"""A mapping of arrays, a pandas or polars frame, or an xarray dataset."""

_TIME_NAMES = ("time", "time_s", "t", "timestamp")
TIME_FACTORS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}


_Column: TypeAlias = tuple[str, str | None, Floats]


def tables_of(
    data: Data, time: str | None, factor: float
) -> Iterator[tuple[Floats, list[_Column]]]:
    """Times in s and the columns of a table, whatever holds it; of a dataset, one a clock."""
    if hasattr(data, "data_vars"):
        for clock in _clocks(data) if time is None else [time]:
            yield _table(dict(_series(data, clock)), clock, factor)
    else:
        yield _table(dict(_columns(data, time)), time, factor)


_Named: TypeAlias = dict[str, tuple[str | None, ArrayLike]]


def _table(columns: _Named, time: str | None, factor: float) -> tuple[Floats, list[_Column]]:
    names = [time] if time is not None else [of for of in _TIME_NAMES if of in columns]
    if not names or names[0] not in columns:
        found = ", ".join(map(str, columns))
        raise InputError(f"no time among {found}; name the column with time=")
    time_s = _seconds(columns.pop(names[0])[1], factor)
    return time_s, [
        (header, unit, _floats(header, of)) for header, (unit, of) in columns.items()
    ]


def _clocks(data: Data) -> list[str]:
    """The coordinates along which a dataset's series run."""
    found = {str(of.dims[0]): None for of in data.data_vars.values() if of.ndim == 1}
    return list(found)


def _series(data: Data, clock: str) -> Iterator[tuple[str, tuple[str | None, ArrayLike]]]:
    """What runs along one coordinate of a dataset, itself included."""
    for name in [*data.coords, *data.data_vars]:
        of = data[name]
        if of.dims == (clock,) or name == clock:
            yield str(name), (of.attrs.get("units"), of.to_numpy())


def _columns(
    data: Data, time: str | None
) -> Iterator[tuple[str, tuple[str | None, ArrayLike]]]:
    if hasattr(data, "index") and hasattr(data, "columns"):
        has_time = time in data.columns or any(of in data.columns for of in _TIME_NAMES)
        if not has_time:
            yield time or "time", (None, data.index.to_numpy())
        for name in data.columns:
            yield str(name), (None, data[name].to_numpy())
    elif hasattr(data, "get_columns"):
        for of in data.get_columns():
            yield of.name, (None, of.to_numpy())
    elif isinstance(data, Mapping):
        for name, values in data.items():
            yield str(name), (None, values)
    else:
        kind = type(data).__name__
        raise InputError(
            f"a {kind} is no table; give a mapping of arrays, a frame or a dataset"
        )


def _seconds(values: ArrayLike, factor: float) -> Floats:
    array = np.asarray(values)
    if array.dtype.kind == "M":
        # Whole nanoseconds first: seconds since 1970 in one float keep but a quarter of a µs.
        whole = array.astype("datetime64[ns]").astype(np.int64)
        return np.asarray(whole / 1e9, dtype=np.float64)
    if array.dtype.kind == "m":
        return np.asarray(array / np.timedelta64(1, "ns") / 1e9, dtype=np.float64)
    return _floats("time", array) * factor


def _floats(name: str, values: ArrayLike) -> Floats:
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"column {name!r} holds no numbers: {error}") from error
    if array.ndim != 1:
        raise InputError(f"column {name!r} has {array.ndim} dimensions; give one value a row")
    return array
