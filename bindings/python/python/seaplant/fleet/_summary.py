"""Parameters over dives: scatter, drift with date and payload, outliers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from seaplant._record import Floats
from seaplant.fleet._dives import PARAMETERS

if TYPE_CHECKING:
    import pandas as pd

LEAST_DIVES = 5
"""Fewer dives tell no trend."""

OUTLIER = 3.5
"""Robust standard deviations beyond which a dive stands out: one in two thousand by chance."""

_MAD = 1.4826
"""From the median absolute deviation to the standard deviation of a normal distribution."""


@dataclass(frozen=True)
class Slope:
    """Change of a parameter with another quantity: the median slope of all pairs (Theil, Sen).

    Attributes
    ----------
    value
        Change of the parameter for each unit.
    low95
        Lower end of its 95 % interval.
    high95
        Upper end of it.
    unit
        Of what it changes with: ``year`` or ``kg``.
    """

    value: float
    low95: float
    high95: float
    unit: str

    @property
    def is_sure(self) -> bool:
        """True if the interval excludes zero change."""
        return self.low95 > 0.0 or self.high95 < 0.0


@dataclass(frozen=True)
class Trend:
    """One parameter of one degree of freedom over dives.

    Attributes
    ----------
    dof
        Which degree of freedom.
    parameter
        Which parameter.
    unit
        Its unit.
    dives
        How many dives have it.
    median
        Its median.
    scatter
        Its robust standard deviation over dives, what changes with the date taken out.
    expected
        The median of what its own intervals say it should be.
    with_date
        How it changes a year; ``None`` if dates are missing or all alike.
    with_payload
        How it changes a kg of payload; ``None`` likewise.
    outliers
        The dives that stand out by more than 3.5 standard deviations.
    """

    dof: str
    parameter: str
    unit: str
    dives: int
    median: float
    scatter: float
    expected: float
    with_date: Slope | None
    with_payload: Slope | None
    outliers: tuple[str, ...]


@dataclass(frozen=True)
class Summary:
    """Trends over a fleet.

    Attributes
    ----------
    trends
        One for each degree of freedom and parameter.
    caveats
        How many plants have each caveat, by its code.
    failures
        How many rows are failures.
    """

    trends: tuple[Trend, ...]
    caveats: dict[str, int]
    failures: int

    def to_pandas(self) -> pd.DataFrame:
        """Returns the trends as a table.

        Returns
        -------
        pandas.DataFrame
            A row for each trend.
        """
        import pandas as pd

        rows = []
        for of in self.trends:
            row = {**vars(of), "outliers": ", ".join(of.outliers)}
            for name in ("with_date", "with_payload"):
                slope: Slope | None = row.pop(name)
                for part in ("value", "low95", "high95"):
                    row[f"{name}_{part}"] = None if slope is None else getattr(slope, part)
            rows.append(row)
        return pd.DataFrame(rows)


def summarise(frame: pd.DataFrame) -> Summary:
    """Analyses every degree of freedom and parameter of the rows of a fleet."""
    found = frame[frame["status"] == "found"]
    trends = []
    for dof, rows in found.groupby("dof", sort=False):
        for parameter in PARAMETERS:
            of = rows[rows[parameter].notna()]
            if len(of) > 0:
                trends.append(_trend(str(dof), parameter, of))
    codes = found["caveats"].explode().dropna().value_counts()
    caveats = {str(code): int(times) for code, times in codes.items()}
    return Summary(tuple(trends), caveats, int((frame["status"] == "failed").sum()))


def _trend(dof: str, parameter: str, rows: pd.DataFrame) -> Trend:
    values = rows[parameter].to_numpy(dtype=np.float64)
    stds = rows[f"{parameter}_std"].to_numpy(dtype=np.float64)
    years = years_of(rows)
    with_date = _slope(years, values, "year")
    left = values - np.median(values)
    if with_date is not None:
        known = np.isfinite(years)
        left = left - with_date.value * np.where(known, years - np.median(years[known]), 0.0)
        left = left - np.median(left)
    scatter = _MAD * float(np.median(np.abs(left)))
    # A dive with doubtful results is not an outlier.
    allowed = OUTLIER * np.hypot(scatter, stds)
    enough = len(rows) >= LEAST_DIVES
    standing_out = (np.abs(left) > allowed) & enough
    return Trend(
        dof=dof,
        parameter=parameter,
        unit=str(rows[f"{parameter}_unit"].iloc[0]),
        dives=len(rows),
        median=float(np.median(values)),
        scatter=scatter,
        expected=float(np.median(stds)),
        with_date=with_date,
        with_payload=_slope(rows["payload_kg"].to_numpy(dtype=np.float64), values, "kg"),
        outliers=tuple(rows["dive"][standing_out]),
    )


def years_of(rows: pd.DataFrame) -> Floats:
    """Returns the dates of rows in years since 1970; ``NaN`` without a date."""
    import pandas as pd

    dates = pd.to_datetime(rows["date"])
    days = (dates - pd.Timestamp(0)) / pd.Timedelta(days=1)
    return np.asarray(days, dtype=np.float64) / 365.25


def _slope(x: Floats, values: Floats, unit: str) -> Slope | None:
    from scipy.stats import theilslopes

    known = np.isfinite(x)
    if known.sum() < LEAST_DIVES or np.ptp(x[known]) == 0.0:
        return None
    found = theilslopes(values[known], x[known], alpha=0.95)
    return Slope(float(found.slope), float(found.low_slope), float(found.high_slope), unit)
