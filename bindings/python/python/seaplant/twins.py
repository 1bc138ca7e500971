"""The digital twin: logs of a vehicle with known truth, and Monte Carlo studies."""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from seaplant import _native
from seaplant._choices import Methods, methods_of
from seaplant._files import write_files
from seaplant._named import Named
from seaplant._record import Floats
from seaplant._results import MonteCarloTable, Truth, VehicleMonteCarloTable
from seaplant.errors import InputError
from seaplant.logs import Log
from seaplant.trials import Trial
from seaplant.vehicles import Vehicle

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Twin", "monte_carlo", "monte_carlo_frame", "twin"]

Spec = str | PathLike[str] | Mapping[str, Any] | None


class Twin(Named):
    """Logs of a simulated vehicle, and its truth; made by `twin`.

    Parameters
    ----------
    spec
        What the twin is and does, as JSON.

    Attributes
    ----------
    vehicle
        The vehicle as its analyst has it.
    trials
        For each degree of freedom one to fit and one to hold out; then steady runs. Of a whole
        vehicle those that serve its plant of several axes. They hold what instruments said,
        unrounded; files round it to the decimals that are usual.
    truth
        What an analyst would like to know.
    bollard_pull
        Propeller speed, rad/s, and thrust, N, of one thruster on a test bench, shape (n, 2);
        empty of a whole vehicle.
    """

    vehicle: Vehicle
    trials: tuple[Trial, ...]
    truth: Truth
    bollard_pull: Floats

    def __init__(self, spec: str, /) -> None:
        native = _native.Twin(spec)
        self._native = native
        self._spec = spec
        self.vehicle = Vehicle._of(native.vehicle(), (_vehicle_of, (spec,)))
        made = enumerate(native.trials())
        self.trials = tuple(Trial._of(of, (_trial_of, (spec, k))) for k, of in made)
        self.truth = Truth.from_dict(json.loads(native.truth()))
        self.bollard_pull = np.reshape(native.bollard_pull(), (-1, 2)).astype(np.float64)

    @property
    def logs(self) -> dict[str, Log]:
        """The log of each trial, in SI units, with columns named after quantities."""
        return {name: Log(of) for name, of in self._native.logs()}

    def write(self, folder: str | PathLike[str], *, force: bool = False) -> Path:
        """Writes logs, vehicle.toml, campaign.toml and truth, as ``seaplant twin`` does.

        Parameters
        ----------
        folder
            The folder; files that Seaplant wrote are replaced once all are made.
        force
            Whether to replace other files, too.

        Returns
        -------
        pathlib.Path
            The campaign.toml.

        Raises
        ------
        InputError
            If a file is in the way that Seaplant did not write.
        OSError
            If the system does not let it be written.
        """
        files = {path: text.encode() for path, text in self._native.files()}
        return write_files(folder, files, "campaign", force=force) / "campaign.toml"

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self._spec,)

    def __repr__(self) -> str:
        names = ", ".join(trial.name for trial in self.trials)
        return f"<Twin of {self.vehicle.name!r}: {names}>"


def twin(spec: Spec = None, **changes: Any) -> Twin:
    """Makes the logs of a vehicle with known truth.

    Parameters
    ----------
    spec
        What the twin is and does: a TOML file, or its keys; the Jason 2 twin if not given.
    **changes
        Keys in place of those of ``spec``, such as ``seed``, ``dofs``, ``duration_s``,
        ``noise`` and ``disturbances``; ``seaplant schema twin`` prints all. ``vehicle``, a
        plant file or ``"published:NAME"``, makes it a whole vehicle, driven in several axes at
        once.

    Returns
    -------
    Twin
        Trials, vehicle and truth; equal seeds give equal twins.

    Raises
    ------
    FileError
        If the file cannot be read.
    InputError
        If a key or value is wrong.

    Examples
    --------
    >>> import seaplant as sp
    >>> dive = sp.twin(seed=2, dofs=["surge"], duration_s=60, disturbances=["lag"])
    >>> [trial.name for trial in dive.trials]
    ['surge 1', 'surge hold-out']
    >>> dive.truth.nuisances.lag_s
    0.3
    >>> whole = sp.twin(vehicle="published:rexrov", duration_s=60, hold_out_s=60)
    >>> whole.trials[0].axes
    [['surge', 'sway', 'heave', 'roll', 'pitch', 'yaw']]
    """
    return Twin(_spec(spec, changes))


@functools.lru_cache(maxsize=4)
def _again(spec: str) -> Twin:
    return Twin(spec)


def _vehicle_of(spec: str) -> Vehicle:
    return _again(spec).vehicle


def _trial_of(spec: str, number: int) -> Trial:
    return _again(spec).trials[number]


def monte_carlo(
    spec: Spec = None,
    *,
    method: Methods = None,
    runs: int = 15,
    threads: int | None = None,
    on_run: Callable[[int], object] | None = None,
    **changes: Any,
) -> MonteCarloTable | VehicleMonteCarloTable:
    """Measures the methods on a twin: errors and coverage over many seeds.

    Parameters
    ----------
    spec
        What the twin is and does: a TOML file, or its keys; the Jason 2 twin if not given.
    method
        A method, several, or ``"all"``; those that `seaplant.identify` uses if not given. A
        whole vehicle is fitted by filter error.
    runs
        How many twins to make, with seeds from that of the spec upwards.
    threads
        How many to work on side by side; as many as there are processors if not given.
    on_run
        Called now and then with the number of the latest run that has begun.
    **changes
        Keys in place of those of ``spec``.

    Returns
    -------
    MonteCarloTable or VehicleMonteCarloTable
        A row for each degree of freedom, method and parameter; of a whole vehicle, which
        ``vehicle`` makes it, a row for each coefficient. The same for any ``threads``.

    Raises
    ------
    InputError
        If a key or value is wrong.
    """
    if runs < 1:
        raise InputError(f"runs is {runs} and must be at least 1")
    made_of = _spec(spec, changes)
    table = json.loads(_native.monte_carlo(made_of, methods_of(method), runs, threads, on_run))
    if "vehicle" in table["spec"]:
        return VehicleMonteCarloTable.from_dict(table)
    return MonteCarloTable.from_dict(table)


def monte_carlo_frame(table: MonteCarloTable | VehicleMonteCarloTable) -> pd.DataFrame:
    """Returns the rows of a Monte Carlo study as a frame.

    Parameters
    ----------
    table
        What `monte_carlo` gives.

    Returns
    -------
    pandas.DataFrame
        A row for each degree of freedom, method and parameter; or for each coefficient.
    """
    import pandas as pd

    if isinstance(table, VehicleMonteCarloTable):
        return pd.DataFrame([row.to_dict() for row in table.coefficients])
    return pd.DataFrame([row.to_dict() for row in table.rows])


def _spec(spec: Spec, changes: Mapping[str, Any]) -> str:
    if spec is None:
        keys: Mapping[str, Any] = {}
    elif isinstance(spec, Mapping):
        keys = spec
    else:
        keys = json.loads(_native.read_twin_spec(Path(spec)))
    return json.dumps({**keys, **{name: _listed(value) for name, value in changes.items()}})


def _listed(value: object) -> object:
    """Converts sets and arrays of NumPy to JSON's types."""
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, PathLike):
        return os.fspath(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return list(value)
    return value
