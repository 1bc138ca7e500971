"""The estimator follows scikit-learn's rules."""

import numpy as np
import pytest
import seaplant as sp
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer


@pytest.fixture(scope="module")
def trials() -> tuple[sp.Vehicle, list[sp.Trial]]:
    """Returns five dives of one vehicle."""
    dives = [sp.twin(dofs=["surge"], duration_s=120.0, seed=seed) for seed in range(5)]
    renamed = [
        sp.Trial(dive.logs["surge 1"], dive.vehicle, "surge", name=f"dive {k}")
        for k, dive in enumerate(dives)
    ]
    return dives[0].vehicle, renamed


def test_cross_validation_over_trials_predicts_each_from_the_others(trials):
    vehicle, dives = trials
    estimator = sp.PlantEstimator(vehicle, "surge", "equation-error")
    scores = cross_val_score(estimator, dives, cv=5)
    assert scores.shape == (5,) and np.all(scores > 0.99)


def test_a_search_over_methods_finds_the_paper_worst(trials):
    vehicle, dives = trials
    search = GridSearchCV(
        sp.PlantEstimator(vehicle), {"method": ["paper", "equation-error"]}, cv=3
    ).fit(dives)
    assert search.best_params_ == {"method": "equation-error"}


def test_parameters_are_got_set_and_cloned(trials):
    vehicle, dives = trials
    estimator = sp.PlantEstimator(vehicle, method="paper")
    assert clone(estimator).get_params()["method"] == "paper"
    assert estimator.set_params(method="equation-error").method == "equation-error"
    with pytest.raises(sp.InputError, match="is no parameter"):
        estimator.set_params(metod="paper")
    (predicted,) = estimator.fit(dives[:4]).predict(dives[4:])
    measured = dives[4].axis().velocity
    assert predicted.shape == measured.shape
    residual = (
        np.square(predicted - measured).sum() / np.square(measured - measured.mean()).sum()
    )
    assert estimator.score(dives[4:]) == pytest.approx(1.0 - residual, abs=1e-12)


def test_a_pipeline_ends_in_it(trials):
    vehicle, dives = trials
    pipeline = make_pipeline(
        FunctionTransformer(lambda given: list(given), validate=False),
        sp.PlantEstimator(vehicle, "surge", "equation-error"),
    )
    assert pipeline.fit(dives[:4]).score(dives[4:]) > 0.99


def test_an_estimator_that_was_not_fitted_says_so(trials):
    vehicle, dives = trials
    with pytest.raises(sp.InputError, match="call fit with trials first"):
        sp.PlantEstimator(vehicle).predict(dives)
