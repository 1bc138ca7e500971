"""Computes the figures of a group of rows, and the table of all groups."""

import math

ASSURED = ("usable", "usable-with-care")
DOUBTED = ("doubtful", "do-not-use")
QUANTILES = (0.50, 0.90, 0.95)


def quantile(values, part):
    values = sorted(values)
    return values[max(0, math.ceil(part * len(values)) - 1)] if values else None


def grouped(entries):
    """Groups rows, in order of appearance, each with its item's name."""
    groups = {}
    for entry in entries:
        for row in entry["rows"]:
            groups.setdefault(row["group"], []).append(row | {"item": entry["item"]})
    return groups


def main_errors(row, key):
    """Returns absolute errors of the driven axes; roll and pitch are hardly driven."""
    errors = row.get(key, {})
    return [abs(off) for axis, off in errors.items() if axis not in ("roll", "pitch")]


def figures(rows):
    """Returns the entries of a group that must not get worse; `None` where there is nothing to
    count."""
    found = {}
    for key in ("mass", "drag"):
        errors = [off for row in rows for off in main_errors(row, key)]
        found |= {f"{key} {100 * q:.0f} %": quantile(errors, q) for q in QUANTILES}
    for key in ("mass", "drag"):
        held, all_of = (
            sum(row.get(f"{key}_intervals", [0, 0])[k] for row in rows) for k in (0, 1)
        )
        found[f"{key} held"] = held / all_of if all_of else None
    judged = [row for row in rows if "trust" in row]
    count = lambda test: sum(1 for row in judged if test(row)) if judged else None
    found["wrong"] = count(lambda row: row.get("wrong", False))
    found["false assurance"] = count(lambda row: row.get("wrong") and row["trust"] in ASSURED)
    found["false alarm"] = count(
        lambda row: row.get("wrong") is False and row["trust"] in DOUBTED
    )
    found["no plant"] = count(lambda row: row["trust"] == "none")
    return found


def markdown(entries):
    """Formats the complete table."""
    groups = grouped(entry for entry in entries if entry["group"] != "real")
    lines = [
        "| logs | plants | mass, % at 50, 90, 95 % | drag, % at 50, 90, 95 % | intervals of mass | of drag | usable, with care, doubtful, do not use, none | wrong | false assurance | false alarm | processor s |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for group, rows in groups.items():
        lines.append("| " + " | ".join([group, *cells(rows), seconds(entries, group)]) + " |")
    lines += ["", *of_real([entry for entry in entries if entry["group"] == "real"]), ""]
    total = sum(entry["seconds"] for entry in entries)
    failed = [entry["item"] for entry in entries if entry["error"]]
    lines.append(f"{len(entries)} campaigns, {total:.0f} s of processor time.")
    lines += [f"Without results: {', '.join(failed)}."] if failed else []
    return "\n".join(lines) + "\n"


def cells(rows):
    now = figures(rows)
    errors = [
        ", ".join(percent(now[f"{key} {100 * q:.0f} %"]) for q in QUANTILES)
        for key in ("mass", "drag")
    ]
    held = []
    for key in ("mass_intervals", "drag_intervals"):
        parts = [row.get(key, [0, 0]) for row in rows]
        held.append(f"{sum(p[0] for p in parts)} of {sum(p[1] for p in parts)}")
    told = [row["trust"] for row in rows if "trust" in row]
    trusts = ", ".join(
        str(told.count(trust))
        for trust in ("usable", "usable-with-care", "doubtful", "do-not-use", "none")
    )
    counts = [now["wrong"], now["false assurance"], now["false alarm"]]
    counts = ["" if count is None else str(count) for count in counts]
    return [str(len(rows)), *errors, *held, trusts if told else "", *counts]


def percent(part):
    return "–" if part is None else f"{100 * part:.2g}"


def seconds(entries, group):
    """Returns no time for a group that is another view of the same campaigns."""
    own = [entry["seconds"] for entry in entries if entry["group"] == group]
    return f"{sum(own):.0f}" if own else ""


def of_real(entries):
    if not entries:
        return []
    lines = [
        "| real logs | method | verdict | masses | e of held-out trials over that of a vehicle at rest | R² | processor s |",
        "|---|---|---|---|---|---|---|",
    ]
    for entry in entries:
        if not entry["rows"]:
            lines.append(f"| {entry['item']} | | none | | | | {entry['seconds']:.0f} |")
        for row in entry["rows"]:
            masses = [
                f"{name.removeprefix('mass.')} {value:.4g} ({low:.4g} to {high:.4g})"
                for name, (value, low, high) in row["masses"].items()
            ]
            errors = [f"{axis} {ratio(score)}" for axis, score in row["hold_out"].items()]
            fits = [f"{axis} {number(x['r_squared'])}" for axis, x in row["hold_out"].items()]
            told = [entry["item"], row["method"], row["trust"]]
            told += ["; ".join(part) for part in (masses, errors, fits)]
            lines.append("| " + " | ".join([*told, f"{entry['seconds']:.0f}"]) + " |")
    return lines


def error_ratio(score):
    """Returns the ratio of the error of held-out trials to that of a vehicle at rest; `None`
    where it diverges."""
    return score["error"] / score["null_error"] if score["error"] is not None else None


def ratio(score):
    return number(error_ratio(score))


def number(x):
    return "–" if x is None else f"{x:.3f}"
