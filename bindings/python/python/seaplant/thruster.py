"""Thrust curves from bollard-pull data."""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path

from numpy.typing import ArrayLike

from seaplant import _native
from seaplant._results import BollardPullResult
from seaplant._tables import floats
from seaplant.errors import InputError
from seaplant.vehicles import Input, QuadraticCurve

__all__ = ["curve", "fit"]

_INPUTS: dict[str, Input] = {"rad/s": "speed", "us": "pwm", "1": "command"}


def fit(
    inputs: ArrayLike | str | PathLike[str],
    forces: ArrayLike | None = None,
    *,
    input_unit: str | None = None,
    force_unit: str | None = None,
    input_column: str | None = None,
    force_column: str | None = None,
    neutral: float | None = None,
) -> BollardPullResult:
    """Fits ``F = k s|s|`` each way, with a deadband, as ``seaplant thruster`` does.

    Parameters
    ----------
    inputs
        The file of a table; or inputs, shape (n,).
    forces
        Forces, shape (n,), if inputs are given.
    input_unit
        rad/s, rpm, (rad/s)^2, us or 1; of a table, if the header does not state it.
    force_unit
        N, kgf or lbf; of a table, if the header does not state it.
    input_column
        The table's column of inputs; recognised by its unit if not given.
    force_column
        The table's column of forces; recognised by its unit if not given.
    neutral
        The input that means stop: 0, or 1500 for pulse widths, if not given.

    Returns
    -------
    BollardPullResult
        Coefficients with intervals, the misfit, and doubts.

    Raises
    ------
    FileError
        If the file cannot be read.
    InputError
        If units are missing, or the points do not determine a curve.

    Examples
    --------
    >>> import numpy as np, seaplant as sp
    >>> speed = np.linspace(-100.0, 100.0, 21)
    >>> force = 0.04 * speed * abs(speed)
    >>> found = sp.thruster.fit(speed, force, input_unit="rad/s", force_unit="N")
    >>> round(found.forward.value, 6)
    0.04
    """
    if forces is None:
        if not isinstance(inputs, (str, PathLike)):
            raise InputError("forces are missing; give one for each input")
        columns = {
            "input": input_column,
            "input_unit": input_unit,
            "force": force_column,
            "force_unit": force_unit,
        }
        stated = {name: of for name, of in columns.items() if of is not None}
        found = _native.fit_bench_table(Path(inputs), json.dumps(stated), neutral)
    else:
        if input_unit is None or force_unit is None:
            raise InputError("the numbers have no units; give input_unit= and force_unit=")
        if isinstance(inputs, PathLike):
            raise InputError("inputs name a file; its table has the forces, so give none")
        given, taken = floats("inputs", inputs), floats("forces", forces)
        found = _native.fit_bench_points(given, taken, input_unit, force_unit, neutral)
    return BollardPullResult.from_dict(json.loads(found))


def curve(fitted: BollardPullResult) -> QuadraticCurve:
    """Returns a fitted thrust curve in the form for `seaplant.Thruster`.

    Parameters
    ----------
    fitted
        What `fit` gives.

    Returns
    -------
    QuadraticCurve
        The curve; no thrust the way that was not measured.
    """

    def value(name: str) -> float:
        parameter = getattr(fitted, name)
        return 0.0 if parameter is None else float(parameter.value)

    return QuadraticCurve(
        forward=value("forward"),
        reverse=value("reverse"),
        input=_INPUTS[fitted.input_unit],
        deadband=value("deadband"),
        neutral=fitted.neutral,
    )
