"""Two laws at full size: what each mistake costs, and whether a load changes a verdict.

``python tests/bench/graders/laws.py table`` lets each function fail in each of nine ways, one a
hand-in, and prints the score of each, and the time beside as many right ones. ``load`` grades a
class of 30 twice, the second time beside 20 busy processes, and compares the verdicts.
"""

# ruff: noqa: I001 (`run` says where the others are)
from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from run import grade, write_class

from labkit.grading.box.outside import open_wall
from labkit.grading.classroom.rounds import JOBS
from labkit.grading.grade import grade_submission
from tests.grading.failing import ASSIGNMENT, NAMES, WAYS, failing
from tests.grading.notebooks import answered

BUSY = ["nice", "-n", "5", sys.executable, "-c", "while True: pass"]


def table() -> None:
    """Print the scores by function and way; those that differ from 100 less the points first."""
    wall = open_wall()

    def score(name: str, way: str) -> float:
        files = {"a.ipynb": answered({name: failing(name, way)} if way else {}, closing=False)}
        return grade_submission(files, wall, ASSIGNMENT, name)[0].score

    cells = [(name, way) for name in NAMES for way in WAYS]
    seconds = {}
    with ThreadPoolExecutor(JOBS) as executor:
        for kind, asked in (("right", [(name, "") for name, _ in cells]), ("failing", cells)):
            start = time.perf_counter()
            found = dict(zip(asked, executor.map(score, *zip(*asked, strict=True)), strict=True))
            seconds[kind] = time.perf_counter() - start
            assert kind == "failing" or set(found.values()) == {100.0}
    print("| function | 100 less its points |", " | ".join(WAYS), "|")
    for one in ASSIGNMENT.questions:
        scores = [found[one.function, way] for way in WAYS]
        print(f"| {one.function} | {100.0 - one.points:g} |", *(f"{each:g} |" for each in scores))
        assert set(scores) == {100.0 - one.points}, one.function
    ratio = seconds["failing"] / seconds["right"]
    print(f"{len(cells)} failing: {seconds['failing']:.0f} s, ratio to right ones {ratio:.2f}")


def load(students: int = 30, busy: int = 20) -> None:
    """Print how many of two gradings' verdicts differ, and how long both took."""
    with tempfile.TemporaryDirectory() as name:
        folder, found = Path(name), []
        write_class(folder / "submitted", students, students // 6)
        for count in (0, busy):
            with contextlib.ExitStack() as stack:
                for _ in range(count):
                    stack.callback(subprocess.Popen(BUSY).kill)
                print(f"beside {count}: {grade(folder):.0f} s", flush=True)
            stored = {path.name: json.loads(path.read_text("utf-8"))
                      for path in (folder / "grades/verdicts").iterdir()}  # fmt: skip
            for each in stored.values():
                each["verdict"].pop("seconds")
            found.append(stored)
    differ = [one for one in found[0] if found[0][one] != found[1][one]]
    print(f"{len(differ)} of {len(found[0])} verdicts differ {differ}")


if __name__ == "__main__":
    {"table": table, "load": load}[sys.argv[1]]()
