"""Common fixtures: a short twin, its files, and the command line if it was built."""

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import seaplant as sp

SHORT = {"dofs": ["surge"], "duration_s": 120.0, "hold_out_s": 60.0}
WITH_STEADY = {
    "dofs": ["heave"],
    "duration_s": 120.0,
    "hold_out_s": 60.0,
    "steady": {"down": [0.6, 1.0], "up": [0.6], "duration_s": 120.0},
}


@pytest.fixture(scope="session")
def dive() -> sp.Twin:
    return sp.twin(SHORT)


@pytest.fixture(scope="session")
def campaign(dive: sp.Twin, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return dive.write(tmp_path_factory.mktemp("dive"))


@pytest.fixture(scope="session")
def heave_campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return sp.twin(WITH_STEADY).write(tmp_path_factory.mktemp("heave"))


@pytest.fixture(scope="session")
def fit(dive: sp.Twin) -> sp.Fit:
    return sp.identify(dive.trials, dive.vehicle)


@pytest.fixture(scope="session")
def command_line() -> Callable[..., Any]:
    """Runs ``seaplant --json`` and returns its output."""
    program = os.environ.get("SEAPLANT_PROGRAM")
    if program is None:
        pytest.skip("SEAPLANT_PROGRAM does not name the command line to compare with")

    def run(*arguments: object) -> Any:
        words = [program, "--json", *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
        return json.loads(done.stdout)

    return run
