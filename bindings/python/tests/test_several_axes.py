"""Plants of several axes: made, identified and displayed in Python."""

import pickle

import matplotlib as mpl
import numpy as np
import pytest
import seaplant as sp

mpl.use("Agg")

OTTER = {"vehicle": "published:otter-mss", "duration_s": 120.0, "hold_out_s": 60.0}
NAME = "surge-sway-yaw"


@pytest.fixture(scope="module")
def twin() -> sp.Twin:
    return sp.twin(OTTER)


@pytest.fixture(scope="module")
def planar_fit(twin: sp.Twin) -> sp.Fit:
    return sp.identify(twin.trials, twin.vehicle)


def test_the_truth_is_in_its_intervals(twin, planar_fit):
    truth = twin.truth.vehicle.coefficients
    for name, of in planar_fit[NAME].parameters.items():
        assert abs(of.value - truth.get(name, 0.0)) < 4.0 * of.std, name


def test_the_mass_matrix_is_an_array_with_the_rows_of_the_axes(planar_fit):
    matrix = planar_fit.mass_matrix
    assert matrix.shape == (3, 3)
    parameters = planar_fit[NAME].parameters
    assert matrix[1, 2] == matrix[2, 1] == float(parameters["mass.sway-yaw"])
    assert np.all(np.linalg.eigvalsh(matrix) > 0.0)


def test_it_is_shown_beside_plants_of_single_axes(planar_fit):
    assert f"{NAME} by filter-error: usable" in repr(planar_fit)
    assert "mass.sway-yaw: 11" in repr(planar_fit)
    assert "mass.sway-yaw" in planar_fit._repr_html_()
    frame = planar_fit.to_pandas()
    assert frame.loc[(NAME, "filter-error", "mass.yaw"), "unit"] == "kg m²"
    kept = {caveat.message for caveat in planar_fit[NAME].caveats}
    assert kept and kept <= {caveat.message for caveat in planar_fit.caveats}


def test_each_axis_follows_a_trial(twin, planar_fit):
    held = twin.trials[-1]
    moved = planar_fit.simulate(held, "yaw")
    score = planar_fit[NAME].hold_out.by_axis["yaw"]
    assert moved.mean_abs_error == pytest.approx(score.mean_abs_error, rel=1e-9)
    assert len(planar_fit.plot().axes) == 2 * 3 * 3
    (validation,) = planar_fit.validate(held)
    assert validation.axes == ("surge", "sway", "yaw")
    score = validation.score.by_axis["yaw"]
    assert score.mean_abs_error < 0.1 * score.null_error


def test_a_trial_of_a_table_serves_it_and_crosses_processes(twin):
    table = twin.logs["free 1"]
    trial = sp.Trial(table, twin.vehicle, axes="planar", name="a")
    assert trial.axes == pickle.loads(pickle.dumps(trial)).axes == [["surge", "sway", "yaw"]]
    fit = sp.identify(trial, twin.vehicle, plants={"terms": ["yaw: |v|r"], "symmetry": "none"})
    assert {"yaw: |v|r", "mass.surge-yaw"} <= set(fit[NAME].parameters)
    assert pickle.loads(pickle.dumps(fit)).plants.keys() == {NAME}
    of_two = sp.Trial(table, twin.vehicle, axes=[["surge"], ["sway", "yaw"]])
    assert list(sp.identify(of_two, twin.vehicle).plants) == ["surge", "sway-yaw"]


def test_files_of_a_whole_twin_are_those_of_the_command_line(twin, command_line, tmp_path):
    spec = tmp_path / "twin.toml"
    spec.write_text("".join(f"{key} = {value!r}\n" for key, value in OTTER.items()))
    command_line("twin", spec, "--out", tmp_path / "theirs")
    ours = sp.twin(spec).write(tmp_path / "ours").parent
    for path in (of.relative_to(ours) for of in ours.rglob("*") if of.is_file()):
        assert (ours / path).read_bytes() == (tmp_path / "theirs" / path).read_bytes()
    theirs = command_line("monte-carlo", spec, "--runs", "2")
    table = sp.monte_carlo(spec, runs=2)
    assert [row.name for row in table.coefficients] == [
        of["name"] for of in theirs["coefficients"]
    ]
    assert len(sp.monte_carlo_frame(table)) == len(table.coefficients)


@pytest.mark.parametrize(
    ("axes", "told"),
    [
        ((), r'add dof = \["surge"\]'),
        ("sixx", '"six", "planar"'),
        (["surge", "surge"], "surge stands twice"),
        ([["surge", "wave"]], "unknown variant `wave`"),
    ],
)
def test_axes_that_are_none_are_refused(twin, axes, told):
    with pytest.raises(sp.InputError, match=told):
        sp.Trial(twin.logs["free 1"], twin.vehicle, axes=axes)


def test_what_does_not_belong_together_is_refused(twin, planar_fit, dive):
    trial = twin.trials[0]
    with pytest.raises(sp.InputError, match="was not made for these axes"):
        sp.identify(trial, twin.vehicle, plants={"axes": "six"})
    with pytest.raises(sp.InputError, match="did you mean `axes`"):
        sp.identify(trial, twin.vehicle, plants={"axis": "planar"})
    with pytest.raises(sp.InputError, match="make it with axes="):
        planar_fit.simulate(dive.trials[0], "yaw")
    with pytest.raises(sp.InputError, match="the fit has none"):
        _ = sp.identify(dive.trials, dive.vehicle, "equation-error").mass_matrix
    with pytest.raises(sp.InputError, match="unknown field `dofs`"):
        sp.twin(OTTER, dofs=["surge"])
    with pytest.raises(sp.InputError, match="fitted by filter error"):
        sp.monte_carlo(OTTER, method="filter-error")
