"""Identification of many dives."""

from __future__ import annotations

import concurrent.futures
import os
import sys
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from seaplant._choices import Methods, Terms
from seaplant.errors import InputError, MissingFileError
from seaplant.fleet._dives import (
    COLUMNS,
    Dive,
    Order,
    Row,
    failure,
    listed,
    now,
    reason_of,
    work,
)
from seaplant.fleet._store import PLANTS, Store, is_fresh
from seaplant.fleet._summary import Summary, summarise
from seaplant.fleet._thrusters import followed

if TYPE_CHECKING:
    import pandas as pd

_PAUSE_S = 2.0
"""Before a file that the system refused is asked for again."""


class Fleet:
    """Results of identifying many dives.

    Parameters
    ----------
    rows
        A row for each plant, and for each failure.
    path
        The Parquet file that holds them.
    """

    def __init__(self, rows: Sequence[Row], path: Path) -> None:
        self._rows = list(rows)
        self.path = path

    @classmethod
    def open(cls, folder: str | PathLike[str]) -> Fleet:
        """Reads a fleet that was identified before, or the part that is done.

        Parameters
        ----------
        folder
            Its folder.

        Returns
        -------
        Fleet
            Its rows.

        Raises
        ------
        MissingFileError
            If the folder holds no fleet.
        """
        store = Store(Path(folder))
        rows = [row for of in store.known().values() for row in of]
        if not rows:
            raise MissingFileError(f"{folder} holds no fleet; give the out= of one")
        return cls(sorted(rows, key=_order), store.folder / PLANTS)

    def to_pandas(self) -> pd.DataFrame:
        """Returns every row.

        Returns
        -------
        pandas.DataFrame
            A row for each plant, and one with ``status`` "failed" and a ``reason`` for each
            dive, or degree of freedom of one, without a plant.
        """
        import pandas as pd

        return pd.DataFrame(self._rows, columns=list(COLUMNS))

    @property
    def failures(self) -> pd.DataFrame:
        """The dives, or degrees of freedom of dives, without a plant, with reasons."""
        frame = self.to_pandas()
        failed = frame[frame["status"] == "failed"]
        return failed[["dive", "dof", "reason", "campaign"]]

    def summary(self) -> Summary:
        """Analyses parameters over dives: drift with date and payload, scatter, outliers.

        Returns
        -------
        Summary
            A trend for each degree of freedom and parameter.
        """
        return summarise(self.to_pandas())

    def thrusters(self) -> pd.DataFrame:
        """Follows each thruster over the dives: by date if all have one, or in their order.

        Returns
        -------
        pandas.DataFrame
            A row for each dive and thruster: what it gives over what its curve says, ``gain``
            with ``gain_std``, ``gain_low95`` and ``gain_high95``; ``change``, the cause of a
            change that this dive shows first (``loss``, ``more``, ``stands-still``,
            ``reversed``, ``direction-wrong``, ``exchanged``), and ``message``, in words.

        Raises
        ------
        InputError
            If the dives are of several vehicles, or their thrusters have other names.
        """
        return followed(self.to_pandas())

    def report(self, path: str | PathLike[str] | None = None) -> Path:
        """Writes the summary as one HTML file with figures.

        Parameters
        ----------
        path
            Where; ``summary.html`` beside the Parquet file if not given.

        Returns
        -------
        pathlib.Path
            The file.
        """
        from seaplant.fleet import _report

        target = Path(path) if path is not None else self.path.with_name("summary.html")
        target.write_text(_report.page(self.to_pandas(), self.summary()), encoding="utf-8")
        return target

    def __len__(self) -> int:
        return len(self._rows)

    def __repr__(self) -> str:
        dives = {row["key"] for row in self._rows}
        failed = sum(row["status"] == "failed" for row in self._rows)
        return f"<Fleet of {len(dives)} dives: {len(self) - failed} plants, {failed} failures>"

    def _repr_html_(self) -> str:
        return str(self.to_pandas().to_html(max_rows=20))


def _order(row: Row) -> tuple[str, str]:
    return row["campaign"], row["dof"] or ""


def identify(
    campaigns: Sequence[Dive | str | PathLike[str]],
    client: Any = None,
    *,
    out: str | PathLike[str] = "fleet",
    method: Methods = None,
    terms: Terms = None,
    workers: int | None = None,
    retries: int = 2,
    resume: bool = True,
    progress: bool = True,
) -> Fleet:
    """Identifies many dives, on the cores of this machine or on a Dask cluster.

    Every dive's rows are on disk as soon as they are there. A run that was stopped goes on
    where it was when it is started again; a worker that dies has its dives done by others; a
    dive that fails becomes a row with the reason.

    Parameters
    ----------
    campaigns
        Paths of campaign.toml files, or `Dive` objects that add a date and a payload.
    client
        A ``distributed.Client``, whose workers must see the campaigns' files; the cores of
        this machine if not given.
    out
        The folder of results; ``plants.parquet`` in it has one row a plant.
    method
        The methods, as of `seaplant.identify`; the first gives the rows.
    terms
        The terms to fit, in place of the campaigns'.
    workers
        How many dives to work on side by side without a client; as many as there are cores if
        not given.
    retries
        How often a dive is tried again if the system refuses a file or its worker dies.
    resume
        Whether dives that are in ``out`` already are kept; those that failed, and those whose
        files, method, terms or version of Seaplant have changed, are done again.
    progress
        Whether to show a bar where standard error is a terminal and tqdm is installed.

    Returns
    -------
    Fleet
        A row for each plant, in the order of the dives.

    Raises
    ------
    InputError
        If there is no campaign, or one is given twice.
    """
    methods = [method] if isinstance(method, str) else method
    order = Order(methods, terms, max(retries, 0), _PAUSE_S)
    dives = listed(campaigns, order)
    if not dives:
        raise InputError("there is no campaign; give at least one")
    store = Store(Path(out))
    done = {key: rows for key, rows in store.known().items() if resume and is_fresh(rows)}
    todo = [dive for dive in dives if dive["key"] not in done]
    if client is None:
        found = _on_this_machine(todo, order, workers or os.cpu_count() or 1)
    else:
        found = _on_a_cluster(todo, order, client)
    with _Bar(len(todo), show=progress) as bar:
        for rows in found:
            store.put(rows)
            done[rows[0]["key"]] = rows
            bar.update(rows)
    # A campaign's date or payload may have been set after it was identified.
    rows = [{**row, **dive} for dive in dives for row in done[dive["key"]]]
    return Fleet(rows, store.finish(rows))


def _on_this_machine(dives: list[Row], order: Order, workers: int) -> Iterator[list[Row]]:
    # The library works without Python's lock, so threads use all cores.
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        futures = [pool.submit(work, dive, order) for dive in dives]
        try:
            for future in concurrent.futures.as_completed(futures):
                yield future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _on_a_cluster(dives: list[Row], order: Order, client: Any) -> Iterator[list[Row]]:
    from distributed import as_completed

    def submit(dive: Row) -> Any:
        future = client.submit(work, dive, order, pure=False, retries=order.retries)
        waiting[future] = dive
        return future

    waiting: dict[Any, Row] = {}
    left = {dive["key"]: order.retries for dive in dives}
    futures = as_completed([submit(dive) for dive in dives])
    for future in futures:
        dive = waiting.pop(future)
        # A dive's own errors are rows; an exception here is its worker's.
        error = future.exception() if future.status != "cancelled" else None
        if future.status == "finished":
            yield future.result()
        elif left[dive["key"]] > 0:
            left[dive["key"]] -= 1
            futures.add(submit(dive))
        else:
            reason = "its task was cancelled" if error is None else reason_of(error)
            yield [_lost(dive, reason, order.retries + 1)]
        future.release()


def _lost(dive: Row, reason: str, attempts: int) -> Row:
    lost = failure(dive, f"its workers did not live to tell: {reason}")
    return {**lost, "attempts": attempts, "started": now()}


class _Bar:
    """A progress bar, if output is visible."""

    def __init__(self, total: int, *, show: bool) -> None:
        self._bar: Any = None
        self._failed = 0
        if show and total > 0 and sys.stderr.isatty():
            try:
                from tqdm.auto import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=total, unit="dive")

    def update(self, rows: list[Row]) -> None:
        self._failed += any(row["status"] == "failed" for row in rows)
        if self._bar is not None:
            self._bar.update(1)
            self._bar.set_postfix(failed=self._failed)

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
