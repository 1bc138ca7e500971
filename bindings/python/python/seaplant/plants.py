"""Plants: simulation from inputs alone, ``f(x, u)``, linearisation, export."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from seaplant import _native
from seaplant._files import read_results, write_files
from seaplant._named import Named
from seaplant._record import Floats
from seaplant._results import Consequence, Parameter
from seaplant.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Linear", "Motion", "Plant"]

STATES: tuple[str, ...] = tuple(_native.state_names())
"""The states, in order: pose north, east, down (m), roll, pitch, heading (rad), then velocity
over ground in body axes u, v, w (m/s), p, q, r (rad/s)."""

INPUTS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""The axes of a wrench, in order: N, then N m."""

State = ArrayLike | Mapping[str, float] | None
"""All twelve numbers in the order of `STATES`, or some by name; others are zero."""


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Named):
    """Response of a plant to inputs alone.

    Attributes
    ----------
    time_s
        Instants, s, shape (n,).
    pose
        North, east, down, m; roll, pitch, heading, rad; shape (n, 6).
    velocity
        Velocity over ground in body axes, m/s and rad/s, shape (n, 6).
    band95
        The 95 % band of velocity, low and high, shape (n, 6, 2); ``None`` if the plant states
        no standard deviations or no draws were asked for.
    consequences
        Top speeds, time constants, stopping distances and natural periods, with intervals.
    notes
        What limits the prediction.
    """

    time_s: Floats
    pose: Floats
    velocity: Floats
    band95: Floats | None
    consequences: tuple[Consequence, ...]
    notes: tuple[str, ...]

    def to_pandas(self) -> pd.DataFrame:
        """Returns pose and velocity.

        Returns
        -------
        pandas.DataFrame
            Columns ``north`` … ``r``, as the states are called, by time in s; with a band also
            ``u_low95``, ``u_high95`` …
        """
        import pandas as pd

        columns = dict(zip(STATES, np.hstack([self.pose, self.velocity]).T, strict=True))
        if self.band95 is not None:
            for k, name in enumerate(STATES[6:]):
                columns[f"{name}_low95"] = self.band95[:, k, 0]
                columns[f"{name}_high95"] = self.band95[:, k, 1]
        return pd.DataFrame(columns, index=pd.Index(self.time_s, name="time_s"))

    def __repr__(self) -> str:
        end = ", ".join(
            f"{name} = {value:.3g}"
            for name, value in zip(STATES[6:], self.velocity[-1], strict=True)
            if value != 0.0
        )
        return f"<Motion over {self.time_s[-1]:g} s, at the end {end or 'at rest'}>"


@dataclass(frozen=True, eq=False, repr=False)
class Linear(Named):
    """Linearisation of a plant at a state: ``d(x - x0)/dt = A (x - x0) + B (u - u0)``.

    Attributes
    ----------
    a
        ``∂f/∂x``, shape (n, n).
    b
        ``∂f/∂u``, shape (n, m).
    states
        The names of its states: what the plant moves at that state.
    inputs
        The axes of its inputs.
    x0
        The state about which it is, all twelve.
    u0
        The wrench that holds the velocity of that state, shape (6,).
    """

    a: Floats
    b: Floats
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    x0: Floats
    u0: Floats

    @property
    def poles(self) -> np.ndarray[Any, np.dtype[np.complex128]]:
        """The eigenvalues of ``a``, 1/s."""
        return np.linalg.eigvals(self.a).astype(np.complex128)

    def to_control(self) -> Any:
        """Converts the plant to python-control.

        Returns
        -------
        control.StateSpace
            The state space with named states and inputs; every state is an output.

        Raises
        ------
        InputError
            If the package ``control`` is not installed.
        """
        try:
            import control
        except ImportError:
            raise InputError("to_control needs python-control: pip install control") from None
        n, m = self.b.shape
        names = {"states": self.states, "outputs": self.states, "inputs": self.inputs}
        listed = {key: list(value) for key, value in names.items()}
        return control.ss(self.a, self.b, np.eye(n), np.zeros((n, m)), **listed)

    def __repr__(self) -> str:
        states, inputs = ", ".join(self.states), ", ".join(self.inputs)
        return f"<Linear plant: states {states}; inputs {inputs}>"


class Plant(Named):
    """A plant of any axes: the recommended one of a fit, a plant file, or a published table.

    Made by `Fit.plant` or `Plant.open`. The state ``x`` (12,) is north, east, down (m), roll,
    pitch, heading (rad), and velocity over ground in body axes u, v, w (m/s), p, q, r (rad/s);
    the input ``u`` (6,) is force and moment on the body, X, Y, Z (N), K, M, N (N m). Velocities
    of axes that the plant does not have stay as they are.

    Parameters
    ----------
    native
        The plant as the library holds it.

    Examples
    --------
    >>> import seaplant as sp
    >>> plant = sp.Plant.open("published:bluerov2-wu-2018")
    >>> plant.axes[:3]
    ('surge', 'sway', 'heave')
    >>> moved = plant.simulate([0, 5, 10], {"force.surge": 5.0})
    >>> round(float(moved.velocity[-1, 0]), 2)
    0.4
    """

    def __init__(self, native: _native.Plant) -> None:
        self._native = native

    @classmethod
    def open(cls, path: str | PathLike[str], *, method: str | None = None) -> Plant:
        """Reads a plant.

        Parameters
        ----------
        path
            A plant file, ``published:NAME``, or the results.json of a fit or its folder.
        method
            Of results, the method whose plants of single axes to use.

        Returns
        -------
        Plant
            The plant.

        Raises
        ------
        InputError
            If the file holds no plant, or ``method`` is given for a plant file.
        """
        file = Path(path)
        native = None if file.is_dir() else _native.Plant.open(file)
        if native is None:
            return cls(_native.Plant.of_results(read_results(file), "results.json", method))
        if method is not None:
            raise InputError(f"{path} is a table, not a fit by {method}; leave method out")
        return cls(native)

    @property
    def name(self) -> str:
        """Name of the vehicle."""
        return self._native.name

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes that are known."""
        return tuple(self._native.axes)

    @property
    def thrusters(self) -> tuple[str, ...]:
        """The names of the thrusters."""
        return tuple(self._native.thrusters)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on using it, including doubts."""
        return tuple(self._native.notes)

    @property
    def coefficients(self) -> dict[str, Parameter]:
        """Coefficients by name; unknown standard deviations are ``nan``."""
        nan = float("nan")
        return {
            name: Parameter(
                value=value,
                std=nan if std is None else std,
                low95=nan if interval is None else interval[0],
                high95=nan if interval is None else interval[1],
                unit=unit,
            )
            for name, value, std, interval, unit in self._native.coefficients()
        }

    def derivative(
        self, x: State, u: ArrayLike, *, current: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Floats:
        """Computes ``dx/dt = f(x, u)``, in the form for scipy.integrate and control libraries.

        Parameters
        ----------
        x
            The state.
        u
            The wrench, N and N m, shape (6,); `wrench` gives that of thrusters.
        current
            Velocity of the water north, east and down, m/s.

        Returns
        -------
        numpy.ndarray
            The derivative of the state, shape (12,).

        Raises
        ------
        InputError
            If an argument has another shape or is not finite, or pitch is ±90°, where roll and
            heading are not defined.

        Examples
        --------
        >>> import seaplant as sp
        >>> from scipy.integrate import solve_ivp
        >>> plant = sp.Plant.open("published:bluerov2-wu-2018")
        >>> u = plant.wrench({"force.surge": 5.0})
        >>> run = solve_ivp(lambda t, x: plant.derivative(x, u), (0, 10), [0.0] * 12)
        >>> round(float(run.y[6, -1]), 2)
        0.4
        """
        return self._native.rate(state(x), _floats(u), _floats(current))

    def wrench(self, inputs: Mapping[str, float]) -> Floats:
        """Computes force and moment of constant inputs.

        Parameters
        ----------
        inputs
            As of `simulate`.

        Returns
        -------
        numpy.ndarray
            X, Y, Z, N; K, M, N, N m; shape (6,); without lag and delay.
        """
        return self._native.wrench([(name, float(x)) for name, x in inputs.items()])

    def simulate(
        self,
        t: ArrayLike,
        inputs: Mapping[str, ArrayLike],
        *,
        start: State = None,
        current: tuple[float, float] = (0.0, 0.0),
        draws: int = 200,
        seed: int = 1,
        disturbed: bool = False,
    ) -> Motion:
        """Simulates the plant from inputs alone, as ``seaplant simulate`` does.

        Parameters
        ----------
        t
            Instants, s, increasing.
        inputs
            By name ``force.AXIS`` (N, N m), ``thruster.NAME`` (in the unit of its curve) or
            ``supply_v`` (V): a number, or one for each instant, held until the next.
        start
            The state to begin from, in the order or by the names of `STATES`; at rest and level
            if not given.
        current
            Velocity of the water north and east, m/s.
        draws
            How many draws of the coefficients make the band; 0 for none.
        seed
            Where their random numbers start.
        disturbed
            Whether to disturb each draw as the trials were.

        Returns
        -------
        Motion
            Pose, velocity and band.

        Raises
        ------
        InputError
            If an input is unknown or has another length, or the plant diverges.
        """
        times = _floats(t)
        series = []
        for name, given in inputs.items():
            values = _floats(given)
            if values.shape not in {(), times.shape}:
                raise InputError(
                    f"{name} has shape {values.shape}; give one number or {times.size} of them"
                )
            at = times if values.shape else times[:1]
            series.append((name, at.tolist(), np.atleast_1d(values).tolist()))
        setting = {
            "start": state(start).tolist(),
            "current": current,
            "draws": draws,
            "seed": seed,
            "disturbed": disturbed,
        }
        pose, velocity, band, follows, notes = self._native.simulate(
            times.tolist(), series, setting
        )
        consequences = tuple(Consequence.from_dict(of) for of in json.loads(follows))
        return Motion(times, pose, velocity, band, consequences, tuple(notes))

    def linearise(
        self, at: State = None, *, current: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Linear:
        """Linearises the plant about a state, with the exact derivatives of its terms.

        Parameters
        ----------
        at
            The state, in the order or by the names of `STATES`, as ``{"u": 0.5}``; at rest and
            level if not given.
        current
            Velocity of the water north, east and down, m/s.

        Returns
        -------
        Linear
            State space of what the plant moves, with the wrench that holds its velocity.

        Raises
        ------
        InputError
            As `derivative`.
        """
        x0 = state(at)
        a, b, u0, places = self._native.linear(x0, _floats(current))
        own = [k for k, axis in enumerate(INPUTS) if axis in self.axes]
        return Linear(
            a=a[np.ix_(places, places)],
            b=b[np.ix_(places, own)],
            states=tuple(STATES[k] for k in places),
            inputs=tuple(INPUTS[k] for k in own),
            x0=x0,
            u0=u0,
        )

    def export(
        self,
        to: str,
        folder: str | PathLike[str],
        *,
        anyway: bool = False,
        force: bool = False,
    ) -> tuple[str, ...]:
        """Writes the plant for other software, as ``seaplant export`` does.

        Parameters
        ----------
        to
            The format: c, rust, python, casadi, octave, fmu, gazebo, uuv-simulator, stonefish,
            ros2 or json.
        folder
            Where to.
        anyway
            Whether to export a plant whose verdict is "do not use".
        force
            Whether to replace files that Seaplant did not write, too.

        Returns
        -------
        tuple of str
            What the format leaves out, and what to know.

        Raises
        ------
        InputError
            If the format is unknown or cannot hold the plant, it should not be used, or a file
            is in the way that Seaplant did not write.
        """
        files, notes = self._native.export(to, anyway)
        write_files(folder, dict(files), "export", force=force)
        return tuple(notes)

    def casadi(self) -> Any:
        """Returns the plant as a CasADi function, by the module of ``export("casadi")``.

        Returns
        -------
        module
            With ``plant()``, the function ``f(x, u, p)`` of a state (13,) with a quaternion;
            ``PARAMETERS``; ``acados_model()``.

        Raises
        ------
        InputError
            If the package ``casadi`` is not installed, or the plant should not be used.
        """
        try:
            import casadi  # noqa: F401
        except ImportError:
            raise InputError("casadi() needs CasADi: pip install casadi") from None
        files, _ = self._native.export("casadi", False)
        path, source = files[0]
        module = ModuleType(Path(path).stem)
        exec(compile(source, path, "exec"), module.__dict__)
        return module

    def __repr__(self) -> str:
        return f"<Plant of {self.name!r}: {', '.join(self.axes)}>"


def state(given: State) -> Floats:
    """Returns all twelve states, given some by name."""
    return by_name("a state", {} if given is None else given, STATES)


def by_name(what: str, given: ArrayLike | Mapping[str, float], names: Sequence[str]) -> Floats:
    """Returns numbers in the order of their names, given some by name; others are zero."""
    if not isinstance(given, Mapping):
        return _floats(given)
    x = np.zeros(len(names))
    for name, value in given.items():
        if name not in names:
            raise InputError(f"unknown {name!r} of {what}; expected {', '.join(names)}")
        x[names.index(name)] = value
    return x


def _floats(given: ArrayLike) -> Floats:
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"expected numbers: {error}") from None
