"""Logs: files of any format that Seaplant reads, or numbers in memory."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from seaplant import _native, plots
from seaplant._channel import Channel
from seaplant._named import Named
from seaplant._record import Floats
from seaplant._results import Inspection
from seaplant._tables import Data, tables_of
from seaplant.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Channel", "Log"]


class Log(Named):
    """Named, timed, unit-bearing channels, each at its own times.

    Made by `Log.open` of files, or by `Log.of` of numbers in memory.
    """

    def __init__(self, native: _native.Log, /) -> None:
        self._native = native
        self._channels = tuple(Channel(*of) for of in native.channels())

    @classmethod
    def open(
        cls,
        *paths: str | PathLike[str],
        time: str | None = None,
        time_unit: str | None = None,
        equal_sampling_hz: float | None = None,
        sheet: str | None = None,
        stamp: Literal["header", "receive"] = "header",
        offset_s: Mapping[str, float] | None = None,
    ) -> Log:
        """Reads files that were logged simultaneously.

        Parameters
        ----------
        *paths
            The files: CSV, Excel, Parquet, Arrow, MATLAB, ROS bags, ArduPilot, PD0, NMEA and
            whatever else the command line reads; the format is detected from content.
        time
            The time column, if its name does not say so.
        time_unit
            Its unit, if the header does not state it.
        equal_sampling_hz
            The rate of tables without a time column, Hz.
        sheet
            The sheet of a workbook; its first if not given.
        stamp
            Which time of a ROS message counts.
        offset_s
            Seconds to add to the clock of a file, by its path as given.

        Returns
        -------
        Log
            The channels of all files.

        Raises
        ------
        FileError
            If the system does not give a file.
        InputError
            If a file is no log.
        """
        offsets = dict(offset_s or {})
        names = [str(path) for path in paths]
        if stray := set(offsets) - set(names):
            raise InputError(
                f"offset_s names {sorted(stray)}, which is none of the files given"
            )
        native = _native.Log.open(
            [Path(path) for path in paths],
            offsets_s=[offsets.get(name, 0.0) for name in names],
            time=time,
            time_unit=time_unit,
            equal_sampling_hz=equal_sampling_hz,
            sheet=sheet,
            receive=stamp == "receive",
        )
        return cls(native)

    @classmethod
    def of(
        cls,
        *tables: Data,
        units: Mapping[str, str] | None = None,
        time: str | None = None,
        time_unit: str | None = None,
        name: str = "arrays",
    ) -> Log:
        """Makes a log of numbers in memory, with explicit units.

        Parameters
        ----------
        *tables
            Each a mapping of names to arrays of shape (n,), a pandas or polars frame, or an
            xarray dataset, whose series may run along several clocks; several tables for
            instruments with their own times.
        units
            The unit of each column that does not state it in its name (``"u [m/s]"``) or, in
            a dataset, in its attribute ``units``.
        time
            The column, index or coordinate that holds time. If not given, the column with a
            name of time, as in files (``time [s]``, ``Time``, ``t_ms``, ``timestamp``), or the
            frame's index if that has such a name, holds instants or durations, or has no name
            and holds fractions: an index that may count rows is refused.
        time_unit
            The unit of times that are plain numbers, if neither name nor attribute states it;
            seconds if nothing does.
        name
            What messages and provenance call the log.

        Returns
        -------
        Log
            Rows sorted by time; repeated times and missing values are dropped with a note.

        Raises
        ------
        InputError
            If there is no time, an array has another length or a unit is unknown.

        Examples
        --------
        >>> import seaplant as sp
        >>> sp.Log.of({"time": [0.0, 1.0], "depth": [5.0, 5.5]}, units={"depth": "m"})["depth"]
        <Channel 'depth' [m], 2 samples, 0 to 1 s>
        """
        stated = dict(units or {})
        read = [of for data in tables for of in tables_of(data, time, time_unit)]
        made = []
        for number, (time_s, columns) in enumerate(read, start=1):
            listed = [
                (header, stated.get(header, unit), values) for header, unit, values in columns
            ]
            made.append((f"{name} {number}" if len(read) > 1 else name, time_s, listed))
        known = {header for _, _, listed in made for header, _, _ in listed}
        if stray := set(stated) - known:
            found = ", ".join(sorted(known))
            raise InputError(f"units names {sorted(stray)}, and the columns are {found}")
        return cls(_native.Log.of_tables(name, made))

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Every channel, in the order of the files and of their columns."""
        return self._channels

    @property
    def notes(self) -> list[str]:
        """Notes on what the reader assumed or dropped."""
        return self._native.notes()

    def inspect(self) -> Inspection:
        """Inspects every channel, as ``seaplant inspect`` does.

        Returns
        -------
        Inspection
            Rates, spans, gaps, ranges, and what is odd about them.
        """
        return Inspection.from_dict(json.loads(self._native.inspect()))

    def __getitem__(self, name: str) -> Channel:
        """Finds a channel by header or name, ignoring case; or as ``FILE:COLUMN``."""
        try:
            return self._channels[self._native.place(name)]
        except InputError as error:
            raise _NoChannelError(str(error)) from None

    def __iter__(self) -> Iterator[Channel]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self._channels)

    def __repr__(self) -> str:
        names = ", ".join(channel.column for channel in self._channels[:6])
        more = f" and {len(self) - 6} more" if len(self) > 6 else ""
        return f"<Log of {len(self)} channels: {names}{more}>"

    def _repr_html_(self) -> str:
        frame = self.summary()
        return str(frame.to_html(index=False))

    def summary(self) -> pd.DataFrame:
        """Returns the channels as a table.

        Returns
        -------
        pandas.DataFrame
            A row for each channel: column, unit, samples, rate, span, range, remarks.
        """
        import pandas as pd

        fields = [
            "column",
            "unit",
            "count",
            "rate_hz",
            "first_s",
            "last_s",
            "gaps",
            "min",
            "max",
        ]
        rows = [
            {
                **{field: getattr(of, field) for field in fields},
                "remarks": "; ".join(of.remarks),
            }
            for of in self.inspect().channels
        ]
        return pd.DataFrame(rows)

    def plot(self, *only: str) -> Figure:
        """Draws the channels as a stack, over time since the log's first sample.

        Parameters
        ----------
        *only
            Parts of the names of those to draw, whatever the case; without any, all that vary.

        Returns
        -------
        matplotlib.figure.Figure
            A panel for each channel; ``from_s`` and ``to_s`` of a trial can be read off it.

        Raises
        ------
        InputError
            If there is no such channel.
        """
        words = [word.lower() for word in only]
        drawn = [channel for channel in self if _is_wanted(channel, words)]
        if not drawn:
            found = ", ".join(channel.column for channel in self)
            raise InputError(f"no channel to draw; the log has {found}")
        return plots.channels(drawn, min(float(of.time_s[0]) for of in self))

    def to_pandas(self) -> pd.DataFrame:
        """Returns the channels side by side.

        Returns
        -------
        pandas.DataFrame
            A column for each channel, a row for each time in s of any of them; ``NaN`` where
            a channel was not sampled.
        """
        import pandas as pd

        return pd.concat([channel.to_pandas() for channel in self], axis=1).sort_index()

    def to_xarray(self) -> xr.Dataset:
        """Returns the channels as a dataset.

        Returns
        -------
        xarray.Dataset
            A variable for each channel along its own time, s, with its unit as attribute
            ``units``; channels that share their times share the dimension.
        """
        import xarray as xr

        dims: dict[bytes, str] = {}
        variables = {}
        coords = {}
        for channel in self:
            dim = dims.setdefault(channel.time_s.tobytes(), f"time_{len(dims)}")
            coords[dim] = (dim, channel.time_s, {"units": "s"})
            attributes = {"units": channel.unit} if channel.unit else {}
            variables[channel.column] = (dim, channel.values, attributes)
        return xr.Dataset(variables, coords=coords)

    def __reduce__(self) -> tuple[Any, ...]:
        return _remade, (self._channels,)


class _NoChannelError(InputError, KeyError):
    """A log without the requested channel."""

    def __str__(self) -> str:
        return str(self.args[0])


def _is_wanted(channel: Channel, words: Iterable[str]) -> bool:
    """Returns whether a column contains a word; without words, whether the channel varies."""
    wanted = list(words)
    if not wanted:
        return bool(channel.values.min() != channel.values.max())
    return any(word in channel.column.lower() for word in wanted)


def _remade(channels: Iterable[Channel]) -> Log:
    tables: dict[bytes, tuple[str, Floats, list[tuple[str, str | None, Floats]]]] = {}
    name = "arrays"
    for channel in channels:
        name = channel.file
        table = tables.setdefault(channel.time_s.tobytes(), (name, channel.time_s, []))
        table[2].append((channel.column, channel.unit, channel.values))
    return Log(_native.Log.of_tables(name, list(tables.values())))
