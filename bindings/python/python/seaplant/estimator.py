"""Identification with the interface of scikit-learn."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np

from seaplant._choices import Terms
from seaplant._record import Floats
from seaplant._results import PlantResult
from seaplant.errors import InputError
from seaplant.fits import Fit
from seaplant.identification import identify
from seaplant.trials import Trial, trials_of
from seaplant.vehicles import Vehicle

__all__ = ["PlantEstimator"]


class PlantEstimator:
    """Fits the plant of one degree of freedom to a list of trials.

    It can be cloned, searched and cross-validated by scikit-learn, a sample being a trial::

        sklearn.model_selection.cross_val_score(estimator, trials, cv=3)

    Parameters
    ----------
    vehicle
        The vehicle.
    dof
        The degree of freedom.
    method
        The method.
    terms
        The terms to fit; see `seaplant.identify`.

    Attributes
    ----------
    fit_
        The whole fit.
    plant_
        The plant.
    """

    fit_: Fit
    plant_: PlantResult

    def __init__(
        self,
        vehicle: Vehicle,
        dof: str = "surge",
        method: str = "filter-error",
        terms: Terms = None,
    ) -> None:
        self.vehicle = vehicle
        self.dof = dof
        self.method = method
        self.terms = terms

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Returns the constructor's parameters.

        Parameters
        ----------
        deep
            Whether to look into parameters; none has any of its own.

        Returns
        -------
        dict
            By name.
        """
        del deep
        names = inspect.signature(type(self).__init__).parameters
        return {name: getattr(self, name) for name in names if name != "self"}

    def set_params(self, **params: Any) -> PlantEstimator:
        """Sets parameters.

        Parameters
        ----------
        **params
            By name.

        Returns
        -------
        PlantEstimator
            Itself.

        Raises
        ------
        InputError
            If there is no such parameter.
        """
        known = self.get_params()
        for name, value in params.items():
            if name not in known:
                raise InputError(f"{name!r} is no parameter; use {', '.join(known)}")
            setattr(self, name, value)
        return self

    def fit(self, trials: Sequence[Trial], y: object = None) -> PlantEstimator:
        """Fits the plant.

        Parameters
        ----------
        trials
            The trials, all of which are fitted to, whatever their role says.
        y
            Not used: a trial holds what was measured.

        Returns
        -------
        PlantEstimator
            Itself.

        Raises
        ------
        InputError
            If the plant cannot be identified.
        """
        del y
        fitted = [trial._as_role("fit") for trial in trials_of(trials)]
        self.fit_ = identify(fitted, self.vehicle, self.method, terms=self.terms)
        self.plant_ = self.fit_[self.dof]
        return self

    def predict(self, trials: Sequence[Trial]) -> list[Floats]:
        """Simulates the velocity of trials from their thrust.

        Parameters
        ----------
        trials
            The trials.

        Returns
        -------
        list of numpy.ndarray
            Velocity at the instants of each trial's own samples, m/s or rad/s.

        Raises
        ------
        InputError
            If the plant diverges.
        """
        fitted = self._fitted()
        return [fitted.simulate(trial, self.dof).simulated for trial in trials_of(trials)]

    def score(self, trials: Sequence[Trial], y: object = None) -> float:
        """Returns R² of simulated against raw velocity, over all trials together.

        Parameters
        ----------
        trials
            The trials.
        y
            Not used.

        Returns
        -------
        float
            1 is perfect, 0 no better than the mean velocity; minus infinity if the plant runs
            away.
        """
        del y
        held_out = [trial._as_role("hold-out") for trial in trials_of(trials)]
        scores = self._fitted().validate(held_out)
        (validation,) = (of for of in scores if of.axes == (self.dof,))
        r_squared = validation.score.by_axis[self.dof].r_squared
        return -np.inf if r_squared is None else r_squared

    def _fitted(self) -> Fit:
        if not self.__sklearn_is_fitted__():
            raise InputError("the estimator is not fitted; call fit with trials first")
        return self.fit_

    def __repr__(self) -> str:
        params = ", ".join(f"{name}={value!r}" for name, value in self.get_params().items())
        return f"PlantEstimator({params})"

    def __sklearn_tags__(self) -> Any:
        """Declares to scikit-learn a regressor whose inputs are not arrays."""
        from sklearn.utils import InputTags, RegressorTags, Tags, TargetTags

        return Tags(
            estimator_type="regressor",
            target_tags=TargetTags(required=False),
            regressor_tags=RegressorTags(),
            input_tags=InputTags(two_d_array=False),
        )

    def __sklearn_is_fitted__(self) -> bool:
        """Returns whether `fit` was called."""
        return hasattr(self, "plant_")
