"""Reads results.json; no other file depends on its schema."""

import json

AXIS_SPEED = dict(zip(["surge", "sway", "heave", "roll", "pitch", "yaw"], "uvwpqr"))


def drag_keys(axis):
    """Returns the names of linear and quadratic drag of an axis by itself."""
    speed = AXIS_SPEED[axis]
    return f"{axis}: {speed}", f"{axis}: |{speed}|{speed}"


def read_result(path):
    """Returns every recommended plant of results of schema 1, and one-axis plants of each
    method.

    Each plant is a dictionary of `axes`, `method`, `trust`, `reason`, `codes`, `is_recommended`,
    `parameters` (by the names of coefficients, each with `value`, and `low95` and `high95` where it
    has an interval) and `hold_out` (by axis: `error`, `null_error`, `r_squared`); `failures` are
    messages.
    """
    results = json.loads(path.read_text())
    if results["schema"] != "seaplant/results/1":
        raise ValueError(f"{path} is of schema {results['schema']}; read_result knows 1 only")
    plants = []
    for axis, plant in results["plants"].items():
        plants.append(_of_axis(axis, plant) | {"is_recommended": True})
        for method in results["methods"].get(axis, {}).values():
            plants.append(_of_axis(axis, method) | {"is_recommended": False})
    for plant in results.get("coupled", {}).values():
        plants.append(_several(plant) | {"is_recommended": True})
    steady = {
        axis: {"value": x["mean_quadratic_drag"], **(x.get("quadratic_drag") or {})}
        for axis, x in results.get("steady", {}).items()
    }
    failures = [failure["message"] for failure in results.get("failures", [])]
    return {"plants": plants, "steady": steady, "failures": failures}


def _of_axis(axis, plant):
    linear, quadratic = drag_keys(axis)
    named = {"mass": f"mass.{axis}", "linear_drag": linear, "quadratic_drag": quadratic}
    found = plant["parameters"]
    hold_out = plant.get("hold_out")
    return _judged(plant) | {
        "axes": [axis],
        "parameters": {named[key]: found[key] for key in named if found.get(key)},
        "hold_out": {axis: _score(hold_out)} if hold_out else {},
    }


def _several(plant):
    hold_out = (plant.get("hold_out") or {}).get("by_axis", {})
    return _judged(plant) | {
        "axes": plant["axes"],
        "parameters": plant["parameters"],
        "hold_out": {axis: _score(score) for axis, score in hold_out.items()},
    }


def _judged(plant):
    verdict = plant["verdict"]
    return {key: verdict[key] for key in ("trust", "reason", "codes")} | {
        "method": plant["method"]
    }


def _score(score):
    return {
        "error": score.get("mean_abs_error"),
        "null_error": score["null_error"],
        "r_squared": score.get("r_squared", score.get("r2")),
    }
