"""What labkit answers to a case: the port that all others are held to."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from labkit import IcpParameters, align, from_xytheta, icp, to_xytheta
from labkit.odometry import integrate
from labkit.support.errors import DegenerateAlignmentError

Parameters = dict[str, float | None]
Content = list[list[float]] | Parameters
Files = Mapping[str, Content]


def read_files(folder: Path, commands: Iterable[list[str]]) -> dict[str, Content]:
    """The content of every file that a command names, by its path relative to `folder`."""
    paths = {word for command in commands for word in command if word.startswith("data/")}
    return {path: _read(folder / path) for path in paths}


def _read(path: Path) -> Content:
    """A table, or a dict of parameters."""
    if path.suffix == ".json":
        parameters: Parameters = json.loads(path.read_text())
        return parameters
    return [list(map(float, line.split(","))) for line in path.read_text().splitlines()]


def answer(command: list[str], files: Files) -> dict[str, Any]:
    """The answer to one command, as JSON has it."""
    verb, path, *others = command
    if verb == "match":
        return _match(*(files[each] for each in (path, *others)))
    rows = np.array(files[path])
    if verb == "integrate":
        return {"poses": integrate(rows, list(map(float, others))).tolist()}
    try:
        return _pose(align(rows[:, :2], rows[:, 2:4], rows[:, 4] if rows.shape[1] == 5 else None))
    except DegenerateAlignmentError:
        return {"error": "degenerate"}  # a port may go on: "degenerate: …"


def _match(target: Any, source: Any, parameters: Any) -> dict[str, Any]:
    told = {key: math.inf if value is None else value for key, value in parameters.items()}
    guess = [told.pop(f"initial_{axis}", 0.0) for axis in ("x", "y", "theta")]
    result = icp(source, target, from_xytheta(guess), IcpParameters(**told))
    return {
        **_pose(result.T_target_source),
        "termination": result.termination.name.lower(),
        "iterations": result.iterations,
        "inlier_count": result.inlier_count,
        "fitness": result.fitness,
        "inlier_rmse": _number(result.inlier_rmse),
        "cost": result.cost,
    }


def _pose(T: Any) -> dict[str, float | None]:
    return dict(zip(("x", "y", "theta"), map(_number, to_xytheta(T).tolist()), strict=True))


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
