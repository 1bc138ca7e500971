"""Python and the command line give the same numbers, to the last digit."""

import json
from pathlib import Path

import pytest
import seaplant as sp
import tomllib


def last_digits(value):
    """Formats as JSON text: equal texts are equal numbers."""
    return json.dumps(value, sort_keys=True)


@pytest.mark.parametrize("method", [None, "paper", "all"])
def test_identify_is_that_of_the_command_line(heave_campaign, command_line, tmp_path, method):
    words = [] if method is None else ["--method", method]
    ours = sp.identify_campaign(heave_campaign, method).results.to_dict()
    theirs = command_line("identify", heave_campaign, *words, "--out", tmp_path / "out")
    # The command differs in the output folder.
    ours["provenance"].pop("command")
    theirs["provenance"].pop("command")
    assert last_digits(ours) == last_digits(theirs)


def test_identify_of_parts_is_that_of_the_campaign(campaign):
    names = ("surge-1", "surge-hold-out")
    logs = [
        sp.Log.open(*sorted((campaign.parent / "logs" / name).glob("*.csv"))) for name in names
    ]
    vehicle = sp.Vehicle(campaign.parent / "vehicle.toml")
    whole = sp.identify_campaign(campaign).results
    stated = tomllib.loads(campaign.read_text())["channels"]
    trials = [
        sp.Trial(log, vehicle, "surge", channels=stated, name=name, role=role)
        for log, name, role in zip(
            logs, ("surge 1", "surge hold-out"), ("fit", "hold-out"), strict=True
        )
    ]
    ours = sp.identify(trials, vehicle).results
    assert last_digits(ours.to_dict()["plants"]) == last_digits(whole.to_dict()["plants"])
    assert {of.sha256 for of in ours.provenance.inputs} < {
        of.sha256 for of in whole.provenance.inputs
    }


def test_simulate_and_validate_are_those_of_the_command_line(campaign, command_line, tmp_path):
    fit = sp.identify_campaign(campaign, out=tmp_path)
    logs = sorted((campaign.parent / "logs/surge-hold-out").glob("*.csv"))
    theirs = command_line("simulate", tmp_path / "results.json", *logs)
    ours = fit.simulate(fit.trials[1])
    assert ours.mean_abs_error == theirs["mean_abs_error"]
    assert ours.simulated.tolist() == theirs["simulated"]
    scores = [of.to_dict() for of in fit.validate(fit.trials)]
    assert last_digits(scores) == last_digits(
        command_line("validate", tmp_path / "results.json", campaign)
    )
    assert scores[0]["fitted_to"] == ["surge 1"]


def test_thruster_is_that_of_the_command_line(campaign, command_line):
    table = campaign.parent / "bollard-pull.csv"
    theirs = command_line("thruster", table)
    assert last_digits(sp.thruster.fit(table).to_dict()) == last_digits(theirs)


def test_monte_carlo_is_that_of_the_command_line(command_line):
    theirs = command_line(
        "monte-carlo", "--dof", "yaw", "--method", "equation-error", "--runs", "3"
    )
    ours = sp.monte_carlo(method="equation-error", runs=3, dofs=["yaw"], threads=1)
    assert last_digits(ours.to_dict()) == last_digits(theirs)


def test_twin_files_are_those_of_the_command_line(command_line, tmp_path):
    spec = tmp_path / "twin.toml"
    spec.write_text('dofs = ["yaw"]\nduration_s = 60.0\ndisturbances = ["tether"]\n')
    command_line("twin", spec, "--out", tmp_path / "theirs")
    ours = sp.twin(spec).write(tmp_path / "ours").parent
    files = sorted(path.relative_to(ours) for path in ours.rglob("*") if path.is_file())
    assert len(files) > 5
    for path in files:
        assert (ours / path).read_bytes() == (tmp_path / "theirs" / path).read_bytes()


def test_what_is_written_is_what_the_command_line_writes(campaign, command_line, tmp_path):
    def files() -> dict[Path, bytes]:
        # The program also keeps a list of the files that it may replace.
        found = (path for path in tmp_path.rglob("*") if path.name != "seaplant-files.json")
        return {path: path.read_bytes() for path in found if path.is_file()}

    command_line("identify", campaign, "--out", tmp_path)
    theirs = files()
    assert tmp_path / "report.html" in theirs
    for path in theirs:
        path.unlink()
    sp.identify_campaign(campaign, out=tmp_path)
    ours = files()
    assert ours.keys() == theirs.keys()
    different = [path.name for path, content in theirs.items() if ours[path] != content]
    assert different == []
