"""Identification sample by sample and controllers, against a vehicle integrated by SciPy."""

from collections.abc import Iterator

import numpy as np
import pytest
import seaplant as sp
from scipy.integrate import solve_ivp

SAMPLE_S = 0.1
DURATION_S = 300.0
# A record of 300 s with noise of 2 mm/s.
PART = 0.05


@pytest.fixture(scope="module")
def rov() -> sp.Plant:
    return sp.Plant.open("published:bluerov2-heavy-von-benzon-2022")


def driven(plant: sp.Plant) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """Returns time, velocity and force of surge driven by two sines, integrated by SciPy."""
    random = np.random.default_rng(4)
    x = np.zeros(12)
    for k in range(int(DURATION_S / SAMPLE_S)):
        t = SAMPLE_S * k
        u = np.zeros(6)
        u[0] = 30.0 * np.sin(0.7 * t) + 25.0 * np.sin(0.23 * t)
        noise = np.zeros(6)
        noise[0] = 0.002 * random.standard_normal()
        yield t, x[6:] + noise, u

        def rate(_: float, x: np.ndarray, u: np.ndarray = u) -> np.ndarray:
            return plant.derivative(x, u)

        x = solve_ivp(rate, (0.0, SAMPLE_S), x, rtol=1e-6).y[:, -1]


@pytest.fixture(scope="module")
def samples(rov: sp.Plant) -> list[tuple[float, np.ndarray, np.ndarray]]:
    return list(driven(rov))


@pytest.mark.parametrize("scheme", ["adaptive", "recursive", "ekf"])
def test_samples_tell_the_plant(
    rov: sp.Plant, samples: list[tuple[float, np.ndarray, np.ndarray]], scheme: str
) -> None:
    online = sp.Online(["surge"], scheme=scheme)
    told = [online.update(t, v, u) for t, v, u in samples]
    assert not any(told)
    found = online.estimate()
    mass = found.plant.coefficients["mass.surge"].value
    truth = rov.coefficients["mass.surge"].value
    assert abs(mass / truth - 1.0) < PART
    assert 0.0 < found.std["mass.surge"] < PART * truth
    assert np.isclose(online.coefficients["mass.surge"], mass)
    assert found.elapsed_s == pytest.approx(DURATION_S, abs=2 * SAMPLE_S)


def test_it_predicts_as_the_plant_that_it_found(
    samples: list[tuple[float, np.ndarray, np.ndarray]],
) -> None:
    online = sp.Online(["surge"])
    assert online.predict(1.0) is None
    for t, v, u in samples[:1500]:
        online.update(t, v, u)
    _, v, u = samples[1499]
    start = {"u": float(v[0])}
    moved = online.estimate().plant.simulate([0.0, 2.0], {"force.surge": u[0]}, start=start)
    predicted = online.predict(2.0)
    assert predicted is not None
    assert predicted[0] == pytest.approx(moved.velocity[-1, 0], abs=1e-4)


def test_names_do_as_well_as_numbers(rov: sp.Plant) -> None:
    by_name, by_number = sp.Online(["surge", "yaw"]), sp.Online(["surge", "yaw"])
    for k in range(600):
        t = SAMPLE_S * k
        u, r = 0.4 * np.sin(0.5 * t), 0.2 * np.sin(0.3 * t)
        by_name.update(t, {"u": u, "r": r}, {"surge": 9.0, "yaw": -1.0})
        by_number.update(t, [u, 0, 0, 0, 0, r], [9.0, 0, 0, 0, 0, -1.0])
    assert by_name.coefficients == by_number.coefficients


def test_it_starts_from_a_plant(rov: sp.Plant) -> None:
    online = sp.Online(rov, scheme="adaptive", settings={"adaptation_s": 30.0})
    known = {name: of.value for name, of in rov.coefficients.items()}
    assert online.coefficients == pytest.approx(known)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: sp.Online(["surge"], scheme="magic"), "magic"),
        (lambda: sp.Online(["sideways"]), "sideways"),
        (lambda: sp.Online([]), "no axes"),
        (lambda: sp.Online(["surge"], terms=["yaw: r"]), "yaw"),
        (lambda: sp.Online(["surge"], settings={"memory": 3.0}), "memory"),
        (lambda: sp.Online(["surge"], settings={"adaptation_s": -1.0}), "adaptation_s"),
        (lambda: sp.Online(["surge"]).update(0.0, [1.0], [0.0] * 6), "needs 6"),
        (lambda: sp.Online(["surge"]).update(0.0, {"x": 1.0}, [0.0] * 6), "velocity"),
        (lambda: sp.Online(["surge"]).update(0.0, [float("nan")] * 6, [0.0] * 6), "finite"),
        (lambda: sp.Online(["surge"]).estimate(), "not known yet"),
    ],
)
def test_what_cannot_be_is_told(make: object, told: str) -> None:
    with pytest.raises(sp.InputError, match=told):
        make()  # type: ignore[operator]


def test_time_must_go_on_and_a_restart_begins_anew() -> None:
    online = sp.Online(["surge"])
    online.update(1.0, [0.0] * 6, [0.0] * 6)
    with pytest.raises(sp.InputError, match="after that of the one before"):
        online.update(1.0, [0.0] * 6, [0.0] * 6)
    online.restart()
    online.update(0.0, [0.0] * 6, [0.0] * 6)


@pytest.mark.parametrize("law", ["pd", "pid", "exact", "non-exact", "slotine-li"])
@pytest.mark.parametrize("adaptive", [False, True])
def test_a_controller_settles_the_vehicle_that_scipy_integrates(
    rov: sp.Plant, law: str, adaptive: bool
) -> None:
    axes = {"surge": 0.15, "sway": 0.15, "heave": 0.15, "yaw": 0.15}
    controller = sp.Controller(rov, axes, law=law, adaptive=adaptive)
    x = np.zeros(12)
    for _ in range(600):
        u = controller.command(x, {"north": 0.5, "down": 0.3, "heading": 0.4})

        def rate(_: float, x: np.ndarray, u: np.ndarray = u) -> np.ndarray:
            return rov.derivative(x, u)

        x = solve_ivp(rate, (0.0, 0.1), x, rtol=1e-5).y[:, -1]
    # Weight and buoyancy differ, which PD does not know.
    close = 0.3 if law == "pd" else 0.02
    assert x[0] == pytest.approx(0.5, abs=0.02)
    assert x[2] == pytest.approx(0.3, abs=close)
    assert x[5] == pytest.approx(0.4, abs=0.02)


def test_gains_are_the_command_lines(rov: sp.Plant, command_line: object) -> None:
    told = command_line(  # type: ignore[operator]
        "control",
        "published:bluerov2-heavy-von-benzon-2022",
        "--bandwidth",
        "surge 0.1 Hz",
        "--limit",
        "surge 80 N",
        "--lag",
        "surge 0.2 s",
    )
    controller = sp.Controller(rov, {"surge": 0.1}, limit={"surge": 80.0}, lag_s={"surge": 0.2})
    assert controller.gains == told["gains"]


def test_what_no_loop_can_be_is_told_with_what_would_do(rov: sp.Plant) -> None:
    with pytest.raises(sp.InputError, match="would do"):
        sp.Controller(rov, {"surge": 2.0}, lag_s={"surge": 0.5})
    assert "0.5" in repr(sp.Controller(rov, {"surge": 0.5}))
    with pytest.raises(sp.InputError, match="above zero"):
        sp.Controller(rov, {"surge": -1.0})
    with pytest.raises(sp.InputError, match="sideways"):
        sp.Controller(rov, {"sideways": 0.1})
    controller = sp.Controller(rov, {"surge": 0.1, "yaw": 0.1}, limit={"yaw": 10.0})
    with pytest.raises(sp.InputError, match="unknown 'u'"):
        controller.command(None, {"u": 1.0})
    with pytest.raises(sp.InputError, match="not finite"):
        controller.command(None, {"north": float("nan")})
    assert "seaplant_plant.h" in controller.c_header()
    text, notes = controller.ardusub()
    assert "ATC_RAT_YAW_P" in text
    assert any("surge" in note for note in notes)
