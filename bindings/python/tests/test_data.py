"""Arrays, frames, datasets and files with units are read without changing the numbers."""

import pickle
from decimal import Decimal

import numpy as np
import pandas as pd
import polars as pl
import pytest
import seaplant as sp
import xarray as xr

UNITS = {"speed": "m/s", "wrench": "N"}
CHANNELS = {"velocity.surge": "speed", "wrench.surge": "wrench"}
VEHICLE = sp.Vehicle(name="Skiff")


@pytest.fixture(scope="module")
def columns() -> dict[str, np.ndarray]:
    """A known plant, m = 100 kg and d_Q = 50 N/(m/s)², by RK4 at 10 ms under a held force."""
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 200.0, 0.1)
    force = 60.0 * np.sin(0.3 * time) + 25.0 * np.repeat(rng.normal(size=40), 50)
    speed, v = [], 0.0
    for tau in force:
        speed.append(v)
        for _ in range(10):
            h, rate = 0.01, lambda v, tau=tau: (tau - 50.0 * v * abs(v)) / 100.0
            k1 = rate(v)
            k2 = rate(v + h / 2 * k1)
            k3 = rate(v + h / 2 * k2)
            k4 = rate(v + h * k3)
            v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return {"time": time, "speed": np.array(speed), "wrench": force}


def plant(table, **of):
    trial = sp.Trial(table, VEHICLE, "surge", channels=CHANNELS, units=UNITS, **of)
    fit = sp.identify(trial, VEHICLE, "output-error", terms="force,quadratic")
    return fit["surge"].by_axis["surge"]


def test_a_plant_of_arrays_is_the_one_they_were_made_with(columns):
    found = plant(columns)
    assert found.mass.value == pytest.approx(100.0, rel=1e-5)
    assert found.quadratic_drag.value == pytest.approx(50.0, rel=1e-5)
    assert found.mass.unit == "kg"


def frames(columns):
    dated = pd.Timestamp("2026-05-01") + pd.to_timedelta(columns["time"], unit="s")
    frame = pd.DataFrame(columns)
    yield "pandas", frame
    yield "pandas by index", frame.set_index("time")
    yield (
        "pandas by instant",
        frame.drop(columns="time").set_index(pd.Index(dated, name="when")),
    )
    yield "polars", pl.DataFrame(columns)
    yield (
        "polars by duration",
        pl.DataFrame(
            {**columns, "time": (columns["time"] * 1e9).round().astype("timedelta64[ns]")}
        ),
    )
    coords = {"time": columns["time"]}
    series = {name: ("time", columns[name], {"units": UNITS[name]}) for name in UNITS}
    yield "xarray", xr.Dataset(series, coords=coords)


def test_every_kind_of_table_gives_the_same_plant(columns):
    expected = plant(columns).mass.value
    for name, table in frames(columns):
        units = None if name == "xarray" else UNITS
        trial = sp.Trial(table, VEHICLE, "surge", channels=CHANNELS, units=units)
        fit = sp.identify(trial, VEHICLE, "output-error", terms="force,quadratic")
        # Instants of 2026 hold a tenth of a second to 2e-7 s.
        mass = fit["surge"].parameters["mass.surge"].value
        assert mass == pytest.approx(expected, rel=1e-6), name


def test_units_are_converted_and_without_one_refused(columns):
    knots = {**columns, "speed": columns["speed"] * 3600.0 / 1852.0}
    trial = sp.Trial(knots, VEHICLE, "surge", channels=CHANNELS, units={**UNITS, "speed": "kn"})
    in_knots = sp.identify(trial, VEHICLE, "equation-error")["surge"].parameters["mass.surge"]
    trial = sp.Trial(columns, VEHICLE, "surge", channels=CHANNELS, units=UNITS)
    in_metres = sp.identify(trial, VEHICLE, "equation-error")["surge"].parameters["mass.surge"]
    assert in_knots.value == pytest.approx(in_metres.value, rel=1e-12)
    with pytest.raises(sp.InputError, match="`speed` states no unit"):
        sp.Trial(columns, VEHICLE, "surge", channels=CHANNELS, units={"wrench": "N"})
    with pytest.raises(sp.InputError, match="did you mean|unknown|no unit"):
        sp.Log.of(columns, units={"speed": "m/fortnight"})


def test_columns_called_as_quantities_need_no_channels(columns):
    table = {"time": columns["time"]}
    table |= {"velocity.surge [m/s]": columns["speed"], "wrench.surge [N]": columns["wrench"]}
    trial = sp.Trial(table, VEHICLE, "surge")
    found = sp.identify(trial, VEHICLE, "output-error", terms=["force", "quadratic"])
    assert found["surge"].by_axis["surge"].mass.value == plant(columns).mass.value


def test_a_log_goes_out_as_it_came_in(campaign):
    log = sp.Log.open(campaign.parent / "logs/surge-1/thrusters.csv")
    frame = pd.read_csv(campaign.parent / "logs/surge-1/thrusters.csv", index_col=0)
    ours = log.to_pandas()
    assert list(ours.columns) == list(frame.columns)
    np.testing.assert_array_equal(ours.to_numpy(), frame.to_numpy())
    np.testing.assert_array_equal(ours.index, frame.index)
    dataset = log.to_xarray()
    assert {of.attrs["units"] for of in dataset.data_vars.values()} == {"rpm"}
    folder = campaign.parent / "logs/surge-1"
    whole = sp.Log.open(*sorted(folder.glob("*.csv")))
    assert len(whole.to_xarray().dims) > 1
    again = sp.Log.of(whole.to_xarray())
    for channel in whole:
        same = again[channel.column]
        assert same.unit == channel.unit
        np.testing.assert_array_equal(same.values, channel.values)
        np.testing.assert_array_equal(same.time_s, channel.time_s)
    assert "rpm" in log._repr_html_()


def test_a_log_of_rows_out_of_order_is_sorted_and_says_so():
    log = sp.Log.of({"t": [1.0, 0.0, 2.0], "depth [m]": [5.5, 5.0, np.nan]})
    np.testing.assert_array_equal(log["depth"].values, [5.0, 5.5])
    np.testing.assert_array_equal(log["DEPTH"].time_s, [0.0, 1.0])
    assert len(log.notes) == 1
    with pytest.raises(KeyError, match="did you mean|no channel|no column"):
        log["dpeth"]


def test_wrong_tables_are_refused_with_advice():
    for table, words in [
        ({"depth": [1.0]}, "found no time column among depth"),
        ({"time": [0.0, 1.0], "depth": [1.0]}, "has 1 value for 2 times"),
        ({"time": [0.0], "depth": ["deep"]}, "holds text, not numbers"),
        ({"time": [0.0], "depth": [[1.0]]}, "2 dimensions"),
        ([1.0, 2.0], "expected a table .*, found list"),
    ]:
        with pytest.raises(sp.InputError, match=words):
            sp.Log.of(table)
    with pytest.raises(sp.InputError, match="units names"):
        sp.Log.of({"time": [0.0], "depth": [1.0]}, units={"deph": "m"})


@pytest.mark.parametrize(
    ("name", "second"),
    [("time [s]", 1.0), ("Time", 1.0), ("t [s]", 1.0), ("time_ms", 1e-3), ("TimeUS", 1e-6)],
)
def test_time_is_recognised_as_in_files(columns, name, second):
    expected = plant(columns).mass.value
    of = {
        name: columns["time"] / second,
        "speed": columns["speed"],
        "wrench": columns["wrench"],
    }
    frame = pd.DataFrame(of)
    for table in (of, frame, frame.set_index(name), pl.DataFrame(of)):
        # Dividing and multiplying by the unit rounds the last digit of a double.
        assert plant(table).mass.value == pytest.approx(expected, rel=1e-9), type(table)


def test_a_unit_of_time_goes_before_that_of_the_name(columns):
    late = {**columns, "time": columns["time"] * 1e3}
    assert sp.Log.of(late, time_unit="ms")["speed"].time_s[-1] == pytest.approx(
        columns["time"][-1], rel=1e-12
    )
    since = {**columns, "time": 1.7e18 + columns["time"] * 1e9}
    # Nanoseconds since 1970 keep a quarter of a microsecond in a double.
    assert sp.Log.of(since)["speed"].time_s[1] == pytest.approx(1.7e9 + 0.1, abs=1e-6)
    dataset = xr.Dataset(
        {"speed": ("time", columns["speed"], {"units": "m/s"})},
        coords={"time": ("time", columns["time"] * 1e3, {"units": "ms"})},
    )
    assert sp.Log.of(dataset)["speed"].time_s[-1] == pytest.approx(
        columns["time"][-1], rel=1e-12
    )
    for unit in ("fortnight", "m"):
        with pytest.raises(sp.InputError, match=f'the unit "{unit}", which is not one of time'):
            sp.Log.of(columns, time_unit=unit)


def test_an_index_that_may_count_rows_is_no_time(columns):
    frame = pd.DataFrame({name: columns[name] for name in ("speed", "wrench")})
    for table, words in [
        (frame, "index has no name, so that it may count rows"),
        (frame[frame["speed"] > 0], "may count rows"),
        (frame.set_index(np.arange(float(len(frame)))), "may count rows"),
        (frame.rename_axis("sample"), "index is called 'sample', which is no name of time"),
        (frame.set_index([frame.index, frame.index]), "several levels"),
        (pd.concat([frame, frame], axis=1), "several columns called 'speed'; rename them"),
    ]:
        with pytest.raises(sp.InputError, match=words):
            sp.Log.of(table)
    with pytest.raises(sp.InputError, match="found no column 'tiem' among"):
        sp.Log.of(frame, time="tiem")
    with pytest.raises(sp.InputError, match="has no coordinate that says when"):
        sp.Log.of(xr.Dataset({"speed": ("time", columns["speed"])}))
    timed = frame.set_index(pd.Index(columns["time"]))
    assert sp.Log.of(timed)["speed"].time_s[1] == columns["time"][1]
    named = frame.rename_axis("sample")
    assert sp.Log.of(named, time="sample", time_unit="ms")["speed"].time_s[1] == 1e-3


def test_what_is_masked_or_absent_is_missing():
    time = np.arange(4.0)
    masked = np.ma.masked_array([5.0, 99.0, 5.2, 5.3], mask=[False, True, False, False])
    absent = pd.array([5.0, None, 5.2, 5.3], dtype="Float64")
    objects = np.array([5.0, None, Decimal("5.2"), 5.3], dtype=object)
    for values in (masked, objects, pd.array([5.0, None, 5.2, 5.3]).to_numpy(dtype=object)):
        depth = sp.Log.of({"time": time, "depth [m]": values})["depth"]
        assert (depth.time_s.tolist(), depth.missing) == ([0.0, 2.0, 3.0], 1), type(values)
    frame = pd.DataFrame({"time": time, "depth [m]": absent})
    assert sp.Log.of(frame)["depth"].values.tolist() == [5.0, 5.2, 5.3]
    late = sp.Log.of({"time": np.ma.masked_array(time, [0, 1, 0, 0]), "depth [m]": time})
    assert late["depth"].values.tolist() == [0.0, 2.0, 3.0]


def test_an_instant_that_is_none_is_no_time():
    stamps = pd.to_datetime(["2026-05-01 10:00:00", None, "2026-05-01 10:00:02"])
    for time in (stamps, stamps - stamps[0], stamps.tz_localize("Europe/Oslo")):
        frame = pd.DataFrame({"depth [m]": [5.0, 5.1, 5.2]}, index=time)
        log = sp.Log.of(frame)
        assert np.diff(log["depth"].time_s).tolist() == [2.0]
        assert "no readable time" in log.notes[0]
    oslo = sp.Log.of(
        pd.DataFrame({"depth [m]": [5.0] * 3}, index=stamps.tz_localize("Europe/Oslo"))
    )
    utc = sp.Log.of(pd.DataFrame({"depth [m]": [5.0] * 3}, index=stamps.tz_localize("UTC")))
    assert utc["depth"].time_s[0] - oslo["depth"].time_s[0] == 7200.0


def test_what_is_no_real_number_is_refused():
    for values, words in [
        ([1.0 + 2.0j, 2.0], "holds complex numbers; give their real part or their modulus"),
        (["1.5", "2.5"], "holds text, not numbers; convert it"),
        (np.array([1.0, "2"], dtype=object), "holds a str in row 1"),
        (np.array([1.0, 2.0j], dtype=object), "holds a complex in row 1"),
        (np.array(["2026-05-01"] * 2, dtype="datetime64[s]"), "holds instants, not numbers"),
    ]:
        with pytest.raises(sp.InputError, match=words):
            sp.Log.of({"time": [0.0, 1.0], "depth": values})
        if "instants" not in words:
            with pytest.raises(sp.InputError, match=words):
                sp.Log.of({"time": values, "depth": [0.0, 1.0]})


def test_bench_points_without_both_are_left_out():
    speeds = np.ma.masked_array([-20.0, -10.0, 0.0, 10.0, 20.0, 30.0], mask=[0, 0, 0, 0, 0, 1])
    found = sp.thruster.fit(
        speeds, [-4.0, -1.0, 0.0, 1.0, 4.0, -99.0], input_unit="rad/s", force_unit="N"
    )
    assert len(found.points) == 5
    with pytest.raises(sp.InputError, match="complex"):
        sp.thruster.fit([1.0j, 2.0], [1.0, 2.0], input_unit="rad/s", force_unit="N")


def test_logs_vehicles_trials_and_fits_travel_between_processes(columns):
    trial = sp.Trial(columns, VEHICLE, "surge", channels=CHANNELS, units=UNITS, role="fit")
    again = pickle.loads(pickle.dumps(trial))
    first, second = (sp.identify(of, VEHICLE, "equation-error") for of in (trial, again))
    assert first.results.plants == second.results.plants
    there_and_back = pickle.loads(pickle.dumps(first))
    assert there_and_back.results == first.results
    assert there_and_back.simulate(trial).mean_abs_error == first.simulate(trial).mean_abs_error


def test_a_vehicle_in_code_is_the_one_of_its_file(campaign, tmp_path):
    curve = sp.QuadraticCurve(forward=0.0402, reverse=0.0328)
    thrusters = [
        sp.Thruster(
            "bow",
            position_m=np.array([1.0, 0.0, 0.2]),
            direction=[0.0, 2.0, 0.0],
            curve=curve,
            thrust_uncertainty=sp.ThrustUncertainty(0.05, 0.08),
        )
    ]
    sensors = sp.Sensors(dvl=sp.Dvl(position_m=(0.5, 0.0, 0.8), rotation_deg=(0.0, 0.0, 45.0)))
    ours = sp.Vehicle(name="Skiff", dry_mass_kg=120.0, thrusters=thrusters, sensors=sensors)
    file = tmp_path / "vehicle.toml"
    file.write_text(
        """
        name = "Skiff"
        dry_mass_kg = 120.0
        [[thruster]]
        name = "bow"
        position_m = [1.0, 0.0, 0.2]
        direction = [0.0, 2.0, 0.0]
        curve = { kind = "quadratic", forward = 0.0402, reverse = 0.0328 }
        thrust_uncertainty = { forward = 0.05, reverse = 0.08 }
        [sensor.dvl]
        position_m = [0.5, 0.0, 0.8]
        rotation_deg = [0.0, 0.0, 45.0]
        """
    )
    theirs = sp.Vehicle(file)
    assert repr(ours) == repr(theirs) == "<Vehicle 'Skiff', 120 kg in air, 1 thruster>"
    np.testing.assert_array_equal(ours.unit_wrench("bow"), theirs.unit_wrench("bow"))
    speeds = np.linspace(-150.0, 150.0, 7)
    np.testing.assert_array_equal(ours.thrust("bow", speeds), theirs.thrust("bow", speeds))
    np.testing.assert_allclose(ours.thrust("bow", [-10.0, 10.0]), [-3.28, 4.02], rtol=1e-12)
    assert repr(pickle.loads(pickle.dumps(ours))) == repr(ours)


def test_known_vehicles_and_tables_of_thrust():
    vehicle = sp.Vehicle(
        preset="bluerov2", thruster_curve=sp.PresetCurve("t200", voltage_v=16.0)
    )
    assert vehicle.name == "BlueROV2"
    # The maker's 5.25 kgf at full throttle and 16 V.
    assert vehicle.thrust("motor 1", [1900.0])[0] == pytest.approx(5.25 * 9.80665, rel=0.01)
    table = sp.TableCurve(input="pwm", points=[[1100, -40.0], [1500, 0.0], [1900, 51.0]])
    skiff = sp.Vehicle(
        name="Skiff", thrusters=[sp.Thruster("aft", [0, 0, 0], [1, 0, 0], table)]
    )
    assert skiff.thrust("aft", [1300.0, 1700.0]).tolist() == [-20.0, 25.5]
