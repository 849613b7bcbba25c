"""The explorer's JavaScript in Node: what it answers to parameter sets given in Python."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import installed

from labkit.interactive.explorer.scenes import Scene
from labkit.interactive.explorer.widget import scene_to_json
from labkit.interactive.front_end import bundle


def answers(
    scenes: Sequence[Scene], runs: Sequence[dict[str, Any]], folder: Path
) -> list[dict[str, Any]]:
    """What the front end, as the widget ships it, makes of each run."""
    job = {"pairs": [scene_to_json(scene) for scene in scenes], "runs": list(runs)}
    found: list[dict[str, Any]] = told_by("agree.mjs", bundle("explorer/explorer.js"), job, folder)
    return found


def told_by(program: str, module: str, job: object, folder: Path) -> Any:
    """What a program beside this file tells about a job; it imports the module."""
    written = folder / "front_end.mjs"
    written.write_text(module, "utf-8")
    node = installed.program("nodejs", "node")
    command = [node, str(Path(__file__).with_name(program)), str(written)]
    done = subprocess.run(
        command,
        input=json.dumps(job),
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)
