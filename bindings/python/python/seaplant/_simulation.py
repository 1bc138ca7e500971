"""Simulations of trials, with the measurements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from seaplant._named import Named
from seaplant._record import Floats

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Named):
    """Simulated and measured velocity of one trial.

    Attributes
    ----------
    dof
        Which degree of freedom.
    trial
        Which trial.
    method
        Whose plant.
    mean_abs_error
        e, the mean of ``|v_model - v|`` on raw velocity, m/s or rad/s.
    null_error
        e of a model that never moves.
    r_squared
        R² of velocity; ``None`` if nothing moved.
    time_s
        Instants, s, shape (n,).
    force
        Force in effect at each, N or N m, shape (n,).
    measured
        Velocity as measured, unfiltered, m/s or rad/s, shape (n,).
    simulated
        Velocity as simulated from the logged force, shape (n,).
    """

    dof: str
    trial: str
    method: str
    mean_abs_error: float
    null_error: float
    r_squared: float | None
    time_s: Floats
    force: Floats
    measured: Floats
    simulated: Floats

    def __repr__(self) -> str:
        return (
            f"<Simulation of {self.dof} of {self.trial!r} by {self.method}: e = "
            f"{self.mean_abs_error:.3g}, {self.null_error:.3g} for a model that never moves>"
        )

    def to_pandas(self) -> pd.DataFrame:
        """Returns the series.

        Returns
        -------
        pandas.DataFrame
            Columns ``force``, ``measured``, ``simulated``, ``difference`` by time in s.
        """
        import pandas as pd

        columns = {
            "force": self.force,
            "measured": self.measured,
            "simulated": self.simulated,
            "difference": self.simulated - self.measured,
        }
        return pd.DataFrame(columns, index=pd.Index(self.time_s, name="time_s"))

    def to_xarray(self) -> xr.Dataset:
        """Returns the series as a dataset along ``time``, s.

        Returns
        -------
        xarray.Dataset
            Variables ``force``, ``measured`` and ``simulated``; scores as attributes.
        """
        import xarray as xr

        series = {name: getattr(self, name) for name in ("force", "measured", "simulated")}
        attributes = {
            "dof": self.dof,
            "trial": self.trial,
            "method": self.method,
            "mean_abs_error": self.mean_abs_error,
            "null_error": self.null_error,
        }
        return xr.Dataset(
            {name: ("time", values) for name, values in series.items()},
            coords={"time": ("time", self.time_s, {"units": "s"})},
            attrs=attributes,
        )
