"""JavaScript as a widget ships it, run in Node on jobs that Python makes."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from labkit.interactive.explorer.scenes import Scene
from labkit.interactive.explorer.widget import scene_to_json
from labkit.interactive.front_end import bundle
from tests.tools import installed

PATIENCE = 240  # [s]


def run_explorer(
    scenes: Sequence[Scene], runs: Sequence[dict[str, Any]], folder: Path
) -> list[dict[str, Any]]:
    """Run the explorer's loop: one answer for each of the runs."""
    job = {"pairs": [scene_to_json(scene) for scene in scenes], "runs": list(runs)}
    answers: list[dict[str, Any]] = run_in_node(
        "agree.mjs", bundle("explorer/explorer.js"), job, folder
    )
    return answers


def run_in_node(program: str, module: str, job: object, folder: Path) -> Any:
    """Run a program beside this file, which imports the module and answers the job."""
    module_path = folder / "front_end.mjs"
    module_path.write_text(module, "utf-8")
    node = installed.program("nodejs", "node")
    program_path = Path(__file__).with_name(program)
    process = subprocess.run(
        [node, str(program_path), str(module_path)],
        input=json.dumps(job),
        capture_output=True,
        encoding="utf-8",
        timeout=PATIENCE,
        check=False,
    )
    assert process.returncode == 0, process.stderr[-2000:]
    return json.loads(process.stdout)
