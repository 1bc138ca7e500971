"""Conversions of a user's choices for an identification to the library's form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from seaplant.errors import InputError

_T = TypeVar("_T")

Methods = str | Sequence[str] | None
"""A method, several, "all", or those that are usual."""

Terms = str | Sequence[str] | None
"""Terms in a list, or parted by commas; or those that are usual."""

Settings = Mapping[str, Any] | None
"""The keys of a table of campaign.toml."""


def methods_of(method: Methods) -> list[str]:
    """Returns the methods as a list; empty for the default ones."""
    if method is None:
        return []
    return [method] if isinstance(method, str) else list(method)


def terms_of(terms: str | Sequence[str]) -> list[str]:
    """Returns the terms as a list."""
    listed = terms.split(",") if isinstance(terms, str) else terms
    return [term.strip() for term in listed]


def expected(kind: type[_T], given: object, what: str, how: str) -> _T:
    """Returns an argument if it is of a type; ``how`` tells how to make one of that type."""
    if isinstance(given, kind):
        return given
    found = type(given).__name__
    raise InputError(f"{what} must be a {kind.__name__}, found {found}; {how}")
