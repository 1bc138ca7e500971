"""The campaigns that the gate identifies: the source of their logs, how to make them, and their
truth."""

import csv
import json
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STRANGERS = ROOT / "bench/strangers"
sys.path.insert(0, str(STRANGERS))
import one_axis
from reading import drag_keys

AXES = ["surge", "sway", "heave", "roll", "pitch", "yaw"]
ROWS = {
    "none": [],
    "tether": ["tether"],
    "current": ["current"],
    "lag": ["lag"],
    "delay": ["delay"],
    "all": ["tether", "current", "lag", "delay", "thrcoef", "lever"],
}
VEHICLES = ["rexrov", "bluerov2-heavy-von-benzon-2022"]
REAL = {
    "quick": ["bolt/heave", "bolt/yaw", "esso-osaka/surge"],
    "full": ["bolt/heave", "bolt/yaw", "esso-osaka/surge", "esso-osaka/planar"],
}
SEEDS = {
    "quick": {"twin": 4, "one_axis": len(one_axis.FAULTS), "six_axes": 4, "vehicle": 1},
    "full": {"twin": 20, "one_axis": 3 * len(one_axis.FAULTS), "six_axes": 20, "vehicle": 4},
}
FIRST_SEED = 100


@dataclass(frozen=True)
class Item:
    """One campaign: `make` writes it to a folder; `truth` returns its truth, or nothing."""

    name: str
    group: str
    make: Callable[[Path, Path], Path]
    truth: Callable[[Path], dict | None]


def items(size, python):
    """Returns every item of a table; `python` has NumPy, and is called only where it is needed."""
    seeds = SEEDS[size]
    found = [*cases(), *real(size)]
    found += [twin(row, FIRST_SEED + k) for k in range(seeds["twin"]) for row in ROWS]
    found += [stranger(k) for k in range(seeds["one_axis"])]
    for k in range(seeds["vehicle"]):
        found += [vehicle(name, FIRST_SEED + k) for name in VEHICLES]
    found += [stranger_of_six(k, python) for k in range(seeds["six_axes"])]
    return found


# Available logs with truth.


def cases():
    folder = os.environ.get("SEAPLANT_CASES")
    if not folder:
        print("gate: SEAPLANT_CASES is not set, so its cases are left out", file=sys.stderr)
        return
    for path in sorted(Path(folder).rglob("truth.json")):
        case, name = path.parent, "/".join(["cases", *path.parent.relative_to(folder).parts])
        there = lambda program, logs, case=case: case / "campaign.toml"
        yield Item(name, "cases", there, of_case)
        if "mass_matrix" in json.loads(path.read_text()):
            six = lambda program, logs, case=case: with_plant(case, logs)
            yield Item(f"{name}, as one plant", "cases, six axes", six, of_case)


def with_plant(case, logs):
    """Returns the same campaign with a plant of six axes in addition."""
    shutil.copytree(case, logs, dirs_exist_ok=True)
    campaign = logs / "campaign.toml"
    logs.chmod(0o755)
    campaign.chmod(0o644)
    campaign.write_text(campaign.read_text() + '\n[[plant]]\naxes = "six"\n')
    return campaign


def of_case(folder):
    truth = json.loads((folder / "truth.json").read_text())
    if "dof" in truth:
        return of_axis(truth)
    linear, quadratic = truth["linear_damping"], truth["quadratic_damping_on_abs_v_v"]
    own = lambda matrix: [matrix[k][k] for k in range(6)]
    drag = {"linear": own(linear), "quadratic": own(quadratic)}
    found = of_matrices(truth["mass_matrix"], drag, logged_speeds(folder))
    for i, axis in enumerate(AXES):
        for j, of in enumerate("uvwpqr"):
            if i != j:
                found["values"] |= {f"{axis}: {of}": linear[i][j]}
                found["values"] |= {f"{axis}: |{of}|{of}": quadratic[i][j]}
    return found


def logged_speeds(folder):
    """Computes the root mean square of the columns `v_surge (m/s)` … `v_yaw (rad/s)` of all
    logs."""
    names = [f"v_{axis} ({'m/s' if k < 3 else 'rad/s'})" for k, axis in enumerate(AXES)]
    sums, count = [0.0] * 6, 0
    for path in sorted(folder.glob("*.csv")):
        for row in csv.DictReader(path.open()):
            sums = [total + float(row[name]) ** 2 for total, name in zip(sums, names)]
            count += 1
    return [math.sqrt(total / count) for total in sums]


def of_axis(truth):
    """Returns the truth of one axis; drag is judged by its quadratic part."""
    axis = truth["dof"]
    linear, quadratic = drag_keys(axis)
    values = {
        f"mass.{axis}": truth["mass"],
        linear: truth["linear_drag"],
        quadratic: truth["quadratic_drag"],
    }
    return {"values": values, "speeds": {axis: None}}


def of_matrices(mass, drag, speeds):
    """Returns the truth of six axes; drag is judged at the usual speeds."""
    values = {}
    for i, axis in enumerate(AXES):
        values[f"mass.{axis}"] = mass[i][i]
        for j in range(i + 1, 6):
            values[f"mass.{axis}-{AXES[j]}"] = mass[i][j]
        linear, quadratic = drag_keys(axis)
        values[linear], values[quadratic] = drag["linear"][i], drag["quadratic"][i]
    return {"values": values, "speeds": dict(zip(AXES, speeds))}


# Real logs, whose truth is unknown.


def real(size):
    if not os.environ.get("SEAPLANT_DATA"):
        print("gate: SEAPLANT_DATA is not set, so real logs are left out", file=sys.stderr)
        return
    for name in REAL[size]:
        there = lambda program, logs, name=name: ROOT / f"examples/{name}.toml"
        yield Item(f"real/{name}", "real", there, lambda folder: None)


# Twins, made by the program that the table tests first.


def made_by(program, logs, spec):
    logs.mkdir(parents=True, exist_ok=True)
    (logs / "spec.toml").write_text(spec)
    out = logs / "twin"
    shutil.rmtree(out, ignore_errors=True)
    run = [program, "twin", logs / "spec.toml", "--out", out, "--quiet"]
    subprocess.run(run, check=True, capture_output=True, text=True)
    return out / "campaign.toml"


def listed(names):
    return ", ".join(f'"{name}"' for name in names)


def twin(row, seed):
    spec = f"seed = {seed}\ndisturbances = [{listed(ROWS[row])}]\n"
    make = lambda program, logs: made_by(program, logs, spec)
    return Item(f"twin/{row}/{seed}", f"twin {row}", make, of_twin)


def of_twin(folder):
    truth = json.loads((folder / "truth.json").read_text())
    values, speeds = {}, {}
    for axis, plant in truth["plants"].items():
        one = of_axis({"dof": axis, **plant})
        values |= one["values"]
        speeds |= one["speeds"]
    steady = {axis: of["quadratic_drag"] for axis, of in truth["steady"].items()}
    return {"values": values, "speeds": speeds, "steady": steady}


# Drag of a published vehicle is judged at these speeds, m/s and rad/s.
USUAL_SPEEDS = [0.4, 0.3, 0.3, 0.2, 0.2, 0.3]


def vehicle(name, seed):
    spec = f'vehicle = "published:{name}"\nseed = {seed}\ndisturbances = []\n'
    make = lambda program, logs: made_by(program, logs, spec)
    return Item(f"vehicle/{name}/{seed}", f"twin of {name}", make, of_vehicle)


def of_vehicle(folder):
    truth = json.loads((folder / "truth.json").read_text())["vehicle"]["coefficients"]
    # Coefficients that the published table lacks are zero.
    values = {f"mass.{a}-{b}": 0.0 for i, a in enumerate(AXES) for b in AXES[i + 1 :]}
    values |= {name: 0.0 for axis in AXES for name in drag_keys(axis)}
    return {"values": values | truth, "speeds": dict(zip(AXES, USUAL_SPEEDS))}


# Vehicles of simulators that share no code with the program.


def stranger(seed):
    def make(program, logs):
        one_axis.write(logs, seed)
        return logs / "campaign.toml"

    return Item(f"stranger/one-axis/{seed}", "strangers, one axis", make, of_case)


def stranger_of_six(seed, python):
    def make(program, logs):
        made = logs.with_name(logs.name + ".drawn")
        run = [python(), STRANGERS / "draw.py", made, "1", str(seed)]
        subprocess.run(run, check=True, capture_output=True, text=True)
        shutil.rmtree(logs, ignore_errors=True)
        shutil.move(made / f"{seed:03}", logs)
        made.rmdir()
        return logs / "campaign.toml"

    name = f"stranger/six-axes/{seed}"
    return Item(name, "strangers, six axes", make, of_stranger_of_six)


def of_stranger_of_six(folder):
    truth = json.loads((folder / "truth.json").read_text())
    found = of_matrices(truth["M"], truth, truth["rms_speed"])
    found["values"] |= {
        "weight-minus-buoyancy": truth["weight_minus_buoyancy"],
        "lever.z": truth["lever_z"],
    }
    if truth["strips"]:
        # Of strips, only surge and roll have drag of their own.
        for axis in ["sway", "heave", "pitch", "yaw"]:
            for name in drag_keys(axis):
                del found["values"][name]
    for i, axis in enumerate(AXES):
        speeds = zip("uvwpqr", truth["coupling"][i])
        found["values"] |= {f"{axis}: {name}": x for name, x in speeds if x}
    return found
