"""Error messages for absent attributes, which list the existing ones."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from seaplant.errors import InputError


class Named:
    """A base class whose errors for absent attributes list the existing ones."""

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            # Python itself looks up names with underscores, and expects a plain error.
            if name.startswith("_"):
                raise AttributeError(name)
            # A property that failed has an error of its own.
            if hasattr(type(self), name):
                return object.__getattribute__(self, name)
            raise _NoAttributeError(_answer(self, name))

    def _item(self, name: str) -> str | None:
        """Returns the alternative to an attribute: ``["surge"]``."""
        return next((hint for hint in map(_within(name), vars(self).items()) if hint), None)


class _NoAttributeError(InputError, AttributeError):
    """An absent attribute."""


def _within(name: str) -> Any:
    def hint(part: tuple[str, object]) -> str | None:
        key, value = part
        if key.startswith("_"):
            return None
        if isinstance(value, Mapping):
            if name in value:
                return f".{key}[{name!r}]"
            has = (of for of, inner in value.items() if name in getattr(inner, "__dict__", {}))
            return next((f".{key}[{of!r}].{name}" for of in has), None)
        return f".{key}.{name}" if name in getattr(value, "__dict__", {}) else None

    return hint


def _answer(of: Named, name: str) -> str:
    kind = type(of).__name__
    public = [key for key in {*dir(type(of)), *vars(of)} if not key.startswith("_")]
    hint = of._item(name)
    if hint is None:
        near = difflib.get_close_matches(name, public, 1)
        hint = f".{near[0]}" if near else None
    meant = f"; did you mean {hint}?" if hint else ";"
    return f"{kind} has no `{name}`{meant} it has {', '.join(sorted(public))}"
