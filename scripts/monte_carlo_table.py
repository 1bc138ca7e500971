"""Turns the JSON of `seaplant monte-carlo` into docs/src/monte-carlo.md; see scripts/monte-carlo."""

import json
import pathlib
import sys

CASES = ["none", "tether", "current", "lag", "delay", "thrcoef", "lever", "all", "swell", "inflow"]
DOFS = ["surge", "sway", "heave", "yaw"]


def load(path: pathlib.Path) -> dict:
    return json.loads(path.read_text())


def rows_by(table: dict) -> dict:
    return {(row["dof"], row["method"], row["parameter"]): row for row in table["rows"]}


def percent(x: float) -> str:
    return f"{x:.2g}" if x < 10 else f"{x:.0f}"


def cell(rows: dict, dof: str, method: str) -> str:
    mass = rows.get((dof, method, "mass"))
    drag = rows.get((dof, method, "quadratic-drag"))
    if mass is None or drag is None:
        return "–"
    failed = f" ({mass['failures']} none)" if mass["failures"] else ""
    both = (mass["median_abs_error_percent"], drag["median_abs_error_percent"])
    return " / ".join(percent(x) for x in both) + failed


def main() -> None:
    folder = pathlib.Path(sys.argv[1])
    tables = {case: load(folder / f"{case}.json") for case in CASES}
    any_table = tables["none"]
    methods = list(dict.fromkeys(row["method"] for row in any_table["rows"]))
    print("# What each method gets wrong\n")
    print("Made by `scripts/monte-carlo`; do not edit.\n")
    print(
        f"Seaplant {any_table['version']}, the Jason 2 twin, {any_table['runs']} seeds a case: median"
        " |error| of mass / quadratic drag in % of the truth. `none` counts fits that gave no answer."
        " `all` is the first six disturbances together. Swell and inflow are what the method was not"
        " told of in the design; inflow is among the filter error method's candidates.\n"
    )
    for dof in DOFS:
        print(f"## {dof.capitalize()}\n")
        print("| disturbance | " + " | ".join(methods) + " |")
        print("|---|" + "---|" * len(methods))
        for case in CASES:
            rows = rows_by(tables[case])
            print(f"| {case} | " + " | ".join(cell(rows, dof, m) for m in methods) + " |")
        print()
    print("## Coverage\n")
    coverage = {case: load(folder / f"coverage-{case}.json") for case in ("none", "tether")}
    runs = coverage["none"]["runs"]
    print(
        f"Part of the 95 % intervals that hold the truth, in %, {runs} seeds: mass, quadratic drag,"
        " bias force. Output error's share one Student's t, that of the term which the disturbance"
        " leaves least independent time: under tether the mass is surer than it says. In heave,"
        " where force reacts to what disturbs, its drag is some 5 % off for that reason alone; the"
        " intervals cover it only because they are wide.\n"
    )
    print("| disturbance, method | " + " | ".join(DOFS) + " |\n|---|" + "---|" * len(DOFS))
    for case, table in coverage.items():
        rows = rows_by(table)
        names = ("mass", "quadratic-drag", "bias-force")
        for method in ("filter-error", "output-error"):
            of = lambda dof: ", ".join(
                f"{rows[(dof, method, name)]['coverage_percent']:.0f}" for name in names
            )
            print(f"| {case}, {method} | " + " | ".join(of(dof) for dof in DOFS) + " |")
    print("\n## Linear drag: false alarms and detections\n")
    linear = {truth: load(folder / f"linear-{truth}.json") for truth in ("zero", "half")}
    print(
        "Part of the filter error method's fits that took linear drag into the model, in %,"
        f" {linear['zero']['runs']} seeds, with a tether: where there is none, and where it is half of"
        " the quadratic drag at the root mean square speed (scripts/linear-drag-half.toml).\n"
    )
    print("| true linear drag | " + " | ".join(DOFS) + " |\n|---|" + "---|" * len(DOFS))
    for truth, table in linear.items():
        rates = {
            part["dof"]: part["admitted_percent"]
            for part in table["admissions"]
            if part["candidate"] == "linear-drag"
        }
        print(f"| {truth} | " + " | ".join(f"{rates[dof]:.0f}" for dof in DOFS) + " |")


if __name__ == "__main__":
    main()
