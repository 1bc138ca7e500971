"""Tables in memory of any type: arrays, frames, datasets."""

from __future__ import annotations

import numbers
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from seaplant import _native
from seaplant._record import Floats
from seaplant.errors import InputError

Data: TypeAlias = Any
"""A mapping of arrays, a pandas or polars frame, or an xarray dataset."""

_Column: TypeAlias = tuple[str, str | None, Floats]
_CONVERT = "convert it with pandas.to_numeric, or pandas.to_datetime, or leave it out"

_Named: TypeAlias = dict[str, tuple[str | None, ArrayLike]]


def tables_of(
    data: Data, time: str | None, time_unit: str | None
) -> Iterator[tuple[Floats, list[_Column]]]:
    """Returns times in s and the columns of a table; of a dataset, one table per clock."""
    if hasattr(data, "data_vars"):
        for clock in _clocks(data) if time is None else [time]:
            yield _table(dict(_series(data, clock)), clock, time_unit)
    elif hasattr(data, "index") and hasattr(data, "columns"):
        yield _table(*_of_pandas(data, time, time_unit), time_unit)
    else:
        yield _table(dict(_columns(data)), time, time_unit)


def _table(
    columns: _Named, time: str | None, time_unit: str | None
) -> tuple[Floats, list[_Column]]:
    name, second = _time_column(columns, time, time_unit)
    time_s = _seconds(name, columns.pop(name)[1], second)
    return time_s, [
        (header, unit, floats(f"column {header!r}", of))
        for header, (unit, of) in columns.items()
    ]


def _time_column(
    columns: _Named, time: str | None, time_unit: str | None
) -> tuple[str, float | None]:
    """Finds the time column, as in a CSV file, and the seconds in its unit, if stated."""
    found = _native.time_column(_headers(columns), time, time_unit)
    if found is None:
        raise InputError(f"found no time column among {', '.join(columns)}; name it with time=")
    place, second = found
    return list(columns)[place], second


def _headers(columns: _Named) -> list[tuple[str, str | None]]:
    return [(name, _time_unit(unit)) for name, (unit, _) in columns.items()]


def _time_unit(unit: str | None) -> str | None:
    """Parses the unit in ``seconds since 2026-05-01``, as climate files write it."""
    return unit if unit is None else unit.split(" since ")[0]


def _clocks(data: Data) -> list[str]:
    """Returns the coordinates of a dataset's series."""
    found = {str(of.dims[0]): None for of in data.data_vars.values() if of.ndim == 1}
    return list(found)


def _series(data: Data, clock: str) -> Iterator[tuple[str, tuple[str | None, ArrayLike]]]:
    """Returns the series along one coordinate of a dataset, including the coordinate."""
    if clock not in data.coords and clock not in data.data_vars:
        # By default xarray would number the rows instead.
        known = ", ".join(map(str, data.coords)) or "none"
        raise InputError(
            f"the dimension {clock!r} has no coordinate that says when (the coordinates are "
            f"{known}); assign its times"
        )
    for name in [*data.coords, *data.data_vars]:
        of = data[name]
        if of.dims == (clock,) or name == clock:
            yield str(name), (of.attrs.get("units"), of.to_numpy())


def _of_pandas(
    data: Data, time: str | None, time_unit: str | None
) -> tuple[_Named, str | None]:
    """Returns the columns of a frame and its time, which is a column or the index."""
    names = [str(name) for name in data.columns]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"the frame has several columns called {twice[0]!r}; rename them")
    columns: _Named = {
        name: (None, _pandas_values(data[of]))
        for name, of in zip(names, data.columns, strict=True)
    }
    if time in columns:
        return columns, time
    if time is None and _native.time_column(_headers(columns), None, time_unit) is not None:
        return columns, None
    name = _index_name(data.index, time, ", ".join(columns))
    if name in columns:
        raise InputError(f"the index and a column are both called {name!r}; rename one")
    return {name: (None, _pandas_values(data.index)), **columns}, name


def _index_name(index: Any, time: str | None, columns: str) -> str:
    """Returns the name of the index, if it can be time."""
    if index.nlevels > 1:
        raise InputError(
            "the frame's index has several levels; name the time column with time="
        )
    name = None if index.name is None else str(index.name)
    if time is not None and time != name:
        raise InputError(
            f"found no column {time!r} among {columns}, and the index has another name"
        )
    if time is not None or index.dtype.kind in "mM":
        return name or "time"
    # An unnamed index of fractions was set by the user; integers may be row numbers.
    if name is None and index.dtype.kind == "f" and not _counts_rows(index):
        return "time"
    if name is None:
        raise InputError(
            f"found no time column among {columns}, and the frame's index has no name, so that "
            "it may count rows; name the time column with time=, or the index: "
            "frame.index.name = 'time [s]'"
        )
    if _native.time_column([(name, None)], None, None) is None:
        raise InputError(
            f"found no time column among {columns}, and the index is called {name!r}, which is "
            "no name of time; say with time= which one holds time"
        )
    return name


def _counts_rows(index: Any) -> bool:
    """Returns whether every step of an index is one, as in row numbers."""
    return bool(np.all(np.diff(index.to_numpy()) == 1.0))


def _pandas_values(of: Any) -> ArrayLike:
    """Returns the values of a series or an index, in NumPy's types."""
    dtype = of.dtype
    if isinstance(dtype, np.dtype):
        return np.asarray(of.to_numpy())
    if getattr(dtype, "tz", None) is not None:
        instants = getattr(of, "dt", of).tz_convert("UTC")
        return np.asarray(getattr(instants, "dt", instants).tz_localize(None).to_numpy())
    from pandas.api.types import is_numeric_dtype

    if is_numeric_dtype(dtype):
        return np.asarray(of.to_numpy(dtype=np.float64, na_value=np.nan))
    return np.asarray(of.to_numpy())


def _columns(data: Data) -> Iterator[tuple[str, tuple[str | None, ArrayLike]]]:
    if hasattr(data, "get_columns"):
        for of in data.get_columns():
            yield of.name, (None, of.to_numpy())
    elif isinstance(data, Mapping):
        for name, values in data.items():
            yield str(name), (None, values)
    else:
        kind = type(data).__name__
        raise InputError(
            f"expected a table (a mapping of arrays, a pandas or polars frame, or an xarray "
            f"dataset), found {kind}"
        )


def _seconds(name: str, values: ArrayLike, second: float | None) -> Floats:
    """Returns times in s; ``NaN`` where there is none."""
    array, absent = _unmasked(values)
    if array.dtype.kind in "mM":
        unit = "datetime64[ns]" if array.dtype.kind == "M" else "timedelta64[ns]"
        # Integer nanoseconds first: a float for seconds since 1970 resolves only a quarter of a
        # µs.
        whole = array.astype(unit).astype(np.int64)
        return np.where(absent | np.isnat(array), np.nan, whole / 1e9)
    counts = floats(f"time column {name!r}", values)
    # As in a CSV file, the magnitude of counts since 1970 determines their unit.
    return counts * (_native.calendar_second(counts) if second is None else second)


def floats(what: str, values: ArrayLike) -> Floats:
    """Returns numbers of shape (n,); ``NaN`` where one is masked or absent."""
    try:
        array, absent = _unmasked(values)
    except ValueError as error:
        raise InputError(f"{what} cannot be read as an array: {error}") from error
    if array.ndim != 1:
        raise InputError(f"{what} has {array.ndim} dimensions; give an array of shape (n,)")
    found = _real(what, array).astype(np.float64)
    return np.where(absent, np.nan, found)


def _unmasked(values: ArrayLike) -> tuple[NDArray[Any], NDArray[np.bool_] | np.bool_]:
    """Returns an array and its mask."""
    if np.ma.isMaskedArray(values):
        return np.asarray(np.ma.getdata(values)), np.ma.getmaskarray(values)
    return np.asarray(values), np.bool_(False)


def _real(what: str, array: NDArray[Any]) -> NDArray[Any]:
    """Returns an array of real numbers; complex ones would lose a part, texts are ambiguous."""
    kind = array.dtype.kind
    if kind in "fiub":
        return array
    if kind == "O":
        return np.array([_number(what, row, of) for row, of in enumerate(array)])
    if kind == "c":
        raise InputError(f"{what} holds complex numbers; give their real part or their modulus")
    held = {"U": "text", "S": "text", "T": "text", "M": "instants", "m": "durations"}
    found = held.get(kind, f"values of type {array.dtype}")
    raise InputError(f"{what} holds {found}, not numbers; {_CONVERT}")


def _number(what: str, row: int, of: object) -> float:
    """Returns one number of an array of objects; ``None`` and pandas' ``NA`` are absent."""
    if of is None or type(of).__name__ in {"NAType", "MaskedConstant"}:
        return float("nan")
    if isinstance(of, numbers.Real | Decimal):
        return float(of)
    kind = type(of).__name__
    raise InputError(f"{what} holds a {kind} in row {row}, not a number; {_CONVERT}")
