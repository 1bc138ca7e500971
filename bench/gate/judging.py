"""Computes how far a result is from the truth, as numbers for a table."""

from reading import drag_keys

MAIN = ["surge", "sway", "heave", "yaw"]
WRONG_MASS, WRONG_DRAG = 0.10, 0.20


def judged(item, result, truth):
    """Returns rows of the table: one for each recommended plant, for the filter error method in
    addition to another, and for steady runs. Without truth a row holds the prediction of
    held-out trials."""
    if truth is None:
        return [predicted(item, plant) for plant in recommended(result)]
    rows, missing = [], set(main(truth["speeds"]))
    for plant in recommended(result):
        if item.group.endswith("six axes") and len(plant["axes"]) == 1:
            continue
        missing -= set(plant["axes"])
        rows.append(row(item.group, plant, truth))
    rows += [{"group": item.group, "axes": axis, "trust": "none"} for axis in sorted(missing)]
    if item.name.startswith("twin/"):
        for plant in result["plants"]:
            if not plant["is_recommended"] and plant["method"] == "filter-error":
                rows.append(row(f"{item.group}, filter error", plant, truth))
        rows += [steady(item, result, axis, drag) for axis, drag in truth["steady"].items()]
    return rows


def recommended(result):
    return [plant for plant in result["plants"] if plant["is_recommended"]]


def row(group, plant, truth):
    values, found = truth["values"], plant["parameters"]
    mass, drag = {}, {}
    for axis in plant["axes"]:
        mass[axis] = off(found.get(f"mass.{axis}"), values[f"mass.{axis}"])
        if any(values.get(name) for name in drag_keys(axis)):
            drag[axis] = drag_off(axis, found, values, truth["speeds"][axis])
    kinds = {True: [], False: []}
    for name, number in found.items():
        if name in values and number.get("low95") is not None and counts(name, plant, truth):
            holds = number["low95"] <= values[name] <= number["high95"]
            kinds[name.startswith("mass.")].append(holds)
    is_wrong = any(abs(mass[axis]) > WRONG_MASS for axis in main(mass)) or any(
        abs(drag[axis]) > WRONG_DRAG for axis in main(drag)
    )
    return {
        "group": group,
        "axes": "-".join(plant["axes"]),
        "method": plant["method"],
        "trust": plant["trust"],
        "codes": plant["codes"],
        "mass": mass,
        "drag": drag,
        "wrong": is_wrong,
        "mass_intervals": [sum(kinds[True]), len(kinds[True])],
        "drag_intervals": [sum(kinds[False]), len(kinds[False])],
    }


def counts(name, plant, truth):
    """Returns the intervals that count: for one axis mass and quadratic drag, for several axes
    all."""
    axis = plant["axes"][0]
    is_simple = len(plant["axes"]) == 1 and truth["speeds"][axis] is None
    return not is_simple or name in (f"mass.{axis}", drag_keys(axis)[1])


def main(errors):
    """Returns the axes by which a plant is judged: those that are driven."""
    return [axis for axis in errors if axis in MAIN]


def off(found, true):
    """Returns the relative error; a coefficient that was not fitted is zero."""
    return (found["value"] if found else 0.0) / true - 1.0


def drag_off(axis, found, values, speed):
    linear, quadratic = drag_keys(axis)
    if speed is None:
        return off(found.get(quadratic), values[quadratic])
    at = lambda of: (of(linear) + of(quadratic) * speed) * speed
    number = lambda name: (found.get(name) or {"value": 0.0})["value"]
    return at(number) / at(lambda name: values.get(name, 0.0)) - 1.0


def steady(item, result, axis, drag):
    group, found = f"{item.group}, steady runs", result["steady"].get(axis)
    if found is None:
        return {"group": group, "axes": axis, "trust": "none"}
    holds = [found["low95"] <= drag <= found["high95"]] if "low95" in found else []
    return {
        "group": group,
        "axes": axis,
        "mass": {},
        "drag": {axis: off(found, drag)},
        "mass_intervals": [0, 0],
        "drag_intervals": [sum(holds), len(holds)],
    }


def predicted(item, plant):
    """Returns the figures of a plant of real logs."""
    numbers = {}
    for name, number in plant["parameters"].items():
        if number.get("low95") is not None and name.startswith("mass."):
            numbers[name] = [number["value"], number["low95"], number["high95"]]
    return {
        "group": item.group,
        "axes": "-".join(plant["axes"]),
        "method": plant["method"],
        "trust": plant["trust"],
        "codes": plant["codes"],
        "hold_out": plant["hold_out"],
        "masses": numbers,
    }
