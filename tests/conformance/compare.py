"""Compare an answer with the expected one, and describe the difference.

As a command it holds a program to the vectors, and says which case differs::

    python tests/conformance/compare.py alignment node align.js

The first word is the group; the others start the program, which gets each case's command behind
them and prints one line of JSON (README.md beside this file).
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
XYTHETA = ("x", "y", "theta")
TOLERANCE = 1e-9  # [m], [rad], [m²], and the pure number of fitness


def disagreement(answer: Any, expected: dict[str, Any], tolerance: float = TOLERANCE) -> str | None:
    """Describe how `answer` differs from `expected`; None if it does not.

    Numbers may differ by `tolerance`, angles by as much across the cut at ±π, and an angle
    must lie in (−π, π]. Counts, words and nulls are exact. An error must begin with the
    expected one.
    """
    if not isinstance(answer, dict):
        return f"{answer!r} is no JSON object"
    if "error" in expected:
        error = answer.get("error")
        if isinstance(error, str) and error.startswith(expected["error"]):
            return None
        return f"the error {expected['error']!r} was expected, got {answer}"
    if answer.keys() != expected.keys():
        return f"the keys {sorted(expected)} were expected, got {answer}"
    if "poses" in expected:
        return _compare_poses(answer["poses"], expected["poses"], tolerance)
    reasons = (_compare_value(key, answer[key], expected[key], tolerance) for key in expected)
    return next(filter(None, reasons), None)


def _compare_poses(answer: Any, expected: list[list[float]], tolerance: float) -> str | None:
    if not isinstance(answer, list) or len(answer) != len(expected):
        return f"{len(expected)} poses were expected, got {answer!r:.60}"
    for number, (pose, expected_pose) in enumerate(zip(answer, expected, strict=True)):
        if not isinstance(pose, list) or len(pose) != 3:
            return f"pose {number} must have three numbers, got {pose!r:.60}"
        for key, value, expected_value in zip(XYTHETA, pose, expected_pose, strict=True):
            reason = _compare_value(key, value, expected_value, tolerance)
            if reason:
                return f"pose {number}: {reason}"
    return None


def _compare_value(key: str, answer: Any, expected: Any, tolerance: float) -> str | None:
    if not isinstance(expected, float):
        is_equal = type(answer) is type(expected) and answer == expected
        return None if is_equal else f"{key} = {expected!r} was expected, got {answer!r}"
    if isinstance(answer, bool) or not isinstance(answer, (int, float)):
        return f"{key} = {expected!r} was expected, got {answer!r}"
    difference = answer - expected
    if key == "theta":
        if not -math.pi < answer <= math.pi:
            return f"theta must lie in (−π, π], got {answer!r}"
        difference = math.remainder(difference, 2.0 * math.pi)
    if abs(difference) <= tolerance:
        return None
    return f"{key} = {expected!r} was expected, got {answer!r}, {abs(difference):.2g} apart"


def try_program(program: list[str], command: list[str], expected: dict[str, Any]) -> str | None:
    """Describe how a program's answer to a command differs from the expected one, or None."""
    words = [str(FOLDER / word) if word.startswith("data/") else word for word in command]
    try:
        process = subprocess.run([*program, *words], capture_output=True, text=True, check=False)
        return disagreement(json.loads(process.stdout), expected)
    except json.JSONDecodeError:
        lines = (process.stderr or process.stdout).strip().splitlines() or ["nothing"]
        errors = [line for line in lines if "Error" in line]
        return f"no line of JSON; it says: {(errors or lines[-1:])[0]}"
    except OSError as error:
        sys.exit(f"compare.py: {program[0]} does not start: {error.strerror}")


def main(group: str, *program: str) -> None:
    """Hold a program to the vectors of a group; the status is 1 where one differs."""
    vectors = json.loads((FOLDER / "vectors.json").read_text("utf-8"))
    cases = [case for case in vectors if case["group"] == group]
    if not cases or not program:
        groups = ", ".join(dict.fromkeys(case["group"] for case in vectors))
        sys.exit(f"usage: compare.py GROUP PROGRAM [ARGUMENT ...]; the groups are {groups}")
    agreement_count = 0
    for case in cases:
        reason = try_program(list(program), case["command"], case["expected"])
        agreement_count += reason is None
        if reason:
            print(f"{case['name']}: {reason}\n    {' '.join(case['command'])}")
    print(f"{agreement_count} of {len(cases)} cases of {group} agree")
    sys.exit(agreement_count < len(cases))


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["", ""]))
