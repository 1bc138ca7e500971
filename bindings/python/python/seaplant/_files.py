"""Files that appear together."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from os import PathLike
from pathlib import Path


def write_files(folder: str | PathLike[str], files: Mapping[str, bytes]) -> Path:
    """Writes files below a folder: all are made aside before one is moved into place."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=".seaplant-", dir=target))
    try:
        for path, content in files.items():
            made = aside / path
            made.parent.mkdir(parents=True, exist_ok=True)
            made.write_bytes(content)
        for path in files:
            (target / path).parent.mkdir(parents=True, exist_ok=True)
            (aside / path).replace(target / path)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return target
