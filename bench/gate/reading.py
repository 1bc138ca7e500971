"""Reads results.json; no other file depends on its schema."""

import json

AXIS_SPEED = dict(zip(["surge", "sway", "heave", "roll", "pitch", "yaw"], "uvwpqr"))


def drag_keys(axis):
    """Returns the names of linear and quadratic drag of an axis by itself."""
    speed = AXIS_SPEED[axis]
    return f"{axis}: {speed}", f"{axis}: |{speed}|{speed}"


def read_result(path):
    """Returns every recommended plant of results of schema 2, and the plants of each method.

    Each plant is a dictionary of `axes`, `method`, `trust`, `reason`, `codes`, `is_recommended`,
    `parameters` (by the names of coefficients, each with `value`, `low95` and `high95`) and
    `hold_out` (by axis: `error`, `null_error`, `r_squared`); `failures` are messages.
    """
    results = json.loads(path.read_text())
    if results["schema"] != "seaplant/results/2":
        raise ValueError(f"{path} is of schema {results['schema']}; read_result knows 2 only")
    plants = []
    for name, plant in results["plants"].items():
        plants.append(_plant(plant) | {"is_recommended": True})
        for method in results["methods"].get(name, {}).values():
            plants.append(_plant(method) | {"is_recommended": False})
    steady = {
        axis: {"value": x["mean_quadratic_drag"], **(x.get("quadratic_drag") or {})}
        for axis, x in results.get("steady", {}).items()
    }
    failures = [failure["message"] for failure in results.get("failures", [])]
    return {"plants": plants, "steady": steady, "failures": failures}


def _plant(plant):
    verdict = plant["verdict"]
    hold_out = (plant.get("hold_out") or {}).get("by_axis", {})
    return {
        "axes": plant["axes"],
        "method": plant["method"],
        "trust": verdict["trust"],
        "reason": verdict["reason"],
        "codes": verdict["codes"],
        "parameters": plant["parameters"],
        "hold_out": {axis: _score(score) for axis, score in hold_out.items()},
    }


def _score(score):
    return {
        "error": score.get("mean_abs_error"),
        "null_error": score["null_error"],
        "r_squared": score.get("r_squared"),
    }
