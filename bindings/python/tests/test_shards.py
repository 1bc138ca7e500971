"""A log in shards gives the same result as in one piece, to the last digits."""

import itertools
import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
import seaplant as sp

EXACT = 1e-12
"""Part of an estimate: filters forget where a shard was cut to rounding, and no further."""

VEHICLE = sp.Vehicle(name="Skiff")
UNITS = {"wrench.surge": "N", "velocity.surge": "m/s"}


@pytest.fixture(scope="module")
def table(dive) -> dict[str, np.ndarray]:
    """Returns the twin's surge record as one table at 10 Hz, on a clock that starts in the
    past."""
    axis = sp.twin(dofs=["surge"], duration_s=480.0).trials[0].axis()
    force = axis.to_pandas()["force"].to_numpy()
    time = 1000.0 + np.arange(len(axis.time_s)) / 10.0
    return {"time": time, "wrench.surge": force, "velocity.surge": axis.velocity}


def part(table: dict[str, np.ndarray], from_s: float, to_s: float) -> sp.Trial:
    rows = (table["time"] >= from_s) & (table["time"] <= to_s)
    cut = {name: values[rows] for name, values in table.items()}
    return sp.Trial(cut, VEHICLE, "surge", units=UNITS, name="dive")


def reduce(shard):
    trial, clock, from_s, to_s = shard
    return sp.Shards.of(trial, clock, from_s=from_s, to_s=to_s)


def shards(table, cuts):
    clock = sp.ShardClock.of(part(table, 1000.0, 1480.0))
    margin = clock.margin_s()
    for k, (from_s, to_s) in enumerate(itertools.pairwise(cuts)):
        trial = part(table, from_s - margin, to_s + margin)
        yield trial, clock, from_s if k else None, to_s if k < len(cuts) - 2 else None


CUTS = [1000.0, 1100.0, 1213.4, 1350.05, 1480.0]


def values(of) -> np.ndarray:
    return np.array([of.mass.value, of.quadratic_drag.value, of.bias_force.value])


def test_shards_of_tables_add_up_to_the_fit_of_the_whole(table):
    whole = part(table, 1000.0, 1480.0)
    one = sp.identify(whole, VEHICLE, "equation-error")["surge"].by_axis["surge"]
    expected = values(one)
    parts = [reduce(shard) for shard in shards(table, CUTS)]
    forward = sp.accumulate(parts).plant()
    backward = sp.accumulate(reversed(parts)).plant()
    np.testing.assert_allclose(values(forward.parameters), expected, rtol=EXACT)
    np.testing.assert_allclose(values(backward.parameters), expected, rtol=EXACT)
    assert forward.parameters.mass.std == pytest.approx(one.mass.std, rel=1e-9)


def test_shards_travel_between_processes(table):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        parts = list(pool.map(reduce, shards(table, CUTS)))
    here = sp.accumulate(map(reduce, shards(table, CUTS)))
    there = sp.accumulate(parts).plant().parameters
    np.testing.assert_array_equal(values(there), values(here.plant().parameters))
    assert pickle.loads(pickle.dumps(here)).rows == here.rows == 4801


def test_shards_that_do_not_fit_together_are_refused(table):
    parts = list(shards(table, CUTS))
    first, second = reduce(parts[0]), reduce(parts[1])
    with pytest.raises(sp.InputError, match="another had, too"):
        sp.accumulate([first, second, first])
    with pytest.raises(sp.InputError, match="no shard"):
        sp.accumulate([])
    trial, clock, _, _ = parts[1]
    other = sp.Shards.of(trial, clock, from_s=1100.0, to_s=1213.4, terms="force,quadratic")
    with pytest.raises(sp.InputError, match="other terms"):
        first + other
    with pytest.raises(sp.InputError, match="before its first row"):
        sp.Shards.of(trial, clock, from_s=1050.0, to_s=1213.4)
