"""nbgrader, otter-grader and labkit on the same class, in turns; a table comes out.

``python tests/bench/graders/run.py`` needs ``.venv-graders``, which
``tests/course/grading/others/requirements.txt`` tells how to make. The clock runs from the start of
each command to its end, imports and the start of workers included; beside it stands what all
of its processes together were at work, which a busy machine changes less. nbgrader grades one
submission after the other, as does otter-grader where it runs without containers; both run a
student's code with the rights of the grader. labkit isolates it, on as many cores as --jobs.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[3]
sys.path[:0] = [
    str(ROOT / "tests" / name) for name in ("course/grading", "course/authoring", "bench")
]

from machine import describe_machine, describe_versions  # noqa: E402

from courses import (  # noqa: E402
    OTHERS,
    Course,
    activated,
    lab_course,
    labkit_scores,
    trivial_course,
)
from labkit.cli.text import table  # noqa: E402

PYTHON = ROOT / ".venv-graders/bin/python"
COURSES = {"trivial": trivial_course, "lab": lab_course}
AIM = "nbgrader"
SET_CHILD_SUBREAPER = 36  # of prctl(2), Linux
LEAVE = 10.0  # s that the last processes of a grader may take to end


@dataclass(kw_only=True)
class Grader:
    """One of the competitors on one course, and what its turns took [s] by two clocks."""

    name: str
    command: Sequence[str | Path]
    rounds: int
    leaves: tuple[str, ...] = ()  # what the next turn must not find
    seconds: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)

    def grade(self, course: Course) -> None:
        """One turn under the clock."""
        for name in self.leaves:
            shutil.rmtree(course.folder / name, ignore_errors=True)
        environment = activated(Path(self.command[0]))
        start, worked = time.perf_counter(), _processor_seconds()
        done = subprocess.run(
            self.command, cwd=course.folder, env=environment, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        self.seconds.append(time.perf_counter() - start)
        self.processor.append(_processor_seconds() - worked)
        if done.returncode:
            sys.exit(f"{self.name} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")


def _adopt_orphans() -> None:
    """Become the parent of processes whose own parent has ended, and so learn of their work."""
    ctypes.CDLL(None, use_errno=True).prctl(SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def _processor_seconds() -> float:
    """What all processes that this one started were at work, once all of them have ended."""
    end = time.monotonic() + LEAVE
    with suppress(ChildProcessError):
        while time.monotonic() < end:
            if os.waitpid(-1, os.WNOHANG) == (0, 0):
                time.sleep(0.02)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> int:
    """Make the classes, let the graders take turns, print what they took."""
    args = _parse()
    _adopt_orphans()
    if not PYTHON.exists():
        sys.exit(
            "needs nbgrader and otter-grader: python -m venv .venv-graders; "
            ".venv-graders/bin/pip install -r tests/course/grading/others/requirements.txt -e ."
        )
    results: dict[str, object] = {"machine": describe_machine(), "versions": describe_versions()}
    for name in args.courses:
        with tempfile.TemporaryDirectory(prefix="graders-") as folder:
            course = COURSES[name](Path(folder), args.students, PYTHON)
            graders = _graders(course, args)
            turns = deque(graders)
            for number in range(args.rounds):
                for grader in turns:
                    if number < grader.rounds:
                        grader.grade(course)
                        print(f"{grader.name}: {grader.seconds[-1]:.2f} s", file=sys.stderr)
                turns.rotate(1)
            results[name] = {
                one.name: {"wall": one.seconds, "processor": one.processor} for one in graders
            }
            print(_report(course, graders, args.students), flush=True)
            print(_agreement(course, graders) if name == "lab" else "", flush=True)
    if args.out:
        args.out.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0


def _graders(course: Course, args: argparse.Namespace) -> list[Grader]:
    labkit = [sys.executable, "-m", "labkit", "grade", "submitted"]
    labkit += ["--assignment", str(course.assignment), "--out", "grades"]
    jobs = ["--jobs", str(args.jobs)]
    graders = [
        Grader(
            name="nbgrader",
            command=[PYTHON.parent / "nbgrader", "autograde", "lab1", "--create", "--force"],
            rounds=args.rounds,
            leaves=("autograded",),
        ),
        Grader(
            name="otter-grader",
            command=[PYTHON, OTHERS / "otter_course.py", "."],
            rounds=args.otter_rounds,
            leaves=("results",),
        ),
        Grader(
            name=f"labkit, {args.jobs} jobs",
            command=[*labkit, *jobs, "--no-html"],
            rounds=args.rounds,
            leaves=("grades",),
        ),
        Grader(
            name=f"labkit, {args.jobs} jobs, pages",
            command=[*labkit, *jobs],
            rounds=args.rounds,
            leaves=("grades",),
        ),
        Grader(
            name="labkit, 1 job",
            command=[*labkit, "--jobs", "1", "--no-html"],
            rounds=args.rounds,
            leaves=("grades",),
        ),
    ]
    return [one for one in graders if one.rounds]


def _report(course: Course, graders: Sequence[Grader], students: int) -> str:
    """A row for each grader; the ratios are of turns of the same round, then the median."""
    reference = next(one for one in graders if one.name == AIM)
    rows = [
        [
            one.name,
            str(len(one.seconds)),
            f"{median(one.seconds):.2f}",
            f"{students / median(one.seconds):.2f}",
            f"{_ratio(reference.seconds, one.seconds):.1f}",
            f"{1e3 * median(one.processor) / students:.1f}",
            f"{_ratio(reference.processor, one.processor):.1f}",
        ]
        for one in graders
    ]
    header = ("grader", "rounds", "s", "a second", f"× {AIM}", "processor ms each", "less by ×")
    return f"{course.title}: {students} submissions\n{table(header, rows)}\n"


def _ratio(theirs: Sequence[float], ours: Sequence[float]) -> float:
    return median(a / b for a, b in zip(theirs, ours, strict=False))


def _agreement(course: Course, graders: Sequence[Grader]) -> str:
    """The totals on which nbgrader and labkit agree, and those on which they do not.

    nbgrader scores a function when its cell has run, labkit when all have: they differ where a
    later cell of the same notebook breaks what an earlier one calls. nbgrader asks everybody
    the same variant of the hidden cases. And it gives no point to a cell that writes to stderr,
    where numpy's warnings go; `labkit.course.grading.check` has them written to stdout therefore.
    """
    script = (
        "import json, sys\nfrom nbgrader.api import Gradebook\n"
        "with Gradebook('sqlite:///gradebook.db') as book:\n"
        "    those = book.assignment_submissions('lab1')\n"
        "    print(json.dumps({one.student.id: one.score for one in those}))"
    )
    done = subprocess.run(
        [PYTHON, "-c", script], cwd=course.folder, env=activated(PYTHON), text=True,
        capture_output=True, check=True,
    )  # fmt: skip
    theirs: Mapping[str, float] = json.loads(done.stdout)
    ours = labkit_scores(course.folder / "grades")
    other = {one: (ours[one], theirs[one]) for one in ours if abs(ours[one] - theirs[one]) > 0.01}
    lines = [f"totals on which nbgrader and labkit agree: {len(ours) - len(other)} of {len(ours)}"]
    lines += [
        f"  {one}: labkit {mine:g}, nbgrader {its:g}{_silenced(course, one)}"
        for one, (mine, its) in other.items()
    ]
    return "\n".join(lines)


def _silenced(course: Course, student: str) -> str:
    """The tests to which nbgrader gave no point because something was written to stderr."""
    path = course.folder / f"autograded/{student}/lab1/assignment.ipynb"
    names = [
        cell["metadata"]["nbgrader"]["grade_id"]
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
        if cell["metadata"].get("nbgrader", {}).get("grade")
        and any(output.get("name") == "stderr" for output in cell["outputs"])
    ]
    return f" (no point for what wrote to stderr: {', '.join(names)})" if names else ""


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--courses", nargs="+", choices=COURSES, default=list(COURSES))
    parser.add_argument("--students", type=int, default=60, metavar="N")
    parser.add_argument("--rounds", type=int, default=3, metavar="R")
    parser.add_argument("--otter-rounds", type=int, metavar="R", help="of these (all)")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1), metavar="N")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the seconds as JSON")
    args = parser.parse_args()
    if args.otter_rounds is None:
        args.otter_rounds = args.rounds
    return args


if __name__ == "__main__":
    sys.exit(main())
