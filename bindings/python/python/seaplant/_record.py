"""Base class of the dataclasses of results: reading from JSON, comparison, display."""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from seaplant import _native
from seaplant._named import Named

Floats = NDArray[np.float64]
"""Numbers of shape (n,) or (n, m)."""

_R = TypeVar("_R", bound="Record")


class Record(Named):
    """A plain record of results; a dataclass that keeps the JSON it was read from."""

    @classmethod
    def from_dict(cls: type[_R], data: Mapping[str, Any]) -> _R:
        """Makes a record from parsed JSON.

        Parameters
        ----------
        data
            What ``json.loads`` gives.

        Returns
        -------
        Record
            The record; what the JSON lacks and may lack is ``None``.
        """
        made: _R = _decode(cls, data)
        return made

    def to_dict(self) -> dict[str, Any]:
        """Returns the record as in JSON.

        Returns
        -------
        dict
            Dicts, lists, strings and numbers only.
        """
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        values = ((field, getattr(self, field.name)) for field in fields)
        # A field with a default belongs to only some kinds of the record.
        return {
            field.name: _plain(value)
            for field, value in values
            if not (value is None and field.default is None)
        }

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        assert isinstance(other, Record)
        return self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(repr(self))

    def __repr__(self) -> str:
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        said = (f"{field.name}={_short(getattr(self, field.name))}" for field in fields)
        return f"{type(self).__name__}({', '.join(said)})"


class Estimated(Record):
    """A number with its 95 % interval."""

    value: float
    std: float
    low95: float
    high95: float
    unit: str

    @property
    def interval95(self) -> tuple[float, float]:
        """Lower and upper end of the 95 % interval."""
        return self.low95, self.high95

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        value, std, low95, high95 = _native.rounded(
            self.value, self.std, self.low95, self.high95
        )
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{value}{unit} ± {std} [{low95}, {high95}]"

    def __repr__(self) -> str:
        return f"<{self}>"


def _short(value: object) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(str(key) for key in value) + "}"
    if isinstance(value, np.ndarray):
        return f"array{value.shape}"
    if isinstance(value, Sequence) and not isinstance(value, str) and len(value) > 4:
        return f"({len(value)} of them)"
    return repr(value)


def _plain(value: object) -> Any:
    if isinstance(value, Record):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: _plain(of) for key, of in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(of) for of in value]
    return value


def _decode(kind: Any, data: Any) -> Any:
    return _decoder(kind)(data)


@functools.cache
def _decoder(kind: Hashable) -> Callable[[Any], Any]:
    """Returns the function that makes an object of type ``kind`` from parsed JSON."""
    if dataclasses.is_dataclass(kind):
        return _record_decoder(kind)
    if kind == Floats:
        return functools.partial(np.asarray, dtype=np.float64)
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (types.UnionType, typing.Union):
        (inner,) = (_decoder(of) for of in arguments if of is not types.NoneType)
        return lambda value: None if value is None else inner(value)
    if origin is tuple:
        inner = _decoder(arguments[0])
        return lambda value: tuple(inner(of) for of in value)
    if origin is dict:
        inner = _decoder(arguments[1])
        return lambda value: {key: inner(of) for key, of in value.items()}
    return lambda value: value


def _record_decoder(kind: Any) -> Callable[[Any], Any]:
    hints = typing.get_type_hints(kind)
    fields = [(field.name, _decoder(hints[field.name])) for field in dataclasses.fields(kind)]
    empty = {
        name: () if typing.get_origin(hints[name]) is tuple else None for name, _ in fields
    }

    def decode(data: Any) -> Any:
        found = {
            name: decode(data[name]) if name in data else empty[name] for name, decode in fields
        }
        return kind(**found)

    return decode
