"""Reads log.csv by Python's csv module and prints the expected result of seaplant-log.

    python3 make_reference.py > log.json

For each column but time: the number of values, their exactly rounded sum, the first and last.
"""

import csv
import json
import math
import pathlib
import platform


def number(cell):
    """Returns the cell's value, or None where it holds no finite number."""
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def main():
    path = pathlib.Path(__file__).with_name("log.csv")
    with path.open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(line for line in file if not line.startswith("#"))
    rows = [row for row in rows if number(row[0]) is not None]
    columns = {}
    for k, name in enumerate(header[1:], start=1):
        pairs = [(float(row[0]), number(row[k])) for row in rows]
        pairs = [(time, value) for time, value in pairs if value is not None]
        times, values = zip(*pairs)
        columns[name] = {
            "count": len(values),
            "sum": math.fsum(values),
            "first": values[0],
            "last": values[-1],
            "first_time": times[0],
            "last_time": times[-1],
        }
    made_by = (
        f"{platform.python_implementation()} {platform.python_version()}, csv {csv.__version__}"
    )
    print(json.dumps({"made_by": made_by, "columns": columns}, indent=2))


if __name__ == "__main__":
    main()
