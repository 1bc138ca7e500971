"""Trials: one stretch of one log for one vehicle."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from seaplant import _native
from seaplant._choices import expected
from seaplant._named import Named
from seaplant._record import Floats
from seaplant._tables import Data
from seaplant.errors import InputError
from seaplant.logs import Log
from seaplant.vehicles import Vehicle

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Axis", "Trial"]

Channels = Mapping[str, "str | tuple[str, str] | Mapping[str, object]"]
"""By quantity, the column; or column and unit; or the keys of a ``[channels]`` entry."""

Axes = str | Sequence[str | Sequence[str]]
"""The axes of a plant, by their names or by that of a set; or of several plants."""


@dataclass(frozen=True, eq=False, repr=False)
class Axis(Named):
    """Measurements of one degree of freedom in a trial.

    Attributes
    ----------
    dof
        Which.
    time_s
        Instants of velocity, s, shape (n,).
    velocity
        Velocity, unfiltered, m/s or rad/s, shape (n,).
    force_time_s
        Instants at which force changes, s, shape (m,).
    force
        Force or moment, held from each to the next, N or N m, shape (m,).
    position_time_s
        Instants of position, s; empty if it was not measured.
    position
        Position, m or rad; empty if it was not measured.
    """

    dof: str
    time_s: Floats
    velocity: Floats
    force_time_s: Floats
    force: Floats
    position_time_s: Floats
    position: Floats

    def __repr__(self) -> str:
        return f"<Axis {self.dof}, {len(self.time_s)} velocities, {len(self.force)} forces>"

    def to_pandas(self) -> pd.DataFrame:
        """Returns velocity and the force in effect at each of its instants.

        Returns
        -------
        pandas.DataFrame
            Columns ``velocity`` and ``force`` by time in s.
        """
        import numpy as np
        import pandas as pd

        held = np.searchsorted(self.force_time_s, self.time_s, side="right") - 1
        force = self.force[np.maximum(held, 0)]
        index = pd.Index(self.time_s, name="time_s")
        return pd.DataFrame({"velocity": self.velocity, "force": force}, index=index)


class Trial(Named):
    """One stretch of one log for one vehicle: navigated, converted to forces, and checked.

    Parameters
    ----------
    log
        The log, or what `Log.of` makes one of.
    vehicle
        The vehicle.
    dof
        The degrees of freedom that are identified by themselves: surge, sway, heave, roll,
        pitch, yaw.
    axes
        The axes of a plant of several axes that it serves: a list of them, ``"six"``,
        ``"planar"`` (surge, sway, yaw) or ``"vertical"`` (surge, heave, pitch); of several such
        plants a list of these.
    channels
        Which column holds which quantity: ``{"depth": "Z", "thruster.T1.pwm": ("T1", "us")}``.
        If not given, columns that are called as quantities are.
    name
        How tables and messages call it.
    role
        What it is for: ``fit``, ``hold-out`` or ``steady``.
    from_s
        Its start, in seconds after the first sample of the log.
    to_s
        Its end, likewise.
    segments_s
        Steady stretches ``(from, to)``, likewise; found if not given.
    units
        The units of a table that states none; see `Log.of`.

    Raises
    ------
    InputError
        If the log lacks what a degree of freedom needs; the message says what would do.
    """

    def __init__(
        self,
        log: Log | Data,
        vehicle: Vehicle,
        dof: str | Sequence[str] = (),
        *,
        axes: Axes = (),
        channels: Channels | None = None,
        name: str = "trial",
        role: Literal["fit", "hold-out", "steady"] = "fit",
        from_s: float | None = None,
        to_s: float | None = None,
        segments_s: Sequence[tuple[float, float]] = (),
        units: Mapping[str, str] | None = None,
    ) -> None:
        if not isinstance(log, Log):
            log = Log.of(log, units=units, name=name)
        elif units is not None:
            raise InputError("the log has its units; give others as channels")
        entry = {
            "name": name,
            "log": [],
            "dof": [dof] if isinstance(dof, str) else list(dof),
            "role": role,
            "from_s": from_s,
            "to_s": to_s,
            "segments_s": [list(span) for span in segments_s],
            "channels": _entries(log, channels),
        }
        made_of, served = json.dumps(entry), json.dumps(axes)
        body = expected(Vehicle, vehicle, "vehicle", "make one with seaplant.Vehicle(...)")
        native = _native.Trial.of_log(log._native, made_of, served, body._native)
        self._set(native, (_of_log, (log, vehicle, made_of, served)))

    def _set(self, native: _native.Trial, recipe: tuple[Any, ...] | None) -> None:
        self._native = native
        # Arguments that recreate it in another process; a campaign's logs stay in their files.
        self._recipe = recipe

    @classmethod
    def _of(cls, native: _native.Trial, recipe: tuple[Any, ...] | None = None) -> Trial:
        trial = cls.__new__(cls)
        trial._set(native, recipe)
        return trial

    @property
    def name(self) -> str:
        """Name in tables and messages."""
        return self._native.name

    @property
    def role(self) -> str:
        """Role: ``fit``, ``hold-out`` or ``steady``."""
        return self._native.role

    @property
    def dofs(self) -> list[str]:
        """Degrees of freedom that are identified one at a time."""
        return self._native.dofs

    @property
    def axes(self) -> list[list[str]]:
        """Axes of each plant of several axes that it serves."""
        return self._native.axes

    def caveats(self, dof: str) -> list[str]:
        """Returns the doubts that every fit of a degree of freedom of this trial inherits.

        Parameters
        ----------
        dof
            Which.

        Returns
        -------
        list of str
            In words that a pilot understands.
        """
        return self._native.caveats(dof)

    def axis(self, dof: str | None = None) -> Axis:
        """Returns the raw record of a degree of freedom.

        Parameters
        ----------
        dof
            Which; not needed if there is one only.

        Returns
        -------
        Axis
            Velocity, force and position at their own times.

        Raises
        ------
        InputError
            If the trial does not exercise it.
        """
        import numpy as np

        chosen = only(self.dofs, dof, "the trial")
        velocity, force, position = self._native.axis(chosen)
        position = (np.empty(0), np.empty(0)) if position is None else position
        return Axis(chosen, *velocity, *force, *position)

    def _as_role(self, role: str) -> Trial:
        recipe = None if self._recipe is None else (_with_role, (self, role))
        return Trial._of(self._native.as_role(role), recipe)

    def __repr__(self) -> str:
        served = [*self.dofs, *("-".join(axes) for axes in self.axes)]
        return f"<Trial {self.name!r}, {self.role}, {', '.join(served)}>"

    def __reduce__(self) -> tuple[Any, ...]:
        if self._recipe is None:
            raise TypeError(
                "a trial of a campaign.toml cannot be pickled; open the campaign where it is "
                "needed"
            )
        return self._recipe


def _of_log(log: Log, vehicle: Vehicle, entry: str, axes: str) -> Trial:
    native = _native.Trial.of_log(log._native, entry, axes, vehicle._native)
    return Trial._of(native, (_of_log, (log, vehicle, entry, axes)))


def _with_role(trial: Trial, role: str) -> Trial:
    return trial._as_role(role)


def trials_of(given: Trial | Iterable[Trial]) -> list[Trial]:
    """Returns one trial or several as a list."""
    if isinstance(given, Trial):
        return [given]
    how = "make one with seaplant.Trial(log, vehicle, dof)"
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise InputError(
            f"trials must be a Trial or several, found {type(given).__name__}; {how}"
        )
    return [expected(Trial, of, "each of the trials", how) for of in given]


def only(known: Sequence[str], chosen: str | None, holder: str) -> str:
    """Returns the chosen degree of freedom, or the only one."""
    if chosen is not None:
        return chosen
    if len(known) == 1:
        return known[0]
    raise InputError(f"{holder} has {', '.join(known) or 'none'}; choose one with dof=")


def _entries(log: Log, channels: Channels | None) -> dict[str, dict[str, object]]:
    if channels is None:
        named = [of.name for of in log if _native.is_quantity(of.name)]
        if not named:
            found = ", ".join(of.column for of in log)
            raise InputError(f"no column of {found} is called as a quantity is; give channels=")
        return {name: {"column": name} for name in named}
    entries: dict[str, dict[str, object]] = {}
    for quantity, of in channels.items():
        if isinstance(of, str):
            entries[quantity] = {"column": of}
        elif isinstance(of, Mapping):
            entries[quantity] = dict(of)
        else:
            column, unit = of
            entries[quantity] = {"column": column, "unit": unit}
    return entries
