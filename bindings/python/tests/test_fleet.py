"""A fleet loses no dive: not to failures, a killed worker or an interruption."""

import datetime as dt
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import seaplant as sp
from seaplant.fleet import _dives

DIVES = int(os.environ.get("SEAPLANT_FLEET_DIVES", "250"))
SPEC = {"dofs": ["surge"], "duration_s": 60.0, "hold_out_s": 60.0}
METHOD = "equation-error"


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("dives")
    return [sp.twin(SPEC, seed=k).write(folder / f"dive {k:04}") for k in range(DIVES)]


@pytest.fixture(scope="module")
def serial(campaigns: list[Path], tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    out = tmp_path_factory.mktemp("serial")
    return sp.fleet.identify(campaigns, out=out, method=METHOD, workers=1).to_pandas()


def steady(frame: pd.DataFrame) -> pd.DataFrame:
    """Returns the columns that are equal in every run."""
    return frame.drop(columns=list(_dives.VOLATILE))


def test_every_dive_is_a_row_with_its_plant(serial, campaigns):
    assert list(serial["campaign"]) == [str(path) for path in campaigns]
    assert set(serial["status"]) == {"found"}
    first = sp.identify_campaign(campaigns[0], METHOD)["surge"]
    row = serial.iloc[0]
    assert row["mass"] == first.by_axis["surge"].mass.value
    assert row["bias_force_high95"] == first.by_axis["surge"].bias_force.high95
    assert list(row["caveats"]) == [of.code for of in first.caveats]
    assert row["mass_unit"] == "kg" and row["method"] == METHOD
    error = (serial["mass"] / 12970.2 - 1.0).abs()
    assert error.median() < 0.01


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_a_killed_worker_loses_nothing(campaigns, serial, tmp_path):
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
    )
    killed = []

    def kill_one(pids: list[int]) -> None:
        while len(list((tmp_path / "dives").glob("*.parquet"))) < len(campaigns) // 4:
            time.sleep(0.005)
        os.kill(pids[0], signal.SIGKILL)
        killed.append(len(list((tmp_path / "dives").glob("*.parquet"))))

    with cluster, distributed.Client(cluster) as client:
        pids = list(client.run(os.getpid).values())
        killer = threading.Thread(target=kill_one, args=(pids,))
        killer.start()
        started = time.perf_counter()
        fleet = sp.fleet.identify(campaigns, client, out=tmp_path, method=METHOD)
        seconds = time.perf_counter() - started
        killer.join()
    assert killed[0] < len(campaigns), "the worker was killed when all was done"
    pd.testing.assert_frame_equal(steady(fleet.to_pandas()), steady(serial))
    workers = fleet.to_pandas()["worker"].nunique()
    print(f"{len(campaigns)} dives in {seconds:.1f} s by {workers} workers")
    assert workers >= 2


def test_what_fails_is_a_row_with_its_reason(campaigns, tmp_path):
    broken = tmp_path / "broken/campaign.toml"
    broken.parent.mkdir()
    broken.write_text(campaigns[0].read_text().replace("logs/surge-1/dvl", "logs/lost/dvl"))
    (broken.parent / "vehicle.toml").write_text(
        (campaigns[0].parent / "vehicle.toml").read_text()
    )
    wrong = tmp_path / "wrong/campaign.toml"
    wrong.parent.mkdir()
    wrong.write_text("vehicel = 1\n")
    given = [broken, campaigns[0], wrong, tmp_path / "nowhere/campaign.toml"]
    fleet = sp.fleet.identify(given, out=tmp_path / "out", method=METHOD)
    frame = fleet.to_pandas().set_index("dive")
    assert list(frame["status"]) == ["failed", "found", "failed", "failed"]
    assert "cannot read" in frame.loc["broken", "reason"]
    assert "did you mean `vehicle`" in frame.loc["wrong", "reason"]
    assert len(fleet.failures) == 3
    assert repr(fleet) == "<Fleet of 4 dives: 1 plants, 3 failures>"


def test_a_fleet_goes_on_where_it_stopped(campaigns, serial, tmp_path, monkeypatch):
    done = []
    honest = _dives.work

    def stop_after_ten(dive, order):
        if len(done) == 10:
            raise KeyboardInterrupt
        done.append(dive["dive"])
        return honest(dive, order)

    from seaplant.fleet import _fleet

    some = campaigns[:30]
    monkeypatch.setattr(_fleet, "work", stop_after_ten)
    with pytest.raises(KeyboardInterrupt):
        sp.fleet.identify(some, out=tmp_path, method=METHOD, workers=1)
    kept = sp.fleet.Fleet.open(tmp_path)
    assert len(kept) == 10
    monkeypatch.setattr(
        _fleet, "work", lambda dive, order: done.append("") or honest(dive, order)
    )
    fleet = sp.fleet.identify(some, out=tmp_path, method=METHOD)
    assert len(done) == 30
    pd.testing.assert_frame_equal(steady(fleet.to_pandas()), steady(serial.head(30)))
    # Everything is present: nothing is computed again, until a file changes.
    sp.fleet.identify(some, out=tmp_path, method=METHOD)
    assert len(done) == 30
    log = next((some[3].parent / "logs").rglob("dvl.csv"))
    os.utime(log, (time.time() + 5, time.time() + 5))
    sp.fleet.identify(some, out=tmp_path, method=METHOD)
    assert len(done) == 31
    assert not list((tmp_path / "dives").iterdir())


def test_what_the_system_refuses_is_tried_again(campaigns, tmp_path, monkeypatch):
    tried = []
    honest = _dives.identify_campaign

    def moody(*arguments, **named):
        tried.append(arguments)
        if len(tried) < 3:
            raise sp.FileError("the network drive sleeps")
        return honest(*arguments, **named)

    monkeypatch.setattr(_dives, "identify_campaign", moody)
    order = _dives.Order(METHOD, None, 2, 0.0)
    (dive,) = _dives.listed([campaigns[0]], order)
    (row,) = _dives.work(dive, order)
    assert (row["status"], row["attempts"]) == ("found", 3)
    tried.clear()
    (row,) = _dives.work(dive, _dives.Order(METHOD, None, 1, 0.0))
    assert (row["status"], row["reason"]) == ("failed", "the network drive sleeps")


def rows(masses, dates, payloads):
    """Makes a fleet with given parameters."""
    blank = dict.fromkeys(_dives.COLUMNS)
    return pd.DataFrame(
        [
            {
                **blank,
                "key": str(k),
                "dive": f"dive {k}",
                "status": "found",
                "dof": "surge",
                "mass": mass,
                "mass_std": 1.0,
                "mass_low95": mass - 2.0,
                "mass_high95": mass + 2.0,
                "mass_unit": "kg",
                "date": date,
                "payload_kg": payload,
                "caveats": ["gaps"],
            }
            for k, (mass, date, payload) in enumerate(zip(masses, dates, payloads, strict=True))
        ]
    )


def test_drift_and_outliers_are_those_that_were_put_in(tmp_path):
    rng = np.random.default_rng(1)
    days = np.arange(0, 730, 10)
    masses = 1000.0 + 12.0 * days / 365.25 + rng.normal(0.0, 1.0, len(days))
    masses[20] += 30.0
    dates = [pd.Timestamp("2025-01-01") + pd.Timedelta(days=int(day)) for day in days]
    frame = rows(masses, dates, rng.normal(50.0, 5.0, len(days)))
    (trend,) = sp.fleet._summary.summarise(frame).trends
    assert trend.with_date.value == pytest.approx(12.0, abs=0.5)
    assert trend.with_date.low95 < 12.0 < trend.with_date.high95 and trend.with_date.is_sure
    assert not trend.with_payload.is_sure
    assert trend.outliers == ("dive 20",)
    assert trend.scatter == pytest.approx(1.0, rel=0.3)
    fleet = sp.fleet.Fleet(frame.to_dict("records"), tmp_path / "plants.parquet")
    page = fleet.report().read_text()
    assert "dive 20" in page and "data:image/png" in page and "gaps" in page
    assert fleet.summary().to_pandas()["with_date_value"].iloc[0] == trend.with_date.value


def test_payload_shows_as_payload():
    payloads = np.linspace(0.0, 100.0, 21)
    frame = rows(1000.0 + 1.3 * payloads, [None] * 21, payloads)
    (trend,) = sp.fleet._summary.summarise(frame).trends
    assert trend.with_date is None
    assert trend.with_payload.value == pytest.approx(1.3, rel=1e-9)


def test_dates_and_payloads_stand_in_the_rows(campaigns, tmp_path):
    dives = [
        sp.fleet.Dive(path, name=f"D{k}", date=dt.date(2026, 5, 1 + k), payload_kg=10.0 * k)
        for k, path in enumerate(campaigns[:3])
    ]
    frame = sp.fleet.identify(dives, out=tmp_path, method=METHOD).to_pandas()
    assert list(frame["dive"]) == ["D0", "D1", "D2"]
    assert list(frame["date"].dt.day) == [1, 2, 3] and list(frame["payload_kg"]) == [0, 10, 20]
    read = pd.read_parquet(tmp_path / "plants.parquet")
    assert list(read["mass"]) == list(frame["mass"])


def test_a_campaign_is_given_once(campaigns, tmp_path):
    with pytest.raises(sp.InputError, match="given 2 times"):
        sp.fleet.identify([campaigns[0], campaigns[0]], out=tmp_path)
    with pytest.raises(sp.InputError, match="no campaign"):
        sp.fleet.identify([], out=tmp_path)
    with pytest.raises(FileNotFoundError, match="holds no fleet"):
        sp.fleet.Fleet.open(tmp_path / "nowhere")


PUSHED = {
    "vehicle": "published:bluerov2-heavy-von-benzon-2022",
    "axes": ["surge", "sway", "yaw"],
    "duration_s": 100.0,
    "hold_out_s": 60.0,
}


def test_thrusters_are_followed_over_dives(tmp_path):
    gains = [{}, {}, {"aft port": 0.75}]
    campaigns = [
        sp.twin({**PUSHED, "thruster_gains": of}, seed=k).write(tmp_path / f"dive {k}")
        for k, of in enumerate(gains)
    ]
    found = sp.fleet.identify(campaigns, out=tmp_path / "fleet", progress=False).thrusters()
    changed = found[found["change"] != ""]
    of = changed[["dive", "thruster", "change"]].to_numpy().tolist()
    assert of == [["dive 2", "aft port", "loss"]], changed.to_string()
    assert "from dive 2 on" in changed["message"].iloc[0]
