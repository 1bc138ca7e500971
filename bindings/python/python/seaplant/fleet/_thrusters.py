"""Thrusters over dives."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from seaplant import _native
from seaplant.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    "dive",
    "date",
    "thruster",
    "gain",
    "gain_std",
    "gain_low95",
    "gain_high95",
    "change",
    "message",
)


def followed(frame: pd.DataFrame) -> pd.DataFrame:
    """Follows each thruster over the dives of a fleet."""
    import pandas as pd

    found = frame[frame["thrusters"].notna()].drop_duplicates("key")
    if found["date"].notna().all():
        found = found.sort_values("date", kind="stable")
    vehicles = sorted(set(found["vehicle"]))
    if len(vehicles) > 1:
        raise InputError(
            f"the dives are of different vehicles: {', '.join(vehicles)}; make a fleet of each"
        )
    dives = [json.loads(text) for text in found["thrusters"]]
    _check_names(list(found["dive"]), dives)
    names = [str(name) for name in found["dive"]]
    rows = []
    for thruster, history in json.loads(_native.follow_thrusters(json.dumps(dives))).items():
        for k, gain in enumerate(history["gains"]):
            of = [change for change in history["changes"] if change["from"] == k]
            of_dive = found.iloc[k]
            row = [of_dive["dive"], of_dive["date"], thruster, *_numbers(gain)]
            said = "; ".join(change["message"] for change in of)
            for at in range(len(names), 0, -1):
                said = said.replace(f"[{at}]", names[at - 1])
            rows.append([*row, ", ".join(change["cause"] for change in of), said])
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _numbers(gain: dict[str, Any] | None) -> list[float | None]:
    if gain is None:
        return [None] * 4
    return [gain["value"], gain["std"], *gain["interval95"]]


def _check_names(names: list[str], dives: list[dict[str, Any]]) -> None:
    known = [
        (name, set(of["estimates"]))
        for name, of in zip(names, dives, strict=True)
        if of["estimates"]
    ]
    for name, others in known[1:]:
        first, own = known[0]
        if not own & others:
            raise InputError(
                f"dive {first} has the thrusters {', '.join(sorted(own))}, and dive {name} "
                f"{', '.join(sorted(others))}; name the thrusters of one vehicle alike"
            )
