"""A dive, and the rows of its identification."""

from __future__ import annotations

import datetime as dt
import hashlib
import json
import os
import socket
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from seaplant import _native
from seaplant._choices import Methods, Terms
from seaplant._results import PlantResult, Results
from seaplant.errors import InputError
from seaplant.identification import identify_campaign

Row = dict[str, Any]
"""One plant, or one failure, by the names of `COLUMNS`."""

PARAMETERS = ("mass", "quadratic_drag", "linear_drag", "bias_force")

COLUMNS: dict[str, str] = {
    "key": "string",
    "dive": "string",
    "campaign": "string",
    "date": "timestamp",
    "payload_kg": "double",
    "status": "string",
    "reason": "string",
    "dof": "string",
    "method": "string",
    **{
        name: kind
        for parameter in PARAMETERS
        for name, kind in (
            (parameter, "double"),
            (f"{parameter}_std", "double"),
            (f"{parameter}_low95", "double"),
            (f"{parameter}_high95", "double"),
            (f"{parameter}_unit", "string"),
        )
    },
    "stable": "bool",
    "fit_error": "double",
    "fit_null_error": "double",
    "hold_out_error": "double",
    "hold_out_null_error": "double",
    "vehicle": "string",
    "thrusters": "string",
    "nuisances": "string",
    "caveats": "strings",
    "caveat_messages": "strings",
    "version": "string",
    "command": "string",
    "settings": "string",
    "inputs": "string",
    "attempts": "int64",
    "seconds": "double",
    "worker": "string",
    "started": "instant",
}
"""Columns of ``plants.parquet``, and their types; what is no plain number is JSON."""

VOLATILE = ("attempts", "seconds", "worker", "started")
"""Columns that differ from one run to the next."""


@dataclass(frozen=True)
class Dive:
    """A campaign, with its date and payload.

    Attributes
    ----------
    campaign
        Its campaign.toml, which workers must be able to read.
    name
        What tables call it; the name of its folder if not given.
    date
        When it was, to tell drift by; UTC if it states no zone.
    payload_kg
        What the vehicle carried, kg, to tell its mark by.
    """

    campaign: str | PathLike[str]
    name: str | None = None
    date: dt.date | None = None
    payload_kg: float | None = None


@dataclass(frozen=True)
class Order:
    """Instructions for every dive, sent to the workers."""

    methods: Methods
    terms: Terms
    retries: int
    pause_s: float

    def key(self, campaign: Path) -> str:
        """Key that identifies dives, and runs of one dive that would differ."""
        said = [str(campaign), self.methods, self.terms, _native.version()]
        text = json.dumps(said, default=list)
        return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def work(dive: Row, order: Order) -> list[Row]:
    """Identifies one dive; returns at least one row in any case.

    What the system refuses is tried again, for network drives have moods; what is wrong with
    the files would be wrong again.
    """
    started, clock = now(), time.perf_counter()
    for attempt in range(1, order.retries + 2):
        try:
            fit = identify_campaign(dive["campaign"], order.methods, terms=order.terms)
        except OSError as error:
            rows = [failure(dive, reason_of(error))]
            if attempt <= order.retries and not isinstance(error, FileNotFoundError):
                time.sleep(order.pause_s)
                continue
        except Exception as error:
            rows = [failure(dive, reason_of(error))]
        else:
            rows = rows_of(dive, fit.results)
        break
    ended = {
        "attempts": attempt,
        "seconds": time.perf_counter() - clock,
        "worker": f"{socket.gethostname()}:{os.getpid()}",
        "started": started,
    }
    return [{**row, **ended} for row in rows]


def now() -> dt.datetime:
    """Returns the time, independent of a worker's time zone."""
    return dt.datetime.now(dt.timezone.utc)


def reason_of(error: BaseException) -> str:
    """Returns why a dive failed, with the type of the error if it is not the library's own."""
    said = str(error) or "no reason given"
    return (
        said if isinstance(error, (InputError, OSError)) else f"{type(error).__name__}: {said}"
    )


def failure(dive: Row, reason: str, dof: str | None = None, method: str | None = None) -> Row:
    """Returns the row of a failure."""
    empty: Row = dict.fromkeys(COLUMNS)
    row = {"status": "failed", "reason": reason, "dof": dof, "method": method}
    return {**empty, **dive, **row, "version": _native.version()}


def rows_of(dive: Row, results: Results) -> list[Row]:
    """Returns a row for each plant, and one for each degree of freedom without any."""
    empty: Row = dict.fromkeys(COLUMNS)
    provenance = {
        "version": results.version,
        "command": results.provenance.command,
        "settings": json.dumps(results.provenance.settings, sort_keys=True),
        "inputs": json.dumps([of.to_dict() for of in results.provenance.inputs]),
        "vehicle": results.vehicle,
        "thrusters": json.dumps(_thrusters(results), sort_keys=True),
    }
    rows = [
        {**empty, **dive, **provenance, **_plant(name, plant)}
        for name, plant in results.plants.items()
    ]
    without: dict[str, list[str]] = {}
    for of in results.failures:
        if of.dof not in results.plants:
            without.setdefault(of.dof, []).append(f"{of.method}: {of.message}")
    rows += [
        {**failure(dive, "\n".join(reasons), dof), **provenance}
        for dof, reasons in without.items()
    ]
    return rows or [
        {**failure(dive, 'no trial of the campaign has role = "fit"'), **provenance}
    ]


def _plant(name: str, plant: PlantResult) -> Row:
    """Returns the row of a plant; parameters and errors have columns for one axis only."""
    nuisances = {of: parameter.to_dict() for of, parameter in plant.nuisances.items()}
    row: Row = {
        "status": "found",
        "dof": name,
        "method": plant.method,
        "stable": None if plant.alone is None else plant.alone.stable,
        "nuisances": json.dumps(nuisances, sort_keys=True),
        "caveats": [of.code for of in plant.caveats],
        "caveat_messages": [of.message for of in plant.caveats],
    }
    for of in PARAMETERS:
        parameter = getattr(plant.by_axis.get(name), of, None)
        if parameter is not None:
            row[of] = parameter.value
            for part in ("std", "low95", "high95", "unit"):
                row[f"{of}_{part}"] = getattr(parameter, part)
    for what, score in (("fit", plant.fit), ("hold_out", plant.hold_out)):
        own = None if score is None else score.by_axis.get(name)
        if own is not None:
            row[f"{what}_error"] = own.mean_abs_error
            row[f"{what}_null_error"] = own.null_error
    return row


def _thrusters(results: Results) -> dict[str, Any]:
    """Returns what each thruster gives, in the form that the library follows over dives."""
    estimates: dict[str, Any] = {}
    exchanged: list[list[str]] = []
    for plant in results.plants.values():
        for name, of in plant.thruster_estimates.items():
            known = estimates.get(name)
            if known is None or of.gain.std < known["gain"]["std"]:
                estimates[name] = of.to_dict()
        exchanged += [list(pair) for pair in plant.thrusters_exchanged]
    return {"estimates": estimates, "exchanged": exchanged}


def listed(campaigns: Sequence[Dive | str | PathLike[str]], order: Order) -> list[Row]:
    """Returns the dives in the form of rows, each with a unique key and name."""
    dives: list[Row] = []
    for of in campaigns:
        dive = of if isinstance(of, Dive) else Dive(of)
        campaign = Path(dive.campaign).absolute()
        dives.append(
            {
                "key": order.key(campaign),
                "dive": dive.name or campaign.parent.name,
                "campaign": str(campaign),
                "date": _instant(dive.date),
                "payload_kg": dive.payload_kg,
            }
        )
    count = Counter(of["campaign"] for of in dives)
    if twice := [campaign for campaign, times in count.items() if times > 1]:
        raise InputError(
            f"{twice[0]} is given {count[twice[0]]} times; name each campaign once"
        )
    return dives


def _instant(date: dt.date | None) -> dt.datetime | None:
    if date is None:
        return None
    if not isinstance(date, dt.datetime):
        return dt.datetime(date.year, date.month, date.day)
    return (
        date if date.tzinfo is None else date.astimezone(dt.timezone.utc).replace(tzinfo=None)
    )
