"""Channels of logs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from seaplant._named import Named
from seaplant._record import Floats

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Channel(Named):
    """One measured or commanded quantity over time.

    Attributes
    ----------
    name
        Its header without the unit.
    column
        Its header.
    unit
        The unit that the header, or whoever made the log, states.
    file
        The file that it came from.
    missing
        How many rows had no value.
    time_s
        Times in the file's own clock, s, shape (n,).
    values
        Values in ``unit``, shape (n,).
    """

    name: str
    column: str
    unit: str | None
    file: str
    missing: int
    time_s: Floats
    values: Floats

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        unit = self.unit or "no unit"
        span = f"{self.time_s[0]:.6g} to {self.time_s[-1]:.6g} s"
        return f"<Channel {self.name!r} [{unit}], {len(self)} samples, {span}>"

    def to_pandas(self) -> pd.Series[float]:
        """Returns the channel as a series.

        Returns
        -------
        pandas.Series
            Values by time in s, called as the column is.
        """
        import pandas as pd

        index = pd.Index(self.time_s, name="time_s")
        return pd.Series(self.values, index=index, name=self.column)
