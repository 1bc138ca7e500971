"""Results of an identification: plants, intervals, scores and doubts."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from numpy.typing import ArrayLike

from seaplant import _native, plots
from seaplant._files import read_results, write_files
from seaplant._named import Named
from seaplant._record import Floats
from seaplant._results import (
    Caveat,
    Coefficient,
    Failure,
    Parameter,
    PlantResult,
    Results,
    SteadyResult,
    Validation,
)
from seaplant._simulation import Simulation
from seaplant.errors import InputError
from seaplant.plants import Linear, Motion, Plant, State
from seaplant.trials import Trial, only, trials_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Fit", "Simulation"]


class Fit(Named):
    """Result of an identification: plants, intervals, scores and doubts.

    Made by `identify`, `identify_campaign` or, of a results.json, by `Fit.open`.

    Parameters
    ----------
    native
        The results as the library holds them.
    trials
        The trials that were identified.
    """

    def __init__(self, native: _native.Results, trials: Iterable[Trial] = ()) -> None:
        self._native = native
        self._text = native.to_json()
        self.results: Results = Results.from_dict(json.loads(self._text))
        self.trials: tuple[Trial, ...] = tuple(trials)

    @classmethod
    def open(cls, path: str | PathLike[str]) -> Fit:
        """Reads a results.json.

        Parameters
        ----------
        path
            The file that ``seaplant identify`` or `Fit.save` wrote, or its folder.

        Returns
        -------
        Fit
            The fit, without its trials.

        Raises
        ------
        FileError
            If the file cannot be read.
        InputError
            If it is another file, or of another version.
        """
        return cls(read_results(path))

    def _item(self, name: str) -> str | None:
        if "results" in vars(self) and name in self.plants:
            return f"[{name!r}]"
        return super()._item(name)

    @property
    def plants(self) -> dict[str, PlantResult]:
        """The recommended plants, by their axes: ``surge``, ``surge-sway-yaw``."""
        return self.results.plants

    @property
    def methods(self) -> dict[str, dict[str, PlantResult]]:
        """Every method's plants, by their axes."""
        return self.results.methods

    @property
    def mass_matrix(self) -> Floats:
        """M of the plant of several axes, shape (n, n): rigid body plus added mass.

        Rows and columns are its ``axes``; ``fit.plants[...].mass_matrix.std`` has the standard
        deviations.
        """
        several = [name for name, plant in self.plants.items() if plant.alone is None]
        if len(several) != 1:
            known = ", ".join(several) or "none"
            raise InputError(
                f"a mass matrix is that of one plant of several axes, and the fit has {known}; "
                "take that of fit.plants[...]"
            )
        return self.plants[several[0]].mass_matrix.value

    @property
    def steady(self) -> dict[str, SteadyResult]:
        """Drag from steady stretches, by degree of freedom."""
        return self.results.steady

    @property
    def failures(self) -> tuple[Failure, ...]:
        """The failures, with reasons."""
        return self.results.failures

    @property
    def caveats(self) -> list[Caveat]:
        """Every doubt: about the campaign, then plant by plant."""
        of_plants = (caveat for plant in self.plants.values() for caveat in plant.caveats)
        return [*self.results.caveats, *of_plants]

    def __getitem__(self, name: str) -> PlantResult:
        if name not in self.plants:
            raise self._no_plant(name)
        return self.plants[name]

    def _no_plant(self, name: str) -> _NoPlantError:
        known = ", ".join(self.plants) or "none"
        return _NoPlantError(f"the fit has no plant of {name!r}; it has {known}")

    def plant(self, method: str | None = None) -> Plant:
        """Returns the plant of the complete vehicle, which simulates, linearises and exports.

        Parameters
        ----------
        method
            The method whose plants of single axes to use; the recommended one's if not given.

        Returns
        -------
        Plant
            The plants of several axes, and beside them each axis that was identified by itself.

        Raises
        ------
        InputError
            If there is no such plant.
        """
        return Plant(_native.Plant.of_results(self._native, "results.json", method))

    def linearise(self, at: State = None, *, current: Sequence[float] = (0, 0, 0)) -> Linear:
        """Linearises the plant about a state, as `Plant.linearise` does.

        Parameters
        ----------
        at
            The state, as ``{"u": 0.5}``; at rest and level if not given.
        current
            Velocity of the water north, east and down, m/s.

        Returns
        -------
        Linear
            State space of what the plant moves; ``to_control()`` gives it to python-control.

        Raises
        ------
        InputError
            If there is no plant, or the state is none.
        """
        return self.plant().linearise(at, current=current)

    @overload
    def simulate(
        self, trial: Trial, dof: str | None = None, *, method: str | None = None
    ) -> Simulation: ...

    @overload
    def simulate(
        self, trial: ArrayLike, dof: Mapping[str, ArrayLike], *, method: str | None = None
    ) -> Motion: ...

    def simulate(
        self,
        trial: Trial | ArrayLike,
        dof: str | Mapping[str, ArrayLike] | None = None,
        *,
        method: str | None = None,
    ) -> Simulation | Motion:
        """Simulates a fitted plant with the thrust of a trial, or with inputs alone.

        An axis that was not identified by itself is that of a plant of several, simulated
        freely from the start of the trial. ``fit.simulate(trial)`` compares with its velocity,
        as the command line does with a log. ``fit.simulate(t, inputs)`` says what the vehicle
        would do, from rest;
        ``fit.plant().simulate`` takes a state, a current and draws, too.

        Parameters
        ----------
        trial
            The trial; its velocity is what the simulation is compared with. Or instants, s.
        dof
            The axis, if the fit holds several. Or inputs by name, as
            ``{"force.surge": 40.0}`` or ``{"thruster.port": speeds}``.
        method
            The method whose plant to use; the recommended one's if not given.

        Returns
        -------
        Simulation or Motion
            Measured and simulated velocity, and how well they agree; or pose and velocity with
            their band.

        Raises
        ------
        InputError
            If there is no such plant, or it diverges.
        """
        if not isinstance(trial, Trial):
            if not isinstance(dof, Mapping):
                raise InputError('give a trial, or times and inputs: {"force.surge": 40.0}')
            return self.plant(method).simulate(trial, dof)
        if isinstance(dof, Mapping):
            raise InputError("a trial has inputs of its own; give times to simulate others")
        axes = dict.fromkeys(of for plant in self.plants.values() for of in plant.axes)
        dof = only(list(axes), dof, "the fit")
        names = self._names_of(dof)
        served = [name for name in names if self._serves(trial, name)]
        if not served:
            raise InputError(
                f"trial {trial.name!r} was not made for {', '.join(names)}; make it with axes= "
                "or dof=, as in seaplant.Trial(log, vehicle, axes=...)"
            )
        found = self._simulate(trial, served[0], method)
        if dof not in found:
            raise InputError(
                f"the simulation of {dof} of {trial.name!r} runs away, or its velocity was not "
                "measured"
            )
        return found[dof]

    def _names_of(self, dof: str) -> list[str]:
        """Returns the name of an axis if it has a plant, or of the plants that have it, too."""
        names = [name for name, plant in self.plants.items() if dof in plant.axes]
        if not names:
            raise self._no_plant(dof)
        return [dof] if dof in names else names

    def _serves(self, trial: Trial, name: str) -> bool:
        """Returns whether a trial was made for the axes of a plant."""
        plant = self.plants[name]
        return list(plant.axes) in trial.axes if plant.alone is None else name in trial.dofs

    def _simulate(self, trial: Trial, name: str, method: str | None) -> dict[str, Simulation]:
        """Simulates the measured axes of a plant, of several without those that diverge."""
        used = method or self.plants[name].method
        found = self._native.simulate(trial._native, name, method)
        return {
            dof: Simulation(dof, trial.name, used, error, null_error, r_squared, *series)
            for dof, error, null_error, r_squared, series in found
        }

    def validate(
        self, trials: Trial | Iterable[Trial], *, method: str | None = None
    ) -> list[Validation]:
        """Scores the plants on trials, as ``seaplant validate`` does.

        Parameters
        ----------
        trials
            The trials, of which steady ones are passed over.
        method
            The method whose plants to use; the recommended one's if not given.

        Returns
        -------
        list of Validation
            For each plant, by axis, e on raw velocity, beside a model that never moves; and
            which trials the plant was fitted to, so that their scores flatter it.

        Raises
        ------
        InputError
            If no trial exercises the axes of a plant.
        """
        given = trials_of(trials)
        scores = json.loads(self._native.validate([of._native for of in given], method))
        if not scores:
            raise InputError("no trial exercises the axes of a plant of the fit")
        return [Validation.from_dict(of) for of in scores]

    def plot(self, dof: str | None = None, *, method: str | None = None) -> Figure:
        """Draws model and measured velocity of every trial, with their difference below.

        Parameters
        ----------
        dof
            The axis; all, if not given.
        method
            The method whose plants to use; the recommended one's if not given.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, as figures 3 to 6 of the paper.

        Raises
        ------
        InputError
            If the fit has no trials, as one that was read from a file.
        """
        moving = [trial for trial in self.trials if trial.role != "steady"]
        names = list(self.plants) if dof is None else self._names_of(dof)
        if method is not None:
            # Where no plant is by it, the library says so.
            names = [name for name in names if method in self.methods.get(name, {})] or names
        rows = []
        for name in names:
            serving = [trial for trial in moving if self._serves(trial, name)]
            found = [self._simulate(trial, name, method) for trial in serving]
            axes = [axis for axis in self.plants[name].axes if dof in (None, axis)]
            rows += [[of[axis] for of in found if axis in of] for axis in axes]
        if not any(rows):
            raise InputError("the fit has no trials to draw; simulate one and draw that")
        return plots.comparisons(rows)

    def to_pandas(self) -> pd.DataFrame:
        """Returns every parameter of every method.

        Returns
        -------
        pandas.DataFrame
            Columns ``value``, ``std``, ``low95``, ``high95``, ``unit``, by ``dof`` (the name
            of the plant: its axes), ``method`` and ``parameter``; nuisances among the
            parameters.
        """
        import pandas as pd

        rows = [
            {"dof": of, "method": method, "parameter": name, **parameter.to_dict()}
            for of, methods in self.methods.items()
            for method, plant in methods.items()
            for name, parameter in _parameters(plant).items()
        ]
        columns = ["dof", "method", "parameter", "value", "std", "low95", "high95", "unit"]
        index = ["dof", "method", "parameter"]
        return pd.DataFrame(rows, columns=columns).set_index(index)

    def to_xarray(self) -> xr.Dataset:
        """Returns the parameters as a dataset.

        Returns
        -------
        xarray.Dataset
            ``value``, ``std``, ``low95`` and ``high95`` along ``dof``, ``method`` and
            ``parameter``; ``NaN`` where one was not fitted.
        """
        frame = self.to_pandas().drop(columns="unit")
        dataset: xr.Dataset = frame.to_xarray()
        return dataset

    def save(self, folder: str | PathLike[str], *, force: bool = False) -> Path:
        """Writes the files of ``seaplant identify``: results.json, report, figures, tables.

        Parameters
        ----------
        folder
            The folder; files that Seaplant wrote are replaced once all are made.
        force
            Whether to replace other files, too.

        Returns
        -------
        pathlib.Path
            The folder.

        Raises
        ------
        InputError
            If a file is in the way that Seaplant did not write.
        OSError
            If the system does not let it be written.
        """
        files = self._native.render([of._native for of in self.trials])
        return write_files(folder, files, "report", force=force)

    def __repr__(self) -> str:
        lines = [f"<Fit of {self.results.vehicle!r}"]
        for name, plant in self.plants.items():
            lines.append(f"  {name} by {plant.method}: {_judged(plant)}")
            lines += [f"    {parameter}: {of}" for parameter, of in plant.parameters.items()]
        lines += [f"  steady {dof}: {of.quadratic_drag}" for dof, of in self.steady.items()]
        lines += [f"  {of.dof} by {of.method} failed: {of.message}" for of in self.failures]
        return "\n".join(lines) + ">"

    def _repr_html_(self) -> str:
        rows = "".join(_html_rows(name, plant) for name, plant in self.plants.items())
        doubts = "".join(f"<li>{html.escape(of.message)}</li>" for of in self.caveats)
        judged = "".join(_html_verdict(name, plant) for name, plant in self.plants.items())
        head = "".join(f"<th>{of}</th>" for of in ("", "", "value", "95 % interval", "unit"))
        name = html.escape(self.results.vehicle)
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
        count = f"<summary>{len(self.caveats)} caveats</summary>"
        folded = f"<details>{count}<ul>{doubts}</ul></details>"
        return f"<h4>{name}</h4><ul>{judged}</ul>{table}{folded}{self._figure_html()}"

    def _figure_html(self) -> str:
        """Draws the figure, if there are trials and Matplotlib is available."""
        try:
            return plots.as_html(self.plot(), "model and measured velocity")
        except (ImportError, InputError):
            return ""

    def __reduce__(self) -> tuple[Any, ...]:
        # Trials of a campaign are not kept, as in a fit that was read from a file.
        kept = self.trials if all(of._recipe is not None for of in self.trials) else ()
        return _remade, (self._text, kept)


class _NoPlantError(InputError, KeyError):
    """A fit without the requested plant."""

    def __str__(self) -> str:
        return str(self.args[0])


def _judged(plant: PlantResult) -> str:
    """Returns the verdict, the error on held-out trials, and the number of caveats."""
    verdict, count = plant.verdict, len(plant.caveats)
    said = verdict.trust.replace("-", " ")
    if said != "usable":
        said += f" ({verdict.reason})"
    caveats = f"{count} caveat{'' if count == 1 else 's'}"
    if plant.alone is None:
        # The verdict on a plant of several axes says how it predicts each.
        return f"{said}; {caveats}"
    for what, score in (("held out", plant.hold_out), ("left out", plant.left_out)):
        of = None if score is None else score.by_axis[plant.axes[0]].r_squared
        if of is not None:
            said += f"; R² {what} {of:.3f}"
            break
    if not plant.alone.stable:
        said += "; unstable"
    return f"{said}; {caveats}"


def _html_verdict(name: str, plant: PlantResult) -> str:
    return f"<li><b>{name}</b> by {plant.method}: {html.escape(_judged(plant))}</li>"


def _remade(text: str, trials: tuple[Trial, ...]) -> Fit:
    return Fit(_native.Results.of_json(text), trials)


def _parameters(plant: PlantResult) -> dict[str, Parameter | Coefficient]:
    return {**plant.parameters, **plant.nuisances}


def _html_rows(of_plant: str, plant: PlantResult) -> str:
    rows = []
    for name, of in _parameters(plant).items():
        value, std, low95, high95 = _native.rounded(of.value, of.std, of.low95, of.high95)
        cells = (of_plant, name, f"{value} ± {std}", f"{low95} … {high95}", of.unit)
        rows.append("".join(f"<td>{html.escape(cell)}</td>" for cell in cells))
    return "".join(f"<tr>{row}</tr>" for row in rows)
