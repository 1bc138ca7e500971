"""Rows on disk: a Parquet file per dive while a fleet is processed, one for all at the end."""

from __future__ import annotations

import datetime as dt
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from seaplant.fleet._dives import COLUMNS, Row

PLANTS = "plants.parquet"


class Store:
    """The folder of a fleet.

    A dive's rows are written as soon as they are there, to a file of their own that appears
    whole or not at all: whenever and however a run ends, what was found stays found.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.dives = folder / "dives"

    def put(self, rows: list[Row]) -> None:
        """Stores the rows of one dive."""
        self.dives.mkdir(parents=True, exist_ok=True)
        _write(self.dives / f"{rows[0]['key']}.parquet", rows)

    def known(self) -> dict[str, list[Row]]:
        """Returns the rows of every dive in the folder, by its key."""
        found: dict[str, list[Row]] = {}
        for path in [self.folder / PLANTS, *sorted(self.dives.glob("*.parquet"))]:
            if path.exists():
                of_file: dict[str, list[Row]] = {}
                for row in _read(path):
                    of_file.setdefault(row["key"], []).append(row)
                found |= of_file
        return found

    def finish(self, rows: Iterable[Row]) -> Path:
        """Writes all rows to one file, and removes those of single dives."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / PLANTS
        _write(path, list(rows))
        for of in self.dives.glob("*.parquet"):
            of.unlink()
        return path


def is_fresh(rows: list[Row]) -> bool:
    """Returns whether every file that a dive was identified from is unchanged."""
    started: dt.datetime = rows[0]["started"]
    for row in rows:
        if row["status"] != "found" or row["inputs"] is None:
            return False
        for of in json.loads(row["inputs"]):
            try:
                now = Path(of["path"]).stat()
            except OSError:
                return False
            if now.st_size != of["bytes"] or now.st_mtime > started.timestamp():
                return False
    return True


def _schema() -> Any:
    import pyarrow as pa

    kinds = {
        "string": pa.string(),
        "double": pa.float64(),
        "int64": pa.int64(),
        "bool": pa.bool_(),
        "timestamp": pa.timestamp("us"),
        "instant": pa.timestamp("us", tz="UTC"),
        "strings": pa.list_(pa.string()),
    }
    return pa.schema([(name, kinds[kind]) for name, kind in COLUMNS.items()])


def _write(path: Path, rows: list[Row]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    aside = path.with_name(f".{path.name}.aside")
    pq.write_table(pa.Table.from_pylist(rows, schema=_schema()), aside)
    aside.replace(path)


def _read(path: Path) -> list[Row]:
    import pyarrow.parquet as pq

    rows: list[Row] = pq.read_table(path).to_pylist()
    return rows
