"""Figures by Matplotlib, in the form of the paper's."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from seaplant._results import BollardPullResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from seaplant._channel import Channel
    from seaplant._simulation import Simulation

__all__ = ["as_html", "channels", "comparisons", "thrust"]

_ROTATIONS = ("roll", "pitch", "yaw")


def channels(drawn: Sequence[Channel], start_s: float) -> Figure:
    """Draws channels as a stack over one time axis.

    Parameters
    ----------
    drawn
        The channels.
    start_s
        What time counts from, s.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each channel.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 0.6 + 1.2 * len(drawn)), layout="constrained")
    panels = figure.subplots(len(drawn), 1, squeeze=False, sharex=True)[:, 0]
    for panel, channel in zip(panels, drawn, strict=True):
        panel.plot(channel.time_s - start_s, channel.values, lw=0.8)
        panel.set_title(f"{channel.name} [{channel.unit or 'no unit'}]", fontsize=8, loc="left")
    panels[-1].set_xlabel("time since the first sample [s]")
    return figure


def comparisons(rows: Sequence[Sequence[Simulation]]) -> Figure:
    """Draws model and measured velocity, with their difference below.

    Parameters
    ----------
    rows
        Simulations, in rows of one degree of freedom each.

    Returns
    -------
    matplotlib.figure.Figure
        Two panels for each simulation.

    Raises
    ------
    ValueError
        If there is none.
    """
    from matplotlib.figure import Figure

    columns = max((len(row) for row in rows), default=0)
    if columns == 0:
        raise ValueError("there is no simulation to draw")
    size = (5.0 * columns, 4.2 * len(rows))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(2 * len(rows), columns, squeeze=False, sharex=False)
    for k, row in enumerate(rows):
        for j in range(columns):
            above, below = panels[2 * k][j], panels[2 * k + 1][j]
            if j < len(row):
                _compare(above, below, row[j])
            else:
                above.set_axis_off()
                below.set_axis_off()
    return figure


def _compare(above: Axes, below: Axes, simulation: Simulation) -> None:
    unit = "rad/s" if simulation.dof in _ROTATIONS else "m/s"
    above.plot(simulation.time_s, simulation.measured, lw=0.7, color="0.6", label="measured")
    above.plot(simulation.time_s, simulation.simulated, lw=1.0, color="C0", label="model")
    above.set_title(f"{simulation.trial}: {simulation.dof} by {simulation.method}", fontsize=9)
    above.set_ylabel(f"{simulation.dof} [{unit}]")
    above.legend(loc="upper right", fontsize=8)
    difference = simulation.simulated - simulation.measured
    below.plot(simulation.time_s, difference, lw=0.7, color="C3")
    below.set_ylabel(f"model - measured [{unit}]")
    below.set_xlabel("time [s]")
    below.set_title(f"e = {simulation.mean_abs_error:.3g} {unit}", fontsize=9)


def as_html(figure: Figure, says: str) -> str:
    """Returns a figure as an image within HTML.

    Parameters
    ----------
    figure
        The figure.
    says
        What it shows, for those who do not see it.

    Returns
    -------
    str
        An HTML element that holds the image itself.
    """
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=100)
    data = base64.b64encode(image.getvalue()).decode()
    return (
        f'<figure><img alt="{html.escape(says)}" src="data:image/png;base64,{data}"></figure>'
    )


def thrust(fit: BollardPullResult) -> Figure:
    """Draws thrust against the square of the input, with the fitted lines.

    Parameters
    ----------
    fit
        What `seaplant.thruster.fit` gives.

    Returns
    -------
    matplotlib.figure.Figure
        Figure 2 of the paper.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.5, 4.0), layout="constrained")
    panel = figure.subplots()
    away = fit.points[:, 0] - fit.neutral
    panel.plot(away * np.abs(away), fit.points[:, 1], "o", ms=4, label="measured")
    deadband = 0.0 if fit.deadband is None else fit.deadband.value
    for side, sign, name in ((fit.forward, 1.0, "forward"), (fit.reverse, -1.0, "reverse")):
        if side is not None:
            reach = np.linspace(0.0, np.max(sign * away, initial=0.0))
            beyond = np.maximum(reach - deadband, 0.0)
            panel.plot(sign * reach**2, sign * side.value * beyond**2, label=f"{name}: {side}")
    panel.set_xlabel(f"input × |input| [({fit.input_unit})²]")
    panel.set_ylabel("thrust [N]")
    panel.legend(fontsize=8)
    return figure
