"""Vehicles: positions of thrusters and instruments, from a file or built in code."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from seaplant import _native
from seaplant._named import Named
from seaplant._record import Floats
from seaplant._tables import floats
from seaplant.errors import InputError

__all__ = [
    "Attitude",
    "Dvl",
    "PositionSensor",
    "PresetCurve",
    "QuadraticCurve",
    "Sensors",
    "TableCurve",
    "ThrustUncertainty",
    "Thruster",
    "Vehicle",
]

Input: TypeAlias = Literal["speed", "pwm", "command"]
Vector: TypeAlias = Sequence[float]
"""Three numbers along x forward, y starboard, z down."""


@dataclass(frozen=True)
class QuadraticCurve:
    """Force proportional to the squared input beyond the deadband, ``F = k s|s|``.

    Attributes
    ----------
    forward
        k of positive input, N per squared unit of input: N/(rad/s)² for a speed.
    reverse
        k of negative input.
    input
        What is logged: speed (rad/s), pwm (us) or command (-1 to 1).
    deadband
        Inputs this close to neutral give no thrust.
    neutral
        The input that means stop; 0, or 1500 for pwm, if not given.
    """

    forward: float
    reverse: float
    input: Input = "speed"
    deadband: float = 0.0
    neutral: float | None = None


@dataclass(frozen=True)
class TableCurve:
    """Force interpolated between measured points, or those of a file.

    Attributes
    ----------
    input
        What is logged: speed (rad/s), pwm (us) or command (-1 to 1).
    points
        Input and force in N, shape (n, 2).
    file
        A table with a column of inputs and one of forces, in place of points.
    """

    input: Input | None = None
    points: Sequence[Sequence[float]] = ()
    file: str | PathLike[str] | None = None


@dataclass(frozen=True)
class PresetCurve:
    """The published curve of a known thruster, such as ``t200``.

    Attributes
    ----------
    name
        Which.
    voltage_v
        The supply voltage, V; that which is logged as supply.voltage if not given.
    """

    name: str
    voltage_v: float | None = None


@dataclass(frozen=True)
class ThrustUncertainty:
    """Standard deviations of thrust, as fractions of it: 0.05 for 5 %.

    Attributes
    ----------
    forward
        Of positive thrust.
    reverse
        Of negative thrust.
    """

    forward: float = 0.0
    reverse: float = 0.0


@dataclass(frozen=True)
class Thruster:
    """A thruster, in the body frame.

    Attributes
    ----------
    name
        How channels call it: ``thruster.NAME.speed``.
    position_m
        Where it pushes, m: x forward, y starboard, z down.
    direction
        The way that positive thrust pushes the vehicle; any length but zero.
    curve
        From input to force.
    reversed
        Whether positive input pushes against ``direction``.
    thrust_uncertainty
        How well its strength is known; carried into mass and drag.
    """

    name: str
    position_m: Vector | None = None
    direction: Vector | None = None
    curve: QuadraticCurve | TableCurve | PresetCurve | None = None
    reversed: bool = False
    thrust_uncertainty: ThrustUncertainty | None = None


@dataclass(frozen=True)
class Dvl:
    """A Doppler velocity log.

    Attributes
    ----------
    position_m
        Where it sits, m, body frame.
    rotation_deg
        Roll, pitch, yaw that turn the vehicle's axes into the instrument's, deg.
    std_m_s
        Standard deviation of one sample, m/s.
    """

    position_m: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Vector = (0.0, 0.0, 0.0)
    std_m_s: float | None = None


@dataclass(frozen=True)
class PositionSensor:
    """An instrument that measures depth or position.

    Attributes
    ----------
    position_m
        Where it sits, m, body frame.
    std_m
        Standard deviation of one sample, m.
    """

    position_m: Vector = (0.0, 0.0, 0.0)
    std_m: float | None = None


@dataclass(frozen=True)
class Attitude:
    """An instrument that measures roll, pitch and heading.

    Attributes
    ----------
    rotation_deg
        Roll, pitch, yaw that turn the vehicle's axes into the instrument's, deg.
    std_deg
        Standard deviation of one sample, deg.
    """

    rotation_deg: Vector = (0.0, 0.0, 0.0)
    std_deg: float | None = None


@dataclass(frozen=True)
class Sensors:
    """The instruments; one that is left out is at the origin, aligned.

    Attributes
    ----------
    dvl
        Doppler velocity log.
    depth
        Depth sensor.
    attitude
        Roll, pitch and heading.
    position
        Positioning antenna, beacon or marker.
    """

    dvl: Dvl | None = None
    depth: PositionSensor | None = None
    attitude: Attitude | None = None
    position: PositionSensor | None = None


class Vehicle(Named):
    """A marine vehicle with known thrusters: from a vehicle.toml, or built in code.

    Parameters
    ----------
    path
        The vehicle.toml to read; then nothing else is given.
    name
        What the vehicle is called; a preset has a name.
    preset
        A known vehicle, whose name and thrusters it takes: ``bluerov2``, ``bluerov2-heavy``.
    dry_mass_kg
        Mass in air, kg.
    size_m
        Length, width and height of the hull, m.
    thruster_curve
        The curve of every thruster that states none.
    thrusters
        The thrusters.
    sensors
        The instruments.

    Raises
    ------
    FileError
        If a file cannot be read.
    InputError
        If what it says is wrong; the message names the key and what to do.

    Examples
    --------
    >>> import seaplant as sp
    >>> curve = sp.QuadraticCurve(forward=0.0402, reverse=0.0328)
    >>> bow = sp.Thruster("bow", position_m=[1, 0, 0], direction=[0, 1, 0], curve=curve)
    >>> vehicle = sp.Vehicle(name="Skiff", dry_mass_kg=120, thrusters=[bow])
    >>> vehicle.unit_wrench("bow")
    array([0., 1., 0., 0., 0., 1.])
    """

    def __init__(
        self,
        path: str | PathLike[str] | None = None,
        /,
        *,
        name: str | None = None,
        preset: str | None = None,
        dry_mass_kg: float | None = None,
        size_m: Vector | None = None,
        thruster_curve: QuadraticCurve | TableCurve | PresetCurve | None = None,
        thrusters: Sequence[Thruster] = (),
        sensors: Sensors | None = None,
    ) -> None:
        stated: dict[str, Any] = {
            "name": name,
            "preset": preset,
            "dry_mass_kg": dry_mass_kg,
            "size_m": size_m,
            "thruster_curve": thruster_curve,
            "thruster": list(thrusters) or None,
            "sensor": sensors,
        }
        stated = {key: value for key, value in stated.items() if value is not None}
        if path is not None and stated:
            raise InputError("give a vehicle.toml or the vehicle itself, not both")
        if path is None:
            made_of = json.dumps(_plain(stated))
            self._set(_native.Vehicle.of_json(made_of), (_of_json, (made_of,)))
        else:
            self._set(_native.Vehicle.open(Path(path)), (Vehicle, (Path(path).absolute(),)))

    def _set(self, native: _native.Vehicle, recipe: tuple[Any, ...]) -> None:
        self._native = native
        # Arguments that recreate it in another process.
        self._recipe = recipe

    @classmethod
    def _of(cls, native: _native.Vehicle, recipe: tuple[Any, ...]) -> Vehicle:
        vehicle = cls.__new__(cls)
        vehicle._set(native, recipe)
        return vehicle

    @property
    def name(self) -> str:
        """Name of the vehicle."""
        return self._native.name

    @property
    def dry_mass_kg(self) -> float | None:
        """Mass in air, kg."""
        return self._native.dry_mass_kg

    @property
    def size_m(self) -> tuple[float, ...] | None:
        """Length, width and height of the hull, m."""
        size = self._native.size_m
        return None if size is None else tuple(size)

    @property
    def thrusters(self) -> list[str]:
        """The names of its thrusters."""
        return self._native.thrusters

    def unit_wrench(self, thruster: str) -> Floats:
        """Returns the wrench of one newton of a thruster, ``[d; r × d]``.

        Parameters
        ----------
        thruster
            Its name.

        Returns
        -------
        numpy.ndarray
            N and N m along surge, sway, heave, roll, pitch and yaw, shape (6,).

        Raises
        ------
        InputError
            If there is no such thruster.
        """
        if thruster not in self.thrusters:
            known = ", ".join(self.thrusters)
            raise InputError(f"the vehicle has no thruster `{thruster}` but {known}")
        wrenches = self._native.unit_wrenches()
        return np.asarray(wrenches[self.thrusters.index(thruster)], dtype=np.float64)

    def thrust(
        self, thruster: str, inputs: ArrayLike, *, voltage_v: float | None = None
    ) -> Floats:
        """Returns the force of a thruster by its curve.

        Parameters
        ----------
        thruster
            Its name.
        inputs
            What its curve reads, rad/s, us or a ratio, shape (n,).
        voltage_v
            The supply voltage, V, for curves of several.

        Returns
        -------
        numpy.ndarray
            Force, N, shape (n,).

        Raises
        ------
        InputError
            If there is no such thruster.
        """
        given = floats("inputs", np.ma.ravel(inputs))
        forces = self._native.thrust(thruster, given.tolist(), voltage_v)
        known = np.where(np.isnan(given), np.nan, np.asarray(forces, dtype=np.float64))
        return known.reshape(np.shape(inputs))

    def __repr__(self) -> str:
        mass = f", {self.dry_mass_kg:g} kg in air" if self.dry_mass_kg is not None else ""
        count = len(self.thrusters)
        return f"<Vehicle {self.name!r}{mass}, {count} thruster{'' if count == 1 else 's'}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return self._recipe

    def __deepcopy__(self, memo: dict[int, object]) -> Vehicle:
        # It is immutable.
        return self


def _of_json(made_of: str) -> Vehicle:
    return Vehicle._of(_native.Vehicle.of_json(made_of), (_of_json, (made_of,)))


_CURVES: dict[type, str] = {
    QuadraticCurve: "quadratic",
    TableCurve: "table",
    PresetCurve: "preset",
}


def _plain(value: Any) -> Any:
    """Returns JSON-compatible values, without those that were not stated."""
    if dataclasses.is_dataclass(value):
        fields = ((of.name, getattr(value, of.name)) for of in dataclasses.fields(value))
        kind = _CURVES.get(type(value))
        stated = {"kind": kind, **dict(fields)}
        return {name: _plain(of) for name, of in stated.items() if of is not None}
    if isinstance(value, dict):
        return {key: _plain(of) for key, of in value.items()}
    if isinstance(value, PathLike):
        return str(Path(value))
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [_plain(of) for of in value]
    return value
