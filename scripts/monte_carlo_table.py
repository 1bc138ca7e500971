"""Turns the JSON of `seaplant monte-carlo` into docs/src/monte-carlo.md; see scripts/monte-carlo.

`--cases` prints the disturbances of the tables instead, one set a line.
"""

import json
import pathlib
import sys

CASES = [
    "none",
    "tether",
    "current",
    "lag",
    "delay",
    "thrcoef",
    "lever",
    "all",
    "swell",
    "inflow",
    "lag-two-way",
    "slew",
    "inflow-one-sided",
    "thrust-exponent",
    "battery-sag",
    "swell-narrow-band",
    "current-drift",
    "velocity-averaging",
    "velocity-lag",
    "dvl-scale",
    "spikes",
    "dropouts",
    "stamp-jitter",
    "slow-thrust-log",
    "heading-gaps",
    "heading-drift",
    "tether,lag,swell-narrow-band",
    "current,lag,dropouts",
    "tether,lag,inflow,spikes",
]
DOFS = ["surge", "sway", "heave", "yaw"]
PARAMETERS = ("mass", "quadratic-drag", "bias-force")


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


def told(table: dict, dof: str) -> str:
    for of in table["assurance"]:
        if of["dof"] == dof:
            usable = f"{of['wrong_but_usable']} + {of['wrong_but_usable_with_care']}"
            return f"{usable} of {of['wrong']}; {of['good_but_doubted']} of {of['good']}"
    return "–"


def spoken(case: str) -> str:
    return case.replace(",", ", ")


def heading_of(first: str, columns: list[str]) -> str:
    return f"| {first} | " + " | ".join(columns) + " |\n|---|" + "---|" * len(columns)


def errors(tables: dict, methods: list[str]) -> None:
    for dof in DOFS:
        print(f"## {dof.capitalize()}\n")
        print(heading_of("disturbance", ["seeds", *methods]))
        for case, table in tables.items():
            rows = rows_by(table)
            cells = [str(table["runs"]), *(cell(rows, dof, m) for m in methods)]
            print(f"| {spoken(case)} | " + " | ".join(cells) + " |")
        print()


def assurance(tables: dict) -> None:
    print("## False assurance and false alarms\n")
    print(
        "For the recommended plants, the table counts the wrong plants with the verdict `usable` +"
        " `usable with care`, and then the good plants with the verdict `doubtful` or `do not use`. A"
        " plant is wrong if its mass is off by more than 10 % or its drag, at the mean speed of the"
        " held-out trial, by more than 20 %; it is good if both are within 5 % and 10 %.\n"
    )
    print(heading_of("disturbance", DOFS))
    for case, table in tables.items():
        print(f"| {spoken(case)} | " + " | ".join(told(table, dof) for dof in DOFS) + " |")
    every = [of for table in tables.values() for of in table["assurance"]]
    total = lambda key: sum(of[key] for of in every)
    print(
        f"\nIn total, {total('wrong_but_usable')} of {total('wrong')} wrong plants were called usable"
        f" and {total('wrong_but_usable_with_care')} usable with care; {total('good_but_doubted')} of"
        f" {total('good')} good plants were called doubtful or not to be used.\n"
    )


def coverage(folder: pathlib.Path) -> None:
    print("## Coverage\n")
    tables = {case: load(folder / f"coverage-{case}.json") for case in ("none", "tether")}
    print(
        "The table shows the percentage of 95 % intervals that include the truth, for mass, quadratic"
        f" drag and bias force, from {tables['none']['runs']} seeds. All intervals of output error use"
        " the same quantile of Student's t, that of the term with the fewest effective samples under"
        " the disturbance; under tether the mass is therefore more certain than its interval says. In"
        " heave, where force reacts to the disturbances, the drag of output error is some 5 % off for"
        " that reason alone; the intervals cover it only because they are wide.\n"
    )
    print(heading_of("disturbance, method", DOFS))
    for case, table in tables.items():
        rows = rows_by(table)
        for method in ("filter-error", "output-error"):
            of = lambda dof: ", ".join(
                f"{rows[(dof, method, name)]['coverage_percent']:.0f}" for name in PARAMETERS
            )
            print(f"| {case}, {method} | " + " | ".join(of(dof) for dof in DOFS) + " |")


def linear_drag(folder: pathlib.Path) -> None:
    print("\n## Linear drag: false alarms and detections\n")
    tables = {truth: load(folder / f"linear-{truth}.json") for truth in ("zero", "half")}
    print(
        "The table shows the percentage of the filter error method's fits that included linear drag in"
        f" the model, from {tables['zero']['runs']} seeds with a tether: where the true linear drag is"
        " zero, and where it is half of the quadratic drag at the root mean square speed"
        " (scripts/linear-drag-half.toml).\n"
    )
    print(heading_of("true linear drag", DOFS))
    for truth, table in tables.items():
        rates = {
            part["dof"]: part["admitted_percent"]
            for part in table["admissions"]
            if part["candidate"] == "linear-drag"
        }
        print(f"| {truth} | " + " | ".join(f"{rates[dof]:.0f}" for dof in DOFS) + " |")


def main() -> None:
    if sys.argv[1:] == ["--cases"]:
        print("\n".join(CASES))
        return
    folder = pathlib.Path(sys.argv[1])
    made = [case for case in CASES if (folder / f"{case}.json").exists()]
    tables = {case: load(folder / f"{case}.json") for case in made}
    first = next(iter(tables.values()))
    methods = list(dict.fromkeys(row["method"] for row in first["rows"]))
    print("# What each method gets wrong\n")
    print("Made by `scripts/monte-carlo`; do not edit.\n")
    print(
        f"The tables below are for Seaplant {first['version']} and the Jason 2 [twin](twin.md). They"
        " show the median |error| of mass / quadratic drag in % of the truth; `none` in brackets"
        " counts fits without a result. [The page on the twin](twin.md#disturbances) describes the"
        " disturbances; `all` is the first six together.\n"
    )
    errors(tables, methods)
    assurance(tables)
    coverage(folder)
    linear_drag(folder)


if __name__ == "__main__":
    main()
