"""The tutorial runs, and finds what it says it finds."""

import runpy
import time
from pathlib import Path

import pytest
import seaplant as sp
from seaplant import _native

TUTORIAL = Path(__file__).parents[1] / "tutorial.py"


def test_the_tutorial_runs_from_log_to_report(capsys):
    found = runpy.run_path(str(TUTORIAL))
    said = capsys.readouterr().out
    assert "surge by filter-error" in said and "report.html" in said
    assert (found["folder"] / "surge.png").stat().st_size > 10_000
    assert found["mass"].interval95[0] < found["truth"].mass < found["mass"].interval95[1]


OVERHEAD = 0.05
"""Part of the library's time that Python may add."""


@pytest.mark.parametrize("attempts", [3])
def test_python_adds_little_to_the_library(attempts):
    dive = sp.twin(dofs=["surge"])
    assert dive.trials[0].axis().time_s[-1] > 479.0
    trials, settings = [dive.trials[0]], '{"vehicle": "", "trial": []}'

    def least(of) -> float:
        """The least of several times: what other programs take comes on top."""
        times = []
        for _ in range(7):
            started = time.perf_counter()
            of()
            times.append(time.perf_counter() - started)
        return min(times)

    def library() -> None:
        natives = [trial._native for trial in trials]
        _native.Campaign.of(dive.vehicle._native, natives, settings).identify("")

    ratios = []
    for _ in range(attempts):
        ratios.append(least(lambda: sp.identify(trials, dive.vehicle)) / least(library))
        if ratios[-1] < 1.0 + OVERHEAD:
            return
    pytest.fail(f"Python's time over the library's is {ratios}")
