"""Writes the twin's trials as ULog files, one for each trial, and a campaign of these.

    python3 twin_to_ulog.py FOLDER_OF_THE_DEMO FOLDER

Numbers are stored as doubles, as the tables print them, so that not one bit of them changes. ULog has
no units: the campaign states them.
"""

import json
import pathlib
import re
import struct
import sys

from twin_to_dataflash import columns_of


def message(letter, body):
    return struct.pack("<HB", len(body), ord(letter)) + body


def write(trial, path):
    """Writes the trial's tables as one log; returns field and unit for each of the tables'
    headers."""
    start = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    formats, subscriptions, names, records = b"", b"", {}, []
    for number, table in enumerate(sorted(trial.glob("*.csv"))):
        times, header, rows = columns_of(table)
        fields = [f"f{k}" for k in range(len(header))]
        types = "".join(f"double {field};" for field in fields)
        formats += message("F", f"{table.stem}:uint64_t timestamp;{types}".encode())
        subscriptions += message("A", struct.pack("<BH", 0, number) + table.stem.encode())
        for text, field in zip(header, fields):
            names[text] = f"{table.stem}.{field}", re.search(r"\[(.*)\]", text).group(1)
        records += [(round(time * 1e6), number, row) for time, row in zip(times, rows)]
    data = b"".join(
        message("D", struct.pack(f"<HQ{len(row)}d", number, time_us, *row))
        for time_us, number, row in sorted(records)
    )
    path.write_bytes(start + formats + subscriptions + data)
    return names


def main():
    demo, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    names = {}
    for trial in sorted((demo / "logs").iterdir()):
        names |= write(trial, folder / f"{trial.name}.ulg")
    text = (demo / "campaign.toml").read_text()
    text = re.sub(r'log = \[\s*"logs/([^/"]+)/[^\]]*\]', r'log = "\1.ulg"', text)
    for header, (field, unit) in names.items():
        column = f"column = {json.dumps(field)}\nunit = {json.dumps(unit)}"
        text = text.replace(f"column = {json.dumps(header)}", column)
    (folder / "campaign.toml").write_text(text)
    for name in ["vehicle.toml", "bollard-pull.csv"]:
        (folder / name).write_bytes((demo / name).read_bytes())


if __name__ == "__main__":
    main()
