"""Results are plain data, displayed readably, drawn, and conform to the schema."""

import hashlib
import json
import math
import os
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
import seaplant as sp
from seaplant import _native, _results

sys.path.insert(0, str(Path(__file__).parents[1]))
import generate_results


def test_the_dataclasses_are_those_of_the_schemas():
    written = Path(generate_results.__file__).with_name("python") / "seaplant/_results.py"
    assert written.read_text(encoding="utf-8") == generate_results.module(), (
        "the library's results have changed: run scripts/python-package results"
    )


def test_records_go_to_json_and_back(fit):
    data = json.loads(fit._native.to_json())
    assert fit.results.to_dict() == data
    assert _results.Results.from_dict(data) == fit.results


def test_a_twin_is_found_within_its_intervals(fit, dive):
    found, truth = fit["surge"].by_axis["surge"], dive.truth.plants["surge"]
    low, high = found.mass.interval95
    assert low < truth.mass < high
    assert found.mass.value == pytest.approx(truth.mass, rel=0.01)
    assert found.quadratic_drag.value == pytest.approx(truth.quadratic_drag, rel=0.02)
    # The paper's method has the error of its filter's gain, 1/2 at the twin's 1/8 Hz.
    paper = fit.methods["surge"]["paper"]
    assert paper.parameters["mass.surge"].value > 1.5 * truth.mass


def test_what_is_shown_helps(fit):
    text = repr(fit)
    assert "surge by filter-error" in text and "mass.surge: 12" in text and "kg ±" in text
    mass = fit["surge"].parameters["mass.surge"]
    assert float(mass) == mass.value == fit["surge"].by_axis["surge"].mass.value
    verdict = fit["surge"].verdict
    r_squared = fit["surge"].hold_out.by_axis["surge"].r_squared
    assert r_squared > 0.9
    assert verdict.trust.replace("-", " ") in text and f"R² held out {r_squared:.3f}" in text
    html = fit._repr_html_()
    assert "<b>surge</b> by filter-error: " in html
    assert "<td>surge: |u|u</td>" in html and f"{len(fit.caveats)} caveats" in html
    assert "data:image/png;base64" in html
    assert "data:image" not in pickle.loads(pickle.dumps(sp.Fit(fit._native)))._repr_html_()
    correlation = fit["surge"].correlation
    assert set(correlation.names) == set(fit["surge"].parameters)
    assert correlation.value.shape == (len(correlation.names),) * 2
    assert correlation.value[0, 0] == pytest.approx(1.0)


def test_frames_and_datasets_hold_every_parameter(fit):
    frame = fit.to_pandas()
    row = frame.loc[("surge", "filter-error", "mass.surge")]
    assert row["value"] == fit["surge"].parameters["mass.surge"].value and row["unit"] == "kg"
    dataset = fit.to_xarray()
    picked = dataset["std"].sel({"dof": "surge", "method": "paper", "parameter": "mass.surge"})
    assert float(picked) == fit.methods["surge"]["paper"].parameters["mass.surge"].std


def test_simulations_are_scored_as_the_results_say(fit, dive):
    held_out = fit.simulate(dive.trials[1])
    score = fit["surge"].hold_out
    assert held_out.mean_abs_error == score.by_axis["surge"].mean_abs_error
    assert held_out.mean_abs_error == score.by_trial[held_out.trial]["surge"].mean_abs_error
    difference = np.abs(held_out.simulated - held_out.measured).mean()
    assert difference == pytest.approx(held_out.mean_abs_error, rel=1e-12)
    frame = held_out.to_pandas()
    assert list(frame.columns) == ["force", "measured", "simulated", "difference"]
    assert held_out.to_xarray()["force"].shape == held_out.time_s.shape


def test_a_fit_draws_model_over_measurement_and_their_difference(fit, tmp_path):
    figure = fit.plot("surge")
    above, _, below, _ = figure.axes
    measured, model = above.get_lines()
    (difference,) = below.get_lines()
    np.testing.assert_allclose(
        difference.get_ydata(), model.get_ydata() - measured.get_ydata(), atol=1e-15
    )
    assert above.get_ylabel() == "surge [m/s]"
    figure.savefig(tmp_path / "surge.png")


def test_a_saved_fit_is_read_back(fit, tmp_path):
    fit.save(tmp_path)
    again = sp.Fit.open(tmp_path / "results.json")
    assert again.results == fit.results
    assert (tmp_path / "report.html").stat().st_size > 10_000
    with pytest.raises(sp.InputError, match="no trials to draw"):
        again.plot()


def test_a_folder_of_results_is_read_and_what_is_none_is_named(fit, tmp_path):
    fit.save(tmp_path / "results")
    assert sp.Fit.open(tmp_path / "results").results == fit.results
    assert sp.Plant.open(tmp_path / "results").axes == tuple(fit.plants)
    with pytest.raises(sp.MissingFileError, match=r"cannot read .*nowhere\.json: No such file"):
        sp.Fit.open(tmp_path / "nowhere.json")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe")
    with pytest.raises(sp.InputError, match=r"binary\.json: .*codec can't decode"):
        sp.Fit.open(tmp_path / "binary.json")


def test_nothing_is_written_over_what_seaplant_did_not_write(fit, dive, tmp_path):
    campaign = tmp_path / "campaign.toml"
    campaign.write_text("# of weeks of work\n")
    with pytest.raises(
        sp.InputError, match=r"campaign\.toml exists and is not as Seaplant wrote"
    ):
        dive.write(tmp_path)
    assert campaign.read_text() == "# of weeks of work\n"
    assert [of.name for of in tmp_path.iterdir()] == ["campaign.toml"]
    dive.write(tmp_path, force=True)
    dive.write(tmp_path)
    report = fit.save(tmp_path / "results") / "report.html"
    fit.save(tmp_path / "results")
    report.write_text("changed by hand")
    with pytest.raises(sp.InputError, match=r"report\.html exists"):
        fit.save(tmp_path / "results")
    assert sp.identify_campaign(campaign, "equation-error", out=tmp_path / "again").plants
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / "figures").symlink_to(elsewhere)
    with pytest.raises(
        sp.InputError, match="figures is a symbolic link, which may point elsewhere"
    ):
        fit.save(tmp_path / "linked")
    assert not list(elsewhere.iterdir())


@pytest.mark.parametrize(
    ("path", "fault"),
    [
        ("../secret.txt", "not a relative path inside the folder"),
        ("{root}/secret.txt", "not a relative path inside the folder"),
        ("link/secret.txt", "link is a symbolic link"),
        ("pipe", "pipe is not a regular file"),
        ("figures", "figures is not a regular file"),
    ],
)
def test_a_forged_list_deletes_nothing(fit, tmp_path, path, fault):
    secret = tmp_path / "secret.txt"
    secret.write_text("mine")
    folder = fit.save(tmp_path / "results")
    (folder / "link").symlink_to(tmp_path)
    os.mkfifo(folder / "pipe")
    listed = json.loads((folder / "seaplant-files.json").read_text())
    sha256 = hashlib.sha256(secret.read_bytes()).hexdigest()
    listed["files"][path.format(root=tmp_path)] = {"made": "report", "sha256": sha256}
    (folder / "seaplant-files.json").write_text(json.dumps(listed))
    with pytest.raises(sp.InputError, match=rf"seaplant-files\.json lists .*{fault}; a list"):
        fit.save(folder)
    assert secret.read_text() == "mine"
    assert (folder / "report.html").exists()


def test_steady_drag_is_that_of_the_identification(heave_campaign):
    fit = sp.identify_campaign(heave_campaign, "equation-error")
    steady = [trial for trial in fit.trials if trial.role == "steady"]
    assert len(steady) == 3
    assert sp.steady_drag(steady) == fit.steady["heave"]
    # The twin's steady runs have 5500 N/(m/s)², not the plant's drag.
    assert fit.steady["heave"].quadratic_drag.value == pytest.approx(5500.0, rel=0.05)


def test_bollard_pull_gives_the_curve_that_the_points_were_made_with():
    speed = np.linspace(-1650.0, 1650.0, 41)
    law = np.where(speed > 0, 0.0402, 0.0328)
    force = law * (speed * math.pi / 30) * np.abs(speed * math.pi / 30)
    found = sp.thruster.fit(speed, force, input_unit="rpm", force_unit="N")
    assert found.forward.value == pytest.approx(0.0402, rel=1e-9)
    assert found.reverse.value == pytest.approx(0.0328, rel=1e-9)
    curve = sp.thruster.curve(found)
    aft = sp.Thruster("aft", [0, 0, 0], [1, 0, 0], curve)
    vehicle = sp.Vehicle(name="Skiff", thrusters=[aft])
    np.testing.assert_allclose(vehicle.thrust("aft", speed * math.pi / 30), force, rtol=1e-9)
    assert len(sp.plots.thrust(found).axes[0].get_lines()) == 3
    with pytest.raises(sp.InputError, match="have no units"):
        sp.thruster.fit(speed, force)


def test_the_version_is_that_of_the_library():
    assert sp.__version__ == _native.version()


def test_an_axis_that_was_not_identified_is_refused_by_name(fit):
    with pytest.raises(KeyError, match="no plant of 'yaw'; it has surge"):
        fit["yaw"]
    with pytest.raises(sp.InputError, match="it has surge"):
        fit["yaw"]


def test_a_log_is_drawn_channel_by_channel(dive):
    log = dive.logs["surge 1"]
    figure = log.plot("velocity")
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    assert titles and all("velocity" in title for title in titles)
    assert figure.axes[0].lines[0].get_xdata()[0] >= 0.0
    with pytest.raises(sp.InputError, match="no channel to draw"):
        log.plot("sonar")
