"""Writes ``python/seaplant/_results.py`` from the JSON Schemas of the library.

The Rust types are the one place where results are described; this makes Python's dataclasses
of them, words included. Run it after a change of those types, with the package installed that
was built of them; ``scripts/python-package results`` does both.

A test checks that the module in the repository is what this writes.
"""

from __future__ import annotations

import json
import re
import textwrap
from pathlib import Path
from typing import Any

from seaplant import _native

KINDS = {
    "Results": "results",
    "AccumulatedPlant": "accumulated",
    "Validation": "validation",
    "Inspection": "inspection",
    "MonteCarloTable": "monte-carlo",
    "VehicleMonteCarloTable": "vehicle-monte-carlo",
    "Truth": "truth",
}
"""The schemas, by the name of the class of their root."""

PLAIN = {"TwinSpec", "VehicleTwinSpec"}
"""What stays a dict: Python writes it, too, and knows it by its keys."""

BASES = {"Parameter": "Estimated", "Coefficient": "Estimated"}
"""Classes with more than fields."""

TARGET = Path(__file__).parent / "python/seaplant/_results.py"

HEADER = '''"""The dataclasses of results; ``generate_results.py`` writes this."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from seaplant._record import Estimated, Floats, Record

'''


def definitions() -> dict[str, Any]:
    """Returns every definition of every schema, by name."""
    found: dict[str, Any] = {}
    for root, kind in KINDS.items():
        schema = json.loads(_native.schema(kind))
        found.update(schema.pop("$defs", {}))
        found[root] = schema
    return {name: found[name] for name in sorted(reachable(found))}


def reachable(found: dict[str, Any]) -> set[str]:
    """Returns the names that the roots need, without those that stay a dict."""
    known: set[str] = set()
    wait = list(KINDS)
    while wait:
        name = wait.pop()
        if name not in known and name not in PLAIN:
            known.add(name)
            wait += re.findall(r'"#/\$defs/(\w+)"', json.dumps(found[name]))
    return known


def words(text: str) -> str:
    """Returns the first paragraph of a description, without Rust's links."""
    first = text.split("\n\n")[0]
    first = re.sub(r"\[(`[^`]+`)\](\([^)]*\))?", r"\1", first)
    return " ".join(first.replace("`", "``").replace("\\", "").split())


def type_of(schema: dict[str, Any]) -> str:
    """Returns the annotation of a schema."""
    if "$ref" in schema:
        name: str = schema["$ref"].rsplit("/", 1)[1]
        return "dict[str, Any]" if name in PLAIN else name
    if "anyOf" in schema:
        (some,) = (of for of in schema["anyOf"] if of != {"type": "null"})
        return f"{type_of(some)} | None"
    kind = schema["type"]
    if isinstance(kind, list):
        (some,) = (of for of in kind if of != "null")
        return f"{type_of({**schema, 'type': some})} | None"
    if kind == "array":
        items = schema.get("items", {})
        return "Floats" if is_numbers(items) else f"tuple[{type_of(items)}, ...]"
    if kind == "object":
        # For keys that are numbers only the pattern is stated.
        (of,) = schema.get("patternProperties", {"": schema["additionalProperties"]}).values()
        return f"dict[str, {type_of(of)}]"
    return {"number": "float", "integer": "int", "string": "str", "boolean": "bool"}[kind]


def is_numbers(schema: dict[str, Any]) -> bool:
    """Returns whether a schema is that of a number, or of a list of numbers."""
    return schema.get("type") == "number" or (
        schema.get("type") == "array"
        and all(map(is_numbers, schema.get("prefixItems", [schema.get("items", {})])))
    )


def choice(name: str, schema: dict[str, Any]) -> str | None:
    """Returns the alias of a definition that is one of some words."""
    options = [of.get("const") for of in schema.get("oneOf", [])] or schema.get("enum", [])
    if not options or None in options:
        return None
    listed = "\n".join(f'    "{option}",' for option in options)
    return f"{name}: TypeAlias = Literal[\n{listed}\n]\n{doc(schema, '')}\n"


def doc(schema: dict[str, Any], indent: str) -> str:
    """Returns the text of a schema as a docstring."""
    text = f'"""{words(schema.get("description", "A number."))}"""'
    return textwrap.fill(text, 94, initial_indent=indent, subsequent_indent=indent)


def merged(schema: dict[str, Any]) -> dict[str, Any]:
    """Makes one class of variants that a ``kind`` distinguishes."""
    if "oneOf" not in schema:
        return schema
    variants = schema["oneOf"]
    kinds = [of["properties"]["kind"]["const"] for of in variants]
    properties: dict[str, Any] = {}
    for variant in variants:
        properties |= variant["properties"]
    for name, of in properties.items():
        if not all(name in variant["properties"] for variant in variants):
            of["variant"] = True
    properties["kind"] = {"description": f"One of {', '.join(kinds)}.", "type": "string"}
    required = [name for name in properties if all(name in of["required"] for of in variants)]
    return {**schema, "properties": properties, "required": required}


def record(name: str, schema: dict[str, Any]) -> str:
    """Returns the dataclass of a definition."""
    schema = merged(schema)
    required = schema.get("required", [])
    order = [*required, *(of for of in schema["properties"] if of not in required)]
    text = "@dataclass(frozen=True, eq=False, repr=False)\n"
    text += f"class {name}({BASES.get(name, 'Record')}):\n"
    text += doc(schema, "    ") + "\n"
    for field in order:
        of = schema["properties"][field]
        kind = type_of(of)
        if of.get("variant"):
            kind = f"{kind.removesuffix(' | None')} | None = None"
        text += f"\n    {field}: {kind}\n{doc(of, '    ')}\n"
    return text


def module() -> str:
    """Returns the text of the module."""
    found = definitions()
    aliases = {name: text for name in found if (text := choice(name, found[name]))}
    records = {name: record(name, of) for name, of in found.items() if name not in aliases}
    names = "".join(f'    "{name}",\n' for name in sorted(found))
    parts = [*aliases.values(), *(f"\n{text}" for text in records.values())]
    return HEADER + f"__all__ = [\n{names}]\n\n" + "\n".join(parts)


if __name__ == "__main__":
    TARGET.write_text(module(), encoding="utf-8")
