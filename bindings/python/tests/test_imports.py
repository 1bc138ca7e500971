"""Imports between modules of the package form no cycle, including late imports and those for
types."""

import ast
import graphlib
import pkgutil
from collections.abc import Iterator
from importlib.util import find_spec, resolve_name
from pathlib import Path

import pytest
import seaplant as sp


def imported(module: str, is_package: bool, source: str, known: set[str]) -> Iterator[str]:
    """Returns the modules among ``known`` that the source of one imports, also inside
    functions."""
    package = module if is_package else module.rpartition(".")[0]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [(of.name, None) for of in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = resolve_name("." * node.level + (node.module or ""), package)
            names = [(f"{base}.{of.name}", base) for of in node.names]
        else:
            continue
        for name, holder in names:
            found = next((of for of in (name, holder) if of in known), None)
            if found is not None:
                yield found


def modules() -> dict[str, Path]:
    """Returns the package's modules of Python source, by name."""
    below = pkgutil.walk_packages(sp.__path__, "seaplant.")
    names = ["seaplant", *(of.name for of in below)]
    files = {name: find_spec(name).origin for name in names}
    return {name: Path(file) for name, file in files.items() if file.endswith(".py")}


def graph() -> dict[str, set[str]]:
    files = modules()
    # Of the native half, which imports none of them, there is no source here.
    known = {*files, "seaplant._native"}
    return {
        name: set(imported(name, file.stem == "__init__", file.read_text("utf-8"), known))
        for name, file in files.items()
    }


def test_no_module_imports_one_that_imports_it():
    arrows = graph()
    assert {"seaplant._native", "seaplant.errors"} < arrows["seaplant.fits"]
    try:
        graphlib.TopologicalSorter(arrows).prepare()
    except graphlib.CycleError as error:
        pytest.fail(f"a circle of imports: {' <- '.join(error.args[1])}")


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("from seaplant.a import Name", {"seaplant.a"}),
        ("from seaplant import a, Name", {"seaplant.a", "seaplant"}),
        ("import numpy, seaplant.a", {"seaplant.a"}),
        ("from .a import Name", {"seaplant.a"}),
        ("from . import a", {"seaplant.a"}),
        ("def f():\n    from seaplant.a import Name", {"seaplant.a"}),
        ("if TYPE_CHECKING:\n    from seaplant import a", {"seaplant.a"}),
        ("import json", set()),
    ],
)
def test_imports_are_read_from_source(source, expected):
    known = {"seaplant", "seaplant.a", "seaplant.b"}
    assert set(imported("seaplant.b", False, source, known)) == expected
