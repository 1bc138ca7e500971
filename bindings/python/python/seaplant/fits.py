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
    FittedPlant,
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
        """The recommended plant of each degree of freedom."""
        return self.results.plants

    @property
    def methods(self) -> dict[str, dict[str, PlantResult]]:
        """Every method's plant of each degree of freedom."""
        return self.results.methods

    @property
    def coupled(self) -> dict[str, FittedPlant]:
        """The plants of several axes, by their axes: ``surge-sway-yaw``."""
        return self.results.coupled

    @property
    def mass_matrix(self) -> Floats:
        """M of the plant of several axes, shape (n, n): rigid body plus added mass.

        Rows and columns are the axes of the plant, ``next(iter(fit.coupled.values())).axes``;
        its ``mass_matrix.std`` has the standard deviations.
        """
        if len(self.coupled) != 1:
            known = ", ".join(self.coupled) or "none"
            raise InputError(
                f"a mass matrix is that of one plant of several axes, and the fit has {known}; "
                "take that of fit.coupled[...]"
            )
        (plant,) = self.coupled.values()
        return plant.mass_matrix.value

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
        of_plants = (caveat for plant in self._all.values() for caveat in plant.caveats)
        return [*self.results.caveats, *of_plants]

    def __getitem__(self, dof: str) -> PlantResult:
        try:
            return self.plants[dof]
        except KeyError:
            known = ", ".join(self.plants) or "none"
            if self.coupled:
                known += f", and of several axes fit.coupled[{next(iter(self.coupled))!r}]"
            raise _NoPlantError(f"the fit has no plant of {dof!r}; it has {known}") from None

    def plant(self, method: str | None = None) -> Plant:
        """Returns the plant of the complete vehicle, which simulates, linearises and exports.

        Parameters
        ----------
        method
            The method whose plants of single axes to use; the recommended one's if not given.

        Returns
        -------
        Plant
            The coupled plants, and beside these each axis that was identified by itself.

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
            The degree of freedom, if the fit holds several. Or inputs by name, as
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
        served = [of for plant in self.coupled.values() for of in plant.axes]
        dof = only(list(dict.fromkeys([*self.plants, *served])), dof, "the fit")
        if dof in served and dof not in self.plants:
            return self._simulate_several_axes(trial)[dof]
        error, null_error, r_squared, series = self._native.simulate(trial._native, dof, method)
        used = method or self.plants[dof].method
        return Simulation(dof, trial.name, used, error, null_error, r_squared, *series)

    def _simulate_several_axes(self, trial: Trial) -> dict[str, Simulation]:
        """Simulates each axis of the plants of several axes that a trial serves."""
        found = {}
        for name, plant in self.coupled.items():
            if list(plant.axes) not in trial.axes:
                continue
            for dof, (
                error,
                null_error,
                r_squared,
                series,
            ) in self._native.simulate_several_axes(trial._native, name):
                scores = (error, null_error, r_squared)
                found[dof] = Simulation(dof, trial.name, plant.method, *scores, *series)
        if not found:
            known = ", ".join(self.coupled)
            raise InputError(
                f"trial {trial.name!r} was not made for {known}, or the simulation runs away; "
                "make it with axes=, as in seaplant.Trial(log, vehicle, axes=...)"
            )
        return found

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
            For each degree of freedom e on raw velocity, beside a model that never moves; and
            which trials the plant was fitted to, so that their scores flatter it.

        Raises
        ------
        InputError
            If no trial exercises a degree of freedom that the fit holds.
        """
        given = trials_of(trials)
        scores = json.loads(self._native.validate([of._native for of in given], method))
        if not scores:
            raise InputError("no trial exercises a degree of freedom that the fit holds")
        return [Validation.from_dict(of) for of in scores]

    def plot(self, dof: str | None = None, *, method: str | None = None) -> Figure:
        """Draws model and measured velocity of every trial, with their difference below.

        Parameters
        ----------
        dof
            The degree of freedom; all, if not given.
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
        rows = []
        for of in self.plants if dof is None else [dof]:
            own = [trial for trial in moving if of in trial.dofs]
            rows.append([self.simulate(trial, of, method=method) for trial in own])
        sets = [list(plant.axes) for plant in self.coupled.values()]
        if method is None and (dof is None or dof not in self.plants):
            serving = [trial for trial in moving if any(axes in sets for axes in trial.axes)]
            found = [self._simulate_several_axes(trial) for trial in serving]
            served = [axis for axes in sets for axis in axes if dof in (None, axis)]
            rows += [[of[axis] for of in found if axis in of] for axis in served]
        if not any(rows):
            raise InputError("the fit has no trials to draw; simulate one and draw that")
        return plots.comparisons(rows)

    def to_pandas(self) -> pd.DataFrame:
        """Returns every parameter of every method.

        Returns
        -------
        pandas.DataFrame
            Columns ``value``, ``std``, ``low95``, ``high95``, ``unit``, by ``dof`` (of a plant
            of several axes its name), ``method`` and ``parameter``; nuisances among the
            parameters.
        """
        import pandas as pd

        plants: list[tuple[str, str, PlantResult | FittedPlant]]
        plants = [(name, plant.method, plant) for name, plant in self.coupled.items()]
        for dof, methods in self.methods.items():
            plants += [(dof, method, plant) for method, plant in methods.items()]
        rows = [
            {"dof": of, "method": method, "parameter": name, **parameter.to_dict()}
            for of, method, plant in plants
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
        for name, plant in self._all.items():
            lines.append(f"  {name} by {plant.method}: {_judged(plant)}")
            lines += [f"    {parameter}: {of}" for parameter, of in _own(plant).items()]
        lines += [f"  steady {dof}: {of.quadratic_drag}" for dof, of in self.steady.items()]
        lines += [f"  {of.dof} by {of.method} failed: {of.message}" for of in self.failures]
        return "\n".join(lines) + ">"

    @property
    def _all(self) -> dict[str, PlantResult | FittedPlant]:
        """Returns the plants of several axes, and the recommended ones of one axis."""
        return {**self.coupled, **self.plants}

    def _repr_html_(self) -> str:
        rows = "".join(_html_rows(name, plant) for name, plant in self._all.items())
        doubts = "".join(f"<li>{html.escape(of.message)}</li>" for of in self.caveats)
        judged = "".join(_html_verdict(name, plant) for name, plant in self._all.items())
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


def _judged(plant: PlantResult | FittedPlant) -> str:
    """Returns the verdict, the error on held-out trials, and the number of caveats."""
    verdict, count = plant.verdict, len(plant.caveats)
    said = verdict.trust.replace("-", " ")
    if said != "usable":
        said += f" ({verdict.reason})"
    caveats = f"{count} caveat{'' if count == 1 else 's'}"
    if isinstance(plant, FittedPlant):
        # The verdict on a plant of several axes says how it predicts each.
        return f"{said}; {caveats}"
    for what, score in (("held out", plant.hold_out), ("left out", plant.left_out)):
        if score is not None and score.r_squared is not None:
            said += f"; R² {what} {score.r_squared:.3f}"
            break
    if not plant.stable:
        said += "; unstable"
    return f"{said}; {caveats}"


def _html_verdict(name: str, plant: PlantResult | FittedPlant) -> str:
    return f"<li><b>{name}</b> by {plant.method}: {html.escape(_judged(plant))}</li>"


def _remade(text: str, trials: tuple[Trial, ...]) -> Fit:
    return Fit(_native.Results.of_json(text), trials)


def _own(plant: PlantResult | FittedPlant) -> dict[str, Parameter | Coefficient]:
    if isinstance(plant, FittedPlant):
        return dict(plant.parameters)
    named = vars(plant.parameters)
    return {name: of for name, of in named.items() if isinstance(of, Parameter)}


def _parameters(plant: PlantResult | FittedPlant) -> dict[str, Parameter | Coefficient]:
    return {**_own(plant), **plant.nuisances}


def _html_rows(of_plant: str, plant: PlantResult | FittedPlant) -> str:
    rows = []
    for name, of in _parameters(plant).items():
        value, std, low95, high95 = _native.rounded(of.value, of.std, of.low95, of.high95)
        cells = (of_plant, name, f"{value} ± {std}", f"{low95} … {high95}", of.unit)
        rows.append("".join(f"<td>{html.escape(cell)}</td>" for cell in cells))
    return "".join(f"<tr>{row}</tr>" for row in rows)
