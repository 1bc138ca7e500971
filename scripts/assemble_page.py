"""Assembles the page: one file that contains its style, its scripts and the program.

python3 scripts/assemble_page.py PROGRAM OUT
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import lzma
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WEB = ROOT / "web"
REPORT = ROOT / "crates" / "seaplant-report"
# What the page runs, and what runs in its worker.
SCRIPTS = ["toml.js", "zip.js", "drawing.js", "page.js"]
WORKER = ["lzma.js", "system.js", "worker.js"]
# What reports and charts run, which the policy of the page holds for, too.
SHOWN = ["vendor/uplot/uPlot.iife.min.js", "templates/report.js", "templates/marks.js"]


def joined(names: list[str]) -> str:
    text = "\n".join((WEB / name).read_text(encoding="utf-8") for name in names)
    if "</script" in text.lower():
        raise SystemExit("assemble_page: a script holds the end of its element")
    return text


def source(script: str) -> str:
    digest = hashlib.sha256(script.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def policy(script: str) -> str:
    shown = [(REPORT / name).read_text(encoding="utf-8") for name in SHOWN]
    scripts = " ".join(source(text) for text in [script, *shown])
    return (
        f"default-src 'none'; script-src {scripts} 'wasm-unsafe-eval'; worker-src blob:; "
        "style-src 'unsafe-inline'; img-src data:; connect-src 'none'; base-uri 'none'; "
        "form-action 'none'"
    )


def packed(program: bytes) -> bytes:
    """LZMA, a third less than gzip; servers cannot make that up, for base64 hides what repeats."""
    coder = {
        "id": lzma.FILTER_LZMA1,
        "preset": 7,
        "dict_size": 1 << 25,
        "lc": 3,
        "lp": 0,
        "pb": 0,
    }
    made = lzma.compress(program, format=lzma.FORMAT_ALONE, filters=[coder])
    # The header's number of bytes, which Python leaves open.
    return made[:5] + len(program).to_bytes(8, "little") + made[13:]


def version() -> str:
    manifest = (ROOT / "Cargo.toml").read_text(encoding="utf-8")
    return re.search(r'^version = "(.+)"', manifest, re.MULTILINE).group(1)


def main(program: Path, out: Path) -> None:
    script = joined(SCRIPTS)
    style = (REPORT / "templates" / "report.css").read_text(encoding="utf-8")
    values = {
        "policy": policy(script),
        "style": style + (WEB / "page.css").read_text(encoding="utf-8"),
        "script": script,
        "worker": joined(WORKER),
        "program": base64.b64encode(packed(program.read_bytes())).decode(),
        "version": version(),
    }
    page = (WEB / "index.html").read_text(encoding="utf-8")
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: values[match.group(1)], page)
    out.mkdir(parents=True, exist_ok=True)
    target = out / "index.html"
    target.write_text(page, encoding="utf-8")
    sent = len(gzip.compress(target.read_bytes(), compresslevel=6))
    print(f"{target}: {target.stat().st_size / 1e6:.2f} MB, {sent / 1e6:.2f} MB by gzip")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
