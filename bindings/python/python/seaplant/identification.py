"""Identification of plants, with their doubts, from trials and a vehicle."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from seaplant import _native
from seaplant._choices import (
    Methods,
    Settings,
    Terms,
    expected,
    methods_of,
    terms_of,
)
from seaplant._results import SteadyResult
from seaplant.fits import Fit
from seaplant.trials import Trial, only, trials_of
from seaplant.vehicles import Vehicle

__all__ = ["identify", "identify_campaign", "steady_drag"]


def identify(
    trials: Trial | Sequence[Trial],
    vehicle: Vehicle,
    method: Methods = None,
    *,
    plants: Settings | Sequence[Mapping[str, Any]] = None,
    terms: Terms = None,
    velocity: Literal["measured", "position"] | None = None,
    paper: Settings = None,
    equation_error: Settings = None,
    output_error: Settings = None,
    filter_error: Settings = None,
    steady: Settings = None,
) -> Fit:
    """Identifies every degree of freedom of the trials, as ``seaplant identify`` does.

    Fits ``v' = α τ + β v|v| + μ v + bias`` by each method to each degree of freedom by itself,
    and ``M ν̇ + C(M, ν) ν + D(ν) ν + g(η) = τ`` to the axes of each plant of several; scores
    each plant on fitted and held-out trials, finds steady drag, and gathers the doubts.

    Parameters
    ----------
    trials
        The trials, of any role.
    vehicle
        The vehicle.
    method
        A method, several of which the first is recommended, or ``"all"``; if not given
        filter-error, with output-error, equation-error and paper beside it.
    plants
        The plants of several axes, by the keys of ``[[plant]]`` in campaign.toml: ``axes``,
        ``symmetry``, ``model``, ``terms``, ``hold``, ``find_couplings``; one or several. If not
        given the usual plant of each set of axes that the trials serve; ``axes`` may be left
        out if they serve one.
    terms
        The terms to fit to a degree of freedom by itself: ``"force,quadratic,bias"`` or a list
        of force, quadratic, linear and bias.
    velocity
        Where every method takes velocity from; by default the paper's derives it from
        position, others take what was measured.
    paper
        Settings of the paper's method, by the keys of the table of that name in campaign.toml.
    equation_error
        Those of equation error, likewise.
    output_error
        Those of output error.
    filter_error
        Those of filter error.
    steady
        What counts as steady.

    Returns
    -------
    Fit
        What was found; what could not be done in one degree of freedom or by one method is
        among its ``failures``.

    Raises
    ------
    InputError
        If nothing could be identified, or a setting is wrong.

    Examples
    --------
    >>> import seaplant as sp
    >>> dive = sp.twin(dofs=["surge"], duration_s=120)
    >>> fit = sp.identify(dive.trials, dive.vehicle, method="equation-error")
    >>> abs(fit["surge"].parameters["mass.surge"].value / 12970.2 - 1) < 0.02
    True

    A plant of surge, sway and yaw, with what couples them:

    >>> dive = sp.twin(vehicle="published:otter-mss", duration_s=120, hold_out_s=60)
    >>> fit = sp.identify(dive.trials, dive.vehicle)
    >>> fit.mass_matrix.shape
    (3, 3)
    """
    given = trials_of(trials)
    tables = {
        "velocity": velocity,
        "methods": _native.method_names(methods_of(method)) or None,
        "fit": None if terms is None else {"terms": terms_of(terms)},
        "paper": paper,
        "equation-error": equation_error,
        "output-error": output_error,
        "filter-error": filter_error,
        "steady": steady,
        "plant": _plants_of(given, plants),
    }
    stated = {name: table for name, table in tables.items() if table is not None}
    settings = json.dumps({"vehicle": "", "trial": [], **stated})
    body = expected(Vehicle, vehicle, "vehicle", "make one with seaplant.Vehicle(...)")
    campaign = _native.Campaign.of(body._native, [of._native for of in given], settings)
    native = campaign.identify("seaplant.identify(trials, vehicle)")
    native.check()
    return Fit(native, given)


def _plants_of(
    trials: list[Trial], plants: Settings | Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Returns the requested plants of several axes, each with its axes."""
    served: list[list[str]] = []
    for trial in trials:
        served += [axes for axes in trial.axes if axes not in served]
    if plants is None:
        return [{"axes": axes} for axes in served]
    asked = [plants] if isinstance(plants, Mapping) else list(plants)
    usual = {"axes": served[0]} if len(served) == 1 else {}
    return [{**usual, **plant} for plant in asked]


def identify_campaign(
    campaign: str | PathLike[str],
    method: Methods = None,
    *,
    terms: Terms = None,
    out: str | PathLike[str] | None = None,
    force: bool = False,
) -> Fit:
    """Identifies a campaign.toml, as ``seaplant identify`` does.

    Parameters
    ----------
    campaign
        The campaign file.
    method
        A method, several of which the first is recommended, or ``"all"``; those of the file
        if not given.
    terms
        The terms to fit, in place of the campaign's.
    out
        The folder to write the report to; none is written if not given.
    force
        Whether to replace files there that Seaplant did not write, too.

    Returns
    -------
    Fit
        What was found.

    Raises
    ------
    FileError
        If a file cannot be read.
    InputError
        If a file is wrong, or nothing could be identified.
    """
    path, methods = Path(campaign), methods_of(method)
    chosen = None if terms is None else ",".join(terms_of(terms))
    opened = _native.Campaign.open(path, methods, chosen)
    words = ["seaplant identify", str(path), *(f"--method {name}" for name in methods)]
    words += [] if chosen is None else [f"--terms {chosen}"]
    words += [] if out is None else [f"--out {out}"]
    native = opened.identify(" ".join(words))
    native.check()
    fit = Fit(native, map(Trial._of, opened.trials()))
    if out is not None:
        fit.save(out, force=force)
    return fit


def steady_drag(
    trials: Trial | Sequence[Trial],
    dof: str | None = None,
    *,
    window_s: float = 20.0,
    slope_m_s2: float = 1.5e-3,
    thrust_part: float = 0.02,
) -> SteadyResult:
    """Estimates quadratic drag from the steady stretches of trials, whatever their role.

    Each stretch by itself, ``d_Q = τ / v|v|``; all together, ``τ = d_Q v|v| + b``.

    Parameters
    ----------
    trials
        The trials.
    dof
        The degree of freedom, if the first trial exercises several.
    window_s
        Length of the window that must be steady, s.
    slope_m_s2
        The greatest drift of velocity in it, m/s² or rad/s².
    thrust_part
        The greatest standard deviation of thrust in it, as a part of the trial's maximum.

    Returns
    -------
    SteadyResult
        Every stretch, and the drag and bias force that they share.

    Raises
    ------
    InputError
        If a trial has no steady stretch.
    """
    given = trials_of(trials)
    dof = only(given[0].dofs if given else [], dof, "the first trial")
    natives = [of._native for of in given]
    found = _native.steady_drag(natives, dof, window_s, slope_m_s2, thrust_part)
    return SteadyResult.from_dict(json.loads(found))
