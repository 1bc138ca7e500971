"""Equation error over a log in shards: larger than memory, or split over workers."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from seaplant import _native
from seaplant._choices import Settings, Terms, terms_of
from seaplant._named import Named
from seaplant._results import AccumulatedPlant
from seaplant.errors import InputError
from seaplant.trials import Trial, only

__all__ = ["ShardClock", "Shards", "accumulate"]


@dataclass(frozen=True)
class ShardClock:
    """Clock common to all shards of a record.

    Row k of the regression is at ``start_s + k / sample_hz``.

    Attributes
    ----------
    record
        What the record is called; shards of several records may be put together.
    start_s
        The first instant of the record, in the time of its log, s.
    sample_hz
        The rate of the regression's rows, Hz: that at which motion or force was logged,
        whichever is faster.
    source_hz
        The rate at which motion was logged, Hz.
    """

    record: str
    start_s: float
    sample_hz: float
    source_hz: float

    @classmethod
    def of(cls, trial: Trial, dof: str | None = None) -> ShardClock:
        """Determines the clock from a trial that begins where the record begins.

        Parameters
        ----------
        trial
            The record in one piece, or its first shard.
        dof
            The degree of freedom, if the trial exercises several.

        Returns
        -------
        ShardClock
            Its clock.

        Raises
        ------
        InputError
            If the trial is too short.
        """
        dof = only(trial.dofs, dof, "the trial")
        return cls(**json.loads(_native.shard_clock(trial._native, dof)))

    def margin_s(self, equation_error: Settings = None) -> float:
        """Returns how much of its neighbours a shard needs on either side.

        Parameters
        ----------
        equation_error
            Settings of equation error; see `seaplant.identify`.

        Returns
        -------
        float
            Seconds in which the filters forget where the record was cut.
        """
        return _native.shard_margin_s(
            json.dumps(asdict(self)), json.dumps(equation_error or {})
        )


class Shards(Named):
    """Sufficient statistics of shards for one degree of freedom; made by `Shards.of`.

    They add up, in any order, to what the record says in one piece: ``one + other`` has the
    rows of both, as triangles of their QR decompositions. They travel between processes.

    Parameters
    ----------
    native
        The sums as the library holds them.
    """

    def __init__(self, native: _native.Shards, /) -> None:
        self._native = native

    @classmethod
    def of(
        cls,
        trial: Trial,
        clock: ShardClock,
        *,
        from_s: float | None = None,
        to_s: float | None = None,
        dof: str | None = None,
        terms: Terms = None,
        equation_error: Settings = None,
    ) -> Shards:
        """Reduces the rows of a shard to statistics.

        Parameters
        ----------
        trial
            The shard, with `ShardClock.margin_s` more on either side, where the record has it.
        clock
            The clock of the record.
        from_s
            The first row is at this time of the log or later; the record's start if not given.
        to_s
            The last row is before this time of the log; the record's end if not given.
        dof
            The degree of freedom, if the trial exercises several.
        terms
            The terms to fit; force, quadratic and bias if not given.
        equation_error
            Settings of equation error; see `seaplant.identify`.

        Returns
        -------
        Shards
            What its rows say.

        Raises
        ------
        InputError
            If the shard lacks its margin.
        """
        dof = only(trial.dofs, dof, "the trial")
        chosen = None if terms is None else ",".join(terms_of(terms))
        settings = json.dumps(equation_error or {})
        made_of = json.dumps(asdict(clock))
        native = _native.Shards.of(trial._native, dof, made_of, chosen, settings, from_s, to_s)
        return cls(native)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self._native.rows

    def __add__(self, other: Shards) -> Shards:
        return Shards(self._native.merged(other._native))

    def plant(self) -> AccumulatedPlant:
        """Fits the plant to all rows, by equation error.

        Returns
        -------
        AccumulatedPlant
            Parameters with their intervals by batch means.

        Raises
        ------
        InputError
            If the rows do not determine each term.
        """
        return AccumulatedPlant.from_dict(json.loads(self._native.plant()))

    def __repr__(self) -> str:
        return f"<Shards of {self.rows} rows>"

    def __reduce__(self) -> tuple[Any, ...]:
        return _of_json, (self._native.to_json(),)


def _of_json(text: str) -> Shards:
    return Shards(_native.Shards.of_json(text))


def accumulate(shards: Iterable[Shards]) -> Shards:
    """Adds shards, in any order; one at a time is in memory.

    Parameters
    ----------
    shards
        At least one.

    Returns
    -------
    Shards
        What all of them say.

    Raises
    ------
    InputError
        If there is none, two have the same rows, or they were not reduced alike.

    Examples
    --------
    >>> import seaplant as sp
    >>> dive = sp.twin(dofs=["surge"], duration_s=240)
    >>> record = dive.trials[0]
    >>> clock = sp.ShardClock.of(record)
    >>> halves = [
    ...     sp.Shards.of(record, clock, to_s=120),
    ...     sp.Shards.of(record, clock, from_s=120),
    ... ]
    >>> sp.accumulate(halves).rows == sp.Shards.of(record, clock).rows
    True
    """
    total: Shards | None = None
    for shard in shards:
        total = shard if total is None else total + shard
    if total is None:
        raise InputError("there is no shard; give at least one")
    return total
