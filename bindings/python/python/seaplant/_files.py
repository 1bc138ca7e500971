"""Writing of files all together, never over files that Seaplant did not write."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Mapping
from os import PathLike
from pathlib import Path, PurePath
from typing import Any, Literal, get_args

from seaplant import _native
from seaplant.errors import FileError, InputError, MissingFileError

_LIST = "seaplant-files.json"
"""The list of a folder's files that the command line keeps, too."""

_SCHEMA = "seaplant/files/1"

_LONGEST_SHOWN = 200
"""Characters of a path that an error shows."""

Made = Literal["campaign", "report", "export"]
"""What files are: those of a campaign go with all that was made of an earlier one, those of a
report with those of an earlier report."""


def write_files(
    folder: str | PathLike[str], files: Mapping[str, bytes], made: Made, *, force: bool = False
) -> Path:
    """Writes files below a folder: all to a temporary folder before one is moved into place.

    Raises `InputError` if one would replace a file that Seaplant did not write, unless
    ``force``, or would be written through a link, or if the folder's list names anything but
    regular files inside the folder.
    """
    target = Path(folder)
    listed = _listed(target)
    for path in files:
        _check(target, path, listed, force=force)
    target.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=".seaplant-", dir=target))
    try:
        for path, content in files.items():
            whole = aside / path
            whole.parent.mkdir(parents=True, exist_ok=True)
            whole.write_bytes(content)
        after = _after(listed, files, made)
        for path in set(listed) - set(after):
            if _is_as_written(target / path, listed.get(path)):
                (target / path).unlink()
        _write_list(target, aside, _beside(listed, after), complete=False)
        for path in files:
            (target / path).parent.mkdir(parents=True, exist_ok=True)
            (aside / path).replace(target / path)
        _write_list(target, aside, after, complete=True)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return target


def _listed(folder: Path) -> dict[str, Any]:
    """Returns the files in a folder's list; none if there is no list, or one of another schema.

    Raises `InputError` if an entry is anything but a relative path to a regular file inside the
    folder, reached through no link: no entry of such a list is used.
    """
    if not (folder / _LIST).is_file():
        return {}
    try:
        read = json.loads((folder / _LIST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    is_ours = isinstance(read, dict) and read.get("schema") == _SCHEMA
    listed = read.get("files") if is_ours else {}
    if not isinstance(listed, dict) or not all(map(_is_entry, listed.values())):
        return {}
    for path in listed:
        fault = _fault(folder, path)
        if fault:
            raise InputError(
                f"{folder / _LIST} lists `{path[:_LONGEST_SHOWN]}`, but {fault}; a list with "
                "such an entry is not used: remove it, or choose another folder"
            )
    return listed


def _is_entry(entry: object) -> bool:
    return (
        isinstance(entry, dict)
        and entry.get("made") in get_args(Made)
        and isinstance(entry.get("sha256"), str)
    )


def _fault(folder: Path, path: str) -> str | None:
    """Returns the fault of a path in a list; `None` if the path may be used."""
    plain = PurePath(path)
    if plain.anchor or ".." in plain.parts or plain.as_posix() != path:
        return "that is not a relative path inside the folder"
    on_the_way = (folder.joinpath(*plain.parts[: k + 1]) for k in range(len(plain.parts)))
    link = next((reached for reached in on_the_way if reached.is_symlink()), None)
    if link is not None:
        return f"{link} is a symbolic link"
    file = folder / path
    return f"{file} is not a regular file" if file.exists() and not file.is_file() else None


def _after(listed: Mapping[str, Any], files: Mapping[str, bytes], made: Made) -> dict[str, Any]:
    """Returns the list with the new files in place."""
    kept = {
        path: entry
        for path, entry in listed.items()
        if made == "export" or (made == "report" and entry["made"] != "report")
    }
    new = {
        path: {"made": made, "sha256": hashlib.sha256(content).hexdigest()}
        for path, content in files.items()
    }
    return dict(sorted({**kept, **new}.items()))


def _beside(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the list during the exchange, with the files before and after."""
    changed = {
        path: {**entry, "before": before[path]["sha256"]} if path in before else entry
        for path, entry in after.items()
    }
    return {**before, **changed}


def _check(folder: Path, path: str, listed: Mapping[str, Any], *, force: bool) -> None:
    target = folder / path
    for inner in [folder / part for part in Path(path).parents if part != Path()]:
        if inner.is_symlink():
            raise InputError(
                f"{inner} is a symbolic link, which may point elsewhere; remove it"
            )
    if target.is_dir():
        raise InputError(f"{target} is a folder where a file is needed; move it away")
    is_there = target.exists() or target.is_symlink()
    if is_there and not force and not _is_as_written(target, listed.get(path)):
        raise InputError(
            f"{target} exists and is not as Seaplant wrote it; choose another folder, or "
            "overwrite it with force=True"
        )


def _is_as_written(file: Path, entry: Any) -> bool:
    if entry is None or file.is_symlink() or not file.is_file():
        return False
    found = hashlib.sha256(file.read_bytes()).hexdigest()
    return found in {entry.get("sha256"), entry.get("before")}


def _write_list(folder: Path, aside: Path, files: Mapping[str, Any], *, complete: bool) -> None:
    whole = aside / _LIST
    made = {"schema": _SCHEMA, "complete": complete, "files": files}
    whole.write_text(json.dumps(made, indent=2) + "\n", encoding="utf-8")
    whole.replace(folder / _LIST)


def read_results(path: str | PathLike[str]) -> _native.Results:
    """Reads a results.json, or that of a folder, and names the file in every message."""
    given = Path(path)
    file = given / "results.json" if given.is_dir() else given
    try:
        return _native.Results.of_json(file.read_text(encoding="utf-8"))
    except (InputError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: {error}") from None
    except FileNotFoundError as error:
        raise MissingFileError(f"cannot read {file}: {error.strerror}") from None
    except OSError as error:
        raise FileError(f"cannot read {file}: {error.strerror}") from None
