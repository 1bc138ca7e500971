"""The tutorial runs, and its stated results are right."""

import runpy
from pathlib import Path

TUTORIAL = Path(__file__).parents[1] / "tutorial.py"


def test_the_tutorial_runs_from_log_to_report(capsys):
    found = runpy.run_path(str(TUTORIAL))
    said = capsys.readouterr().out
    assert "surge by filter-error" in said and "report.html" in said
    assert (found["folder"] / "surge.png").stat().st_size > 10_000
    assert found["mass"].interval95[0] < found["truth"].mass < found["mass"].interval95[1]
