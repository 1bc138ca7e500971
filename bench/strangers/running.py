"""Runs the program on the campaign of a drawn vehicle."""

import json
import subprocess


def identify(program, folder):
    """Returns the results of ``folder/campaign.toml`` and an empty text, or None and the error."""
    out = folder / "results"
    run = subprocess.run(
        [program, "identify", folder / "campaign.toml", "--out", out, "--force", "--quiet"],
        capture_output=True,
        text=True,
    )
    if run.returncode:
        return None, run.stderr
    return json.loads((out / "results.json").read_text()), ""
