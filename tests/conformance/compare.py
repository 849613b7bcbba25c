"""Whether an answer is the expected one, and if not, why not.

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


def try_program(program: list[str], command: list[str], expected: dict[str, Any]) -> str | None:
    """Why a program's answer to one command is not the expected one; None where it is."""
    words = [str(FOLDER / word) if word.startswith("data/") else word for word in command]
    try:
        done = subprocess.run([*program, *words], capture_output=True, text=True, check=False)
        return disagreement(json.loads(done.stdout), expected)
    except json.JSONDecodeError:
        told = (done.stderr or done.stdout).strip().splitlines() or ["nothing"]
        return f"no line of JSON; it says: {next((x for x in told if 'Error' in x), told[-1])}"
    except OSError as error:
        sys.exit(f"compare.py: {program[0]} does not start: {error.strerror}")


def main(group: str, *program: str) -> None:
    """Hold a program to the vectors of a group; the status is 1 where one differs."""
    vectors = json.loads((FOLDER / "vectors.json").read_text("utf-8"))
    cases = [each for each in vectors if each["group"] == group]
    if not cases or not program:
        groups = ", ".join(dict.fromkeys(each["group"] for each in vectors))
        sys.exit(f"usage: compare.py GROUP PROGRAM [ARGUMENT ...]; the groups are {groups}")
    agreed = 0
    for case in cases:
        reason = try_program(list(program), case["command"], case["expected"])
        agreed += reason is None
        if reason:
            print(f"{case['name']}: {reason}\n    {' '.join(case['command'])}")
    print(f"{agreed} of {len(cases)} cases of {group} agree")
    sys.exit(agreed < len(cases))


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["", ""]))
