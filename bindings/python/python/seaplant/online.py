"""Identification sample by sample."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from seaplant import _native
from seaplant._choices import Settings
from seaplant._named import Named
from seaplant._record import Floats
from seaplant.plants import INPUTS, STATES, Plant, by_name
from seaplant.vehicles import Vehicle

__all__ = ["Online", "OnlineEstimate", "PlantChange"]


@dataclass(frozen=True)
class PlantChange:
    """A detected change of the plant.

    Attributes
    ----------
    since_s
        When it began, to blocks of 15 s, s of the samples.
    noticed_s
        When it was noticed, s of the samples.
    statistic
        The sum that crossed the threshold.
    """

    since_s: float
    noticed_s: float
    statistic: float


@dataclass(frozen=True, eq=False, repr=False)
class OnlineEstimate:
    """Estimates at an instant.

    Attributes
    ----------
    plant
        The plant; its M is positive definite and its damping takes power.
    std
        Standard deviation of each coefficient by name; infinite for what is not determined.
    inflation
        What each coefficient's variance is multiplied with because others look like it.
    excitation
        1 if every coefficient is determined by itself, 0 if some combination is not at all.
    residual
        Root mean square of what the equation misses on each axis, N and N m, shape (6,).
    noticeable_change
        By what part every mass must change at once for `Online.update` to tell of it within two
        minutes; ``None`` before two minutes have told what is usual.
    elapsed_s
        Motion so far, s.
    """

    plant: Plant
    std: dict[str, float]
    inflation: dict[str, float]
    excitation: float
    residual: Floats
    noticeable_change: float | None
    elapsed_s: float

    def __repr__(self) -> str:
        told = ", ".join(
            f"{name} = {of.value:.4g} ± {self.std[name]:.1g}"
            for name, of in self.plant.coefficients.items()
        )
        return f"<OnlineEstimate after {self.elapsed_s:.0f} s: {told}>"


class Online(Named):
    """Identifies a plant sample by sample; it keeps a few matrices and no past samples.

    Parameters
    ----------
    plant
        The axes to identify, as ``["surge", "sway", "yaw"]``, or a plant with the terms to
        identify; the adaptive observer then starts from its coefficients, the others take its
        terms only.
    scheme
        adaptive, recursive or ekf.
    symmetry
        Which axes M may couple, as in campaign.toml: none, port-starboard, diagonal.
    terms
        Terms beside mass, linear and quadratic damping, weight and righting: ``"surge: 1"`` is
        a constant force, ``"yaw: |v|r"`` damping of one axis by another.
    vehicle
        Its rigid body, where known, is the least that M may be.
    settings
        ``start_s``, ``observer_rate``, ``adaptation_s``, ``cutoff_hz``, ``memory_s``,
        ``wander_per_minute``, ``change_threshold``, ``longest_step_s``.

    Raises
    ------
    InputError
        If a choice is unknown or cannot be.

    Examples
    --------
    A vehicle of 100 kg with 5 N/(m/s) and 20 N/(m/s)², sampled 20 times a second:

    >>> import math
    >>> import seaplant as sp
    >>> online = sp.Online(["surge"], scheme="adaptive")
    >>> v = 0.0
    >>> for k in range(4000):
    ...     t = 0.05 * k
    ...     force = 40.0 * math.sin(0.7 * t) + 25.0 * math.sin(0.2 * t)
    ...     changed = online.update(t, {"u": v}, {"surge": force})
    ...     for _ in range(10):
    ...         v += 0.005 * (force - 5.0 * v - 20.0 * v * abs(v)) / 100.0
    >>> found = online.estimate()
    >>> abs(found.plant.coefficients["mass.surge"].value - 100.0) < 2.0
    True
    >>> online.predict(1.0).shape
    (6,)
    """

    def __init__(
        self,
        plant: Sequence[str] | Plant,
        *,
        scheme: str = "adaptive",
        symmetry: str = "port-starboard",
        terms: Sequence[str] = (),
        vehicle: Vehicle | None = None,
        settings: Settings = None,
    ) -> None:
        start = plant._native if isinstance(plant, Plant) else None
        axes = [] if isinstance(plant, Plant) else list(plant)
        asked = {
            "scheme": scheme,
            "axes": axes,
            "symmetry": symmetry,
            "terms": list(terms),
            "settings": dict(settings or {}),
        }
        body = None if vehicle is None else vehicle._native
        self._native = _native.Online(json.dumps(asked), start, body)
        self._names = tuple(self._native.names())

    def update(
        self,
        time_s: float,
        velocity: ArrayLike | Mapping[str, float],
        force: ArrayLike | Mapping[str, float],
        *,
        roll: float = 0.0,
        pitch: float = 0.0,
        signals: Mapping[str, float] | None = None,
    ) -> PlantChange | None:
        """Processes a sample.

        A step longer than ``longest_step_s`` counts as a gap: motion begins anew after it, and
        what was learnt stays.

        Parameters
        ----------
        time_s
            When, s.
        velocity
            Through the water, in body axes, m/s and rad/s, shape (6,) or some by name, as
            ``{"u": 0.5}``; of axes that the plant does not have, too.
        force
            From this instant to the next, N and N m, shape (6,) or some by axis, as
            ``{"surge": 40.0}``.
        roll
            Rad.
        pitch
            Rad.
        signals
            What the plant's rudders, fins, propellers of unknown strength and wind read, each
            of `signal_names`.

        Returns
        -------
        PlantChange or None
            The change of the plant, if one is noticed with this sample.

        Raises
        ------
        InputError
            If a number is not finite, a signal is missing or time does not go on; the estimator
            is then as it was.
        """
        v = by_name("velocity", velocity, STATES[6:])
        tau = by_name("force", force, INPUTS)
        read = {name: float(value) for name, value in (signals or {}).items()}
        change = self._native.update(float(time_s), v, tau, (float(roll), float(pitch)), read)
        return None if change is None else PlantChange(*change)

    def predict(self, duration_s: float) -> Floats | None:
        """Predicts velocity under the last sample's force.

        Parameters
        ----------
        duration_s
            How far ahead, s.

        Returns
        -------
        numpy.ndarray or None
            Velocity, m/s and rad/s, shape (6,); ``None`` before the first sample.

        Raises
        ------
        InputError
            If nothing was learnt yet, or the time is not from 0 to 3600 s.
        """
        return self._native.predict(float(duration_s))

    def estimate(self) -> OnlineEstimate:
        """Returns the current estimate.

        Returns
        -------
        OnlineEstimate
            The plant and how well it is determined.

        Raises
        ------
        InputError
            If nothing was learnt yet.
        """
        plant, std, inflation, excitation, residual, change, elapsed_s = self._native.estimate()
        named = [
            dict(zip(self._names, all_.tolist(), strict=True)) for all_ in (std, inflation)
        ]
        return OnlineEstimate(
            Plant(plant), named[0], named[1], excitation, residual, change, elapsed_s
        )

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Names of the inputs that `update` needs in addition to motion and force.

        Angles of rudders and fins (``rudder.NAME.angle``, rad), drives of propellers
        (``thruster.NAME.drive``, N, rad/s or a ratio) and the velocity of the air over ground
        in body axes (``wind.forward``, ``wind.starboard``, m/s).
        """
        return tuple(self._native.signal_names())

    @property
    def has_started(self) -> bool:
        """True once the scheme itself has started; before, its estimates are least squares."""
        return bool(self._native.has_started())

    @property
    def coefficients(self) -> dict[str, float]:
        """The current coefficients by name: cheaper than `estimate`."""
        values = self._native.coefficients().tolist()
        return dict(zip(self._names, values, strict=True))

    def restart(self) -> None:
        """Starts a new motion with the next sample, as after a gap."""
        self._native.restart()

    def __repr__(self) -> str:
        return f"<Online of {', '.join(self._names)}>"
