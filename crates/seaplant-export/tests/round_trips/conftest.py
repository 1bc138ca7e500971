"""Round trips: exported plants run by other engines, beside Seaplant's own motion.

`scripts/round-trips` writes the plants and their motion to the folder ROUND_TRIPS and runs these.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

FOLDER = Path(os.environ["ROUND_TRIPS"])
CASES = sorted(path.parent.name for path in FOLDER.glob("*/reference.json"))
SIX = ["heavy", "rexrov", "every-term"]
"""Plants of all six axes."""

RATES = 1e-9
"""Accelerations of the same formula in another order of sums, as a part of the greatest."""

TRAJECTORY = 1e-6
"""Velocities after a minute of the same steps, m/s and rad/s."""


@dataclass
class Case:
    """A plant with how it moves."""

    name: str
    reference: dict[str, Any]

    def file(self, *parts: str) -> Path:
        """A file of an export."""
        return FOLDER.joinpath(self.name, *parts)

    @property
    def own(self) -> np.ndarray:
        """Which axes it has."""
        return np.array(self.reference["own"])

    def states(self):
        """States with x (13,) beside what stands in the file."""
        for state in self.reference["states"]:
            x = np.concatenate([[1.0, -2.0, 3.0], state["quaternion"], state["velocity"]])
            yield x, {key: np.array(value) for key, value in state.items()}

    def check_rates(self, rate) -> None:
        """Holds `rate(x, state)` against Seaplant's at all states."""
        for x, state in self.states():
            expected = np.where(self.own, state["rate"], 0.0)
            found = np.where(self.own, rate(x, state), 0.0)
            assert np.abs(found - expected).max() <= RATES * max(1.0, np.abs(expected).max())

    def start(self) -> np.ndarray:
        """x at the beginning of the trajectory."""
        half = 0.5 * self.reference["trajectory"]["heading"]
        return np.array([0, 0, 0, np.cos(half), 0, 0, np.sin(half), 0, 0, 0, 0, 0, 0], float)

    def check_trajectory(self, step, tolerance: float = TRAJECTORY) -> None:
        """Follows the forces by `step(x, tau, h, current)` and compares all velocities."""
        trajectory = self.reference["trajectory"]
        forces = np.array(trajectory["forces"])
        current = np.array(trajectory["current"])
        x, worst = self.start(), 0.0
        for k, expected in enumerate(trajectory["velocity"]):
            difference = (x[7:] - expected)[self.own]
            # The library starts at rest over ground, on the plant's axes.
            worst = max(worst, np.abs(difference).max())
            tau = forces[:, min(k // 10, forces.shape[1] - 1)]
            for _ in range(25):
                x = step(x, tau, 0.02, current)
        assert worst < tolerance, worst


def pytest_generate_tests(metafunc) -> None:
    """One test a plant; `six` is one of all six axes."""
    for name, names in (("case", CASES), ("six", SIX)):
        if name in metafunc.fixturenames:
            cases = [
                Case(n, json.loads((FOLDER / n / "reference.json").read_text())) for n in names
            ]
            metafunc.parametrize(name, cases, ids=names)


@pytest.fixture
def kirchhoff():
    """C(M, nu) nu by Kirchhoff's equations, written out."""

    def force(mass: np.ndarray, nu: np.ndarray) -> np.ndarray:
        a, b = (mass @ nu)[:3], (mass @ nu)[3:]
        return np.concatenate([np.cross(nu[3:], a), np.cross(nu[:3], a) + np.cross(nu[3:], b)])

    return force
