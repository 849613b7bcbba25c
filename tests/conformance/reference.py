"""What labkit answers to a case: the port that all others are held to."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cases import Content
from labkit import IcpParameters, IcpResult, align, from_xytheta, icp, to_xytheta
from labkit.errors import DegenerateAlignmentError
from labkit.odometry import integrate

Files = Mapping[str, Content]


def read_files(folder: Path, commands: Iterable[list[str]]) -> dict[str, Content]:
    """The content of every file that a command names, by its path relative to `folder`."""
    paths = {word for command in commands for word in command if word.startswith("data/")}
    return {path: read_content(path, (folder / path).read_text()) for path in paths}


def read_content(path: str, text: str) -> Content:
    """A table, or a dict of parameters, from a file's text."""
    if path.endswith(".json"):
        parameters: dict[str, float | None] = json.loads(text)
        return parameters
    return [list(map(float, line.split(","))) for line in text.splitlines()]


def answer(command: list[str], files: Files) -> dict[str, Any]:
    """The answer to one command, as JSON has it."""
    verb, *arguments = command
    if verb == "match":
        return _match(run(command, files))
    return {"align": _align, "integrate": _integrate}[verb](files, *arguments)


def run(command: list[str], files: Files) -> IcpResult:
    """The ICP run of a ``match`` command, with its history."""
    target, source, parameters = (files[path] for path in command[1:])
    told = {key: math.inf if value is None else value for key, value in dict(parameters).items()}
    guess = [told.pop(f"initial_{axis}", 0.0) for axis in ("x", "y", "theta")]
    return icp(source, target, from_xytheta(guess), IcpParameters(**told))


def pairs(files: Files, path: str) -> tuple[Any, Any, Any]:
    """(p, q, w) of a file of pairs; w is None where it has four columns."""
    rows = np.array(files[path])
    return rows[:, :2], rows[:, 2:4], rows[:, 4] if rows.shape[1] == 5 else None


def _match(result: IcpResult) -> dict[str, Any]:
    return {
        **_pose(result.T_target_source),
        "termination": result.termination.name.lower(),
        "iterations": result.iterations,
        "inlier_count": result.inlier_count,
        "fitness": result.fitness,
        "inlier_rmse": _number(result.inlier_rmse),
        "cost": result.cost,
    }


def _align(files: Files, path: str) -> dict[str, Any]:
    try:
        return _pose(align(*pairs(files, path)))
    except DegenerateAlignmentError:
        return {"error": "degenerate"}  # a port may go on: "degenerate: …"


def _integrate(files: Files, path: str, *start: str) -> dict[str, Any]:
    return {"poses": integrate(files[path], list(map(float, start))).tolist()}


def _pose(T: Any) -> dict[str, float | None]:
    return dict(zip(("x", "y", "theta"), map(_number, to_xytheta(T).tolist()), strict=True))


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
