"""Writes the twin's trials as DataFlash logs, one for each trial, and a campaign of these.

    python3 twin_to_dataflash.py FOLDER_OF_THE_DEMO FOLDER

Numbers are stored as doubles, as the tables print them, so that not one bit of them changes.
"""

import csv
import json
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parent.parent.parent / "seaplant-log/tests/reference"))

import dataflash

LETTERS = {"s": "s", "q": "rpm", "n": "m/s", "d": "deg", "m": "m", "-": ""}
TYPES = {"thrusters": "RCOU", "dvl": "VISO", "attitude": "ATT", "depth": "BARO"}


def columns_of(table):
    """Returns times, and each column by its header."""
    with open(table, newline="") as file:
        header, *rows = csv.reader(file)
    cells = [[float(cell) for cell in row] for row in rows]
    return [row[0] for row in cells], header[1:], [row[1:] for row in cells]


def write(trial, path):
    """Writes the trial's tables as one log; returns the names of its fields by the tables'
    headers."""
    log = dataflash.Writer()
    log.letters(LETTERS, {"-": 0.0, "F": 1e-6})
    by_unit = {unit: letter for letter, unit in LETTERS.items()}
    names, records = {}, []
    for number, table in enumerate(sorted(trial.glob("*.csv")), 1):
        kind = TYPES[table.stem]
        times, header, rows = columns_of(table)
        fields = [f"F{k}" for k in range(1, len(header) + 1)]
        log.define(number, kind, "Q" + "d" * len(fields), ",".join(["TimeUS", *fields]))
        units = [by_unit[re.search(r"\[(.*)\]", text).group(1)] for text in header]
        log.record(132, 0, number, "s" + "".join(units), "F" + "-" * len(units))
        names |= {text: f"{kind}.{field}" for text, field in zip(header, fields)}
        records += [(round(time * 1e6), number, row) for time, row in zip(times, rows)]
    for time_us, number, row in sorted(records):
        log.record(number, time_us, *row)
    path.write_bytes(log.content)
    return names


def main():
    demo, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    names = {}
    for trial in sorted((demo / "logs").iterdir()):
        names |= write(trial, folder / f"{trial.name}.BIN")
    text = (demo / "campaign.toml").read_text()
    text = re.sub(r'log = \[\s*"logs/([^/"]+)/[^\]]*\]', r'log = "\1.BIN"', text)
    for header, field in names.items():
        text = text.replace(f"column = {json.dumps(header)}", f"column = {json.dumps(field)}")
    (folder / "campaign.toml").write_text(text)
    for name in ["vehicle.toml", "bollard-pull.csv"]:
        (folder / name).write_bytes((demo / name).read_bytes())


if __name__ == "__main__":
    main()
