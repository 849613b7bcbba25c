"""Whether an answer is the expected one, and if not, why not."""

from __future__ import annotations

import math
from typing import Any

TOLERANCE = 1e-9  # metres, radians, m², and the pure number of fitness


def disagreement(answer: Any, expected: dict[str, Any], tolerance: float = TOLERANCE) -> str | None:
    """Why `answer` is not `expected`; None where it is.

    Numbers may be apart by `tolerance`, an angle by as much across the cut at ±π, and an
    angle must lie in (−π, π]. Counts, words and nulls are exact. An expected error is the
    beginning of the one that is given.
    """
    if not isinstance(answer, dict):
        return f"{answer!r} is no JSON object"
    if "error" in expected:
        given = answer.get("error")
        if isinstance(given, str) and given.startswith(expected["error"]):
            return None
        return f"the error {expected['error']!r} was expected, got {answer}"
    if answer.keys() != expected.keys():
        return f"the keys {sorted(expected)} were expected, got {answer}"
    if "poses" in expected:
        return _poses(answer["poses"], expected["poses"], tolerance)
    reasons = (_value(key, answer[key], expected[key], tolerance) for key in expected)
    return next(filter(None, reasons), None)


def _poses(answer: Any, expected: list[list[float]], tolerance: float) -> str | None:
    if not isinstance(answer, list) or len(answer) != len(expected):
        return f"{len(expected)} poses were expected, got {answer!r:.60}"
    for number, (pose, wanted) in enumerate(zip(answer, expected, strict=True)):
        if not isinstance(pose, list) or len(pose) != 3:
            return f"pose {number} must have three numbers, got {pose!r:.60}"
        for key, given, value in zip(("x", "y", "theta"), pose, wanted, strict=True):
            if reason := _value(key, given, value, tolerance):
                return f"pose {number}: {reason}"
    return None


def _value(key: str, answer: Any, expected: Any, tolerance: float) -> str | None:
    if not isinstance(expected, float):
        exact = type(answer) is type(expected) and answer == expected
        return None if exact else f"{key} = {expected!r} was expected, got {answer!r}"
    if isinstance(answer, bool) or not isinstance(answer, (int, float)):
        return f"{key} = {expected!r} was expected, got {answer!r}"
    apart = answer - expected
    if key == "theta":
        if not -math.pi < answer <= math.pi:
            return f"theta must lie in (−π, π], got {answer!r}"
        apart = math.remainder(apart, 2.0 * math.pi)
    if abs(apart) <= tolerance:
        return None
    return f"{key} = {expected!r} was expected, got {answer!r}, {abs(apart):.2g} apart"
