"""The FMU, validated and simulated by FMPy."""

from __future__ import annotations

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

VELOCITIES = ["u", "v", "w", "p", "q", "r"]
WRENCH = ["force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z"]


def slave(case, tmp_path):
    path = str(case.file("fmu", "seaplant_plant.fmu"))
    description = read_model_description(path)
    fmu = FMU3Slave(
        guid=description.guid,
        unzipDirectory=extract(path, str(tmp_path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="plant",
    )
    references = {v.name: v.valueReference for v in description.modelVariables}
    return fmu, references


def test_it_is_valid(case):
    assert validate_fmu(str(case.file("fmu", "seaplant_plant.fmu"))) == []


def test_fmpy_simulates_it(case):
    path = str(case.file("fmu", "seaplant_plant.fmu"))
    names = ["north", "u"]
    result = simulate_fmu(path, stop_time=1.0, output_interval=0.1, output=names)
    assert len(result) == 11 and np.isfinite(result["north"]).all()


def test_a_minute(case, tmp_path):
    fmu, at = slave(case, tmp_path)
    trajectory = case.reference["trajectory"]
    fmu.instantiate()
    fmu.setFloat64([at["start_heading"]], [trajectory["heading"]])
    fmu.enterInitializationMode()
    names = ["current_north", "current_east", "current_down"]
    fmu.setFloat64([at[name] for name in names], trajectory["current"])
    fmu.exitInitializationMode()
    forces = np.array(trajectory["forces"])
    own = [k for k in range(6) if case.own[k]]
    worst = 0.0
    for k, expected in enumerate(trajectory["velocity"]):
        found = np.array(fmu.getFloat64([at[name] for name in VELOCITIES]))
        worst = max(worst, np.abs(found - expected)[case.own].max())
        tau = forces[:, min(k // 10, forces.shape[1] - 1)]
        fmu.setFloat64([at[WRENCH[i]] for i in own], [tau[i] for i in own])
        fmu.doStep(currentCommunicationPoint=0.5 * k, communicationStepSize=0.5)
    assert worst < 1e-6, worst
    fmu.terminate()
    fmu.freeInstance()


def test_coefficients_are_tunable_and_states_come_back(case, tmp_path):
    if case.name != "boat":
        return
    fmu, at = slave(case, tmp_path)
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.setFloat64([at["force_x"]], [600.0])
    state = fmu.getFMUState()

    def speed():
        fmu.setFMUState(state)
        for k in range(60):
            fmu.doStep(currentCommunicationPoint=k, communicationStepSize=1.0)
        return fmu.getFloat64([at["u"]])[0]

    first = speed()
    assert speed() == first
    name = "theta_surge_absu_u"
    (drag,) = fmu.getFloat64([at[name]])
    fmu.setFloat64([at[name], at["theta_surge_u"]], [4 * drag, 0.0])
    state = fmu.getFMUState()
    # A state holds the parameters that were in force when it was taken.
    assert abs(speed() - np.sqrt(600.0 / (4 * drag))) < 1e-6
    fmu.terminate()
    fmu.freeInstance()


def test_thrusters_drive_it(case, tmp_path):
    thrust = case.reference["thrust"]
    inputs, expected = thrust["inputs"][0], thrust["wrench"][0]
    if not inputs:
        return

    def run(values_of):
        fmu, at = slave(case, tmp_path)
        values = values_of(at)
        fmu.instantiate()
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmu.setFloat64([at[name] for name in values], list(values.values()))
        fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.1)
        found = fmu.getFloat64([at[name] for name in VELOCITIES])
        fmu.terminate()
        fmu.freeInstance()
        return np.array(found)

    if case.name == "every-term":
        # Its thrust lags: the first step is not that of the inputs' own wrench.
        return

    def driven(names):
        thrusters = [name for name in names if name.startswith("thruster_")]
        # Only curves that were measured at a voltage ask for one.
        volts = {"supply_voltage": thrust["supply_v"]} if "supply_voltage" in names else {}
        return dict(zip(thrusters, inputs, strict=True)) | volts

    by_inputs = run(driven)
    # A plant of some axes has inputs for these.
    wrench = dict(zip(WRENCH, expected, strict=True))
    by_wrench = run(lambda names: {name: x for name, x in wrench.items() if name in names})
    assert np.abs(by_inputs - by_wrench).max() < 1e-12


def test_thrusters_lag_as_in_the_module_for_numpy(case, tmp_path):
    if case.name != "every-term":
        return
    from test_python import module

    plant = module(case.file("python", "seaplant_plant.py"))
    actuated = case.reference["actuated"]
    inputs, volts = np.array(actuated["inputs"]).T, actuated["supply_v"]
    fmu, at = slave(case, tmp_path)
    names = [name for name in at if name.startswith("thruster_")]
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.setFloat64([at[name] for name in names], list(inputs[0]))
    fmu.setFloat64([at["supply_voltage"]], [volts])
    fmu.exitInitializationMode()
    actuators = plant.Actuators(inputs[0])
    x = np.zeros(13)
    x[3] = 1.0
    for k in range(20):
        fmu.setFloat64([at[name] for name in names], list(inputs[k]))
        fmu.doStep(currentCommunicationPoint=0.5 * k, communicationStepSize=0.5)
        for _ in range(25):
            x = plant.step(x, actuators.wrench(inputs[k], 0.02, volts), 0.02)
        found = np.array(fmu.getFloat64([at[name] for name in VELOCITIES]))
        assert np.abs(found - x[7:]).max() < 1e-9
    fmu.terminate()
    fmu.freeInstance()
