"""Answers of labkit to the cases: the port that all others are held to."""

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

XYTHETA = ("x", "y", "theta")
Parameters = dict[str, float | None]
Content = list[list[float]] | Parameters
Files = Mapping[str, Content]


def read_files(folder: Path, commands: Iterable[list[str]]) -> dict[str, Content]:
    """Read every file that a command names: contents by the path relative to `folder`."""
    paths = {word for command in commands for word in command if word.startswith("data/")}
    return {path: _read(folder / path) for path in paths}


def _read(path: Path) -> Content:
    """Read a table, or a dict of parameters."""
    if path.suffix == ".json":
        parameters: Parameters = json.loads(path.read_text())
        return parameters
    return [list(map(float, line.split(","))) for line in path.read_text().splitlines()]


def answer(command: list[str], files: Files) -> dict[str, Any]:
    """Answer one command, in numbers and words of JSON."""
    verb, path, *arguments = command
    if verb == "match":
        target, source, parameters = (files[name] for name in (path, *arguments))
        return _match(target, source, parameters)
    rows = np.array(files[path])
    if verb == "integrate":
        return {"poses": integrate(rows, list(map(float, arguments))).tolist()}
    weights = rows[:, 4] if rows.shape[1] == 5 else None
    try:
        return _pose(align(rows[:, :2], rows[:, 2:4], weights))
    except DegenerateAlignmentError:
        return {"error": "degenerate"}  # a port may go on: "degenerate: …"


def _match(target: Any, source: Any, parameters: Any) -> dict[str, Any]:
    values = {key: math.inf if value is None else value for key, value in parameters.items()}
    guess = [values.pop(f"initial_{axis}", 0.0) for axis in XYTHETA]
    result = icp(source, target, from_xytheta(guess), IcpParameters(**values))
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
    return dict(zip(XYTHETA, map(_number, to_xytheta(T).tolist()), strict=True))


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
