"""Controllers on plants: gains with margins, and the control law itself."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from seaplant import _native
from seaplant._choices import expected
from seaplant._named import Named
from seaplant._record import Floats
from seaplant.plants import STATES, Plant, State, by_name, state

__all__ = ["Controller"]

ByAxis = Mapping[str, float]


class Controller(Named):
    """A controller of a plant, as ``seaplant control`` makes it.

    Parameters
    ----------
    plant
        The plant; lag, delay and limits of its thrusters are counted with where it knows them.
    bandwidth_hz
        Natural frequency of each controlled axis, Hz; others are left alone.
    law
        pd, pid, exact, non-exact or slotine-li.
    adaptive
        Whether its model adapts to the vehicle.
    damping
        Damping ratio of every axis.
    integral_s
        Integral time of pid, s; 10/ω if not given.
    lag_s
        First-order lag of force by axis, s.
    delay_s
        Delay by axis, s.
    limit
        The most force either way by axis, N and N m.
    sample_hz
        How often it acts, Hz.
    adaptation_s
        In what time an adaptive model follows, s.
    draws
        Over how many draws of the coefficients the worst margins are.
    seed
        Where their random numbers start.
    anyway
        Whether to take a plant whose verdict is "do not use", and loops with too small a
        margin.

    Raises
    ------
    InputError
        If the plant should not be used, an axis is unknown, or the bandwidth cannot be reached;
        the message has the number that would do.

    Examples
    --------
    >>> import seaplant as sp
    >>> plant = sp.Plant.open("published:bluerov2-heavy-von-benzon-2022")
    >>> controller = sp.Controller(plant, {"surge": 0.1, "yaw": 0.15}, limit={"surge": 80.0})
    >>> surge = controller.gains["axes"]["surge"]
    >>> round(surge["kp"], 2), surge["margins"]["phase_deg"] > 45.0
    (7.84, True)
    >>> force = controller.command(None, {"north": 1.0})
    >>> round(float(force[0]), 2)
    7.84
    """

    def __init__(
        self,
        plant: Plant,
        bandwidth_hz: ByAxis,
        *,
        law: str = "non-exact",
        adaptive: bool = False,
        damping: float = 1.0,
        integral_s: float | None = None,
        lag_s: ByAxis | None = None,
        delay_s: ByAxis | None = None,
        limit: ByAxis | None = None,
        sample_hz: float = 10.0,
        adaptation_s: float = 60.0,
        draws: int = 200,
        seed: int = 1,
        anyway: bool = False,
    ) -> None:
        asked = {
            "law": law,
            "adapts": adaptive,
            "bandwidth_hz": dict(bandwidth_hz),
            "damping": damping,
            "integral_s": integral_s,
            "lag_s": dict(lag_s or {}),
            "delay_s": dict(delay_s or {}),
            "limit": dict(limit or {}),
            "sample_hz": sample_hz,
            "adaptation_s": adaptation_s,
            "draws": draws,
            "seed": seed,
            "anyway": anyway,
        }
        how = "use fit.plant(), or seaplant.Plant.open(path)"
        plant = expected(Plant, plant, "plant", how)
        self._native = _native.Controller(plant._native, json.dumps(asked))
        self._names = tuple(plant.coefficients)

    @property
    def gains(self) -> dict[str, Any]:
        """Gains and margins by axis and notes, with the keys of control.json."""
        gains: dict[str, Any] = json.loads(self._native.gains())
        return gains

    @property
    def coefficients(self) -> dict[str, float]:
        """The current coefficients of the model, by name; those of an adaptive one change."""
        return dict(zip(self._names, self._native.coefficients().tolist(), strict=True))

    def command(
        self,
        x: State,
        to: State,
        *,
        rate: ArrayLike | ByAxis = (0.0,) * 6,
        acceleration: ArrayLike | ByAxis = (0.0,) * 6,
    ) -> Floats:
        """Computes the force for the next period, within the limits.

        Parameters
        ----------
        x
            The state, as of `Plant`.
        to
            Where the vehicle shall be: pose by name, as ``{"north": 1.0, "heading": 0.2}``, or
            six numbers.
        rate
            The rate of that: of the place, north, east and down, m/s, then turning in the
            desired body axes, rad/s; shape (6,) or some by the names of a pose.
        acceleration
            Its second rate, m/s² and rad/s², in the same axes.

        Returns
        -------
        numpy.ndarray
            X, Y, Z, N; K, M, N, N m; shape (6,); zero of axes that are not controlled.

        Raises
        ------
        InputError
            If an argument has another shape or is not finite.
        """
        pose = by_name("to", {} if to is None else to, STATES[:6])
        rates = [
            by_name("rate", rate, STATES[:6]),
            by_name("acceleration", acceleration, STATES[:6]),
        ]
        return self._native.command(np.asarray(state(x)), pose, rates[0], rates[1])

    def c_header(self) -> str:
        """Returns the controller in C, for the ``seaplant_plant.h`` of ``Plant.export("c")``.

        Returns
        -------
        str
            The text of ``seaplant_control.h``.

        Raises
        ------
        InputError
            If the header has no place for the law.
        """
        return self._native.c_header()

    def ardusub(self) -> tuple[str, tuple[str, ...]]:
        """Returns ArduSub's equivalent parameters.

        Returns
        -------
        tuple
            The text of a parameter file, and what of the gains it has no place for.
        """
        text, notes = self._native.ardusub()
        return text, tuple(notes)

    def __repr__(self) -> str:
        gains = self.gains
        axes = ", ".join(
            f"{dof} {of['bandwidth_hz']:g} Hz" for dof, of in gains["axes"].items()
        )
        adapts = ", adaptive" if gains["adapts"] else ""
        return f"<Controller by {gains['law']}{adapts}: {axes}>"
