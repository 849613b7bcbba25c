"""The same class in the layout of each grader: nbgrader's course, otter's tests, one folder."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import nbformat
from nbformat.v4 import new_code_cell, new_notebook
from small import DOUBLE, case, write

from labkit.course.authoring.notebook import notebook_text
from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.assignment.questions import Question
from submissions import Answers, answered, lab_answers, trivial_answers

OTHERS = Path(__file__).parents[2] / "course/grading/others"
RELEASE = "release/lab1/assignment.ipynb"
OTTER_TEST = """\
OK_FORMAT = False

from otter.test_files import test_case

name = "{id}"
points = {points}


@test_case(points={points}, hidden=True)
def test_{id}({function}):
{body}
"""


@dataclass(frozen=True, kw_only=True)
class Course:
    """A class on disk.

    Attributes
    ----------
    title : str
        For the report.
    folder : Path
        A course as nbgrader keeps it, with otter's tests and its configuration beside.
    assignment : Path
        The questions that labkit grades by.
    """

    title: str
    folder: Path
    assignment: Path


def lab_course(folder: Path, students: int, python: Path) -> Course:
    """The lab's own assignment; all three graders ask its hidden cases through labkit."""
    for question in load_assignment().questions:
        body = (
            "    from labkit.course.grading.check import score\n"
            f'    assert score("{question.id}", {question.function}) == {question.points}'
        )
        _write_otter_test(folder, question, body)
    _hand_in(folder, notebook_text(solutions=True), lab_answers, students, python)
    title = f"the lab's assignment, {len(load_assignment().questions)} questions"
    return Course(title=title, folder=folder, assignment=FOLDER)


def trivial_course(folder: Path, students: int, python: Path) -> Course:
    """One question, "double it", with a visible and a hidden case and no labkit in the tests."""
    (folder / "assignment/hidden").mkdir(parents=True)
    write(
        folder / "assignment/questions.json",
        title="Small numbers",
        questions=[{**vars(DOUBLE), "answer": DOUBLE.answer.value, "misconceptions": []}],
    )
    write(folder / "assignment/visible.json", cases={"double": [case("1", 1.5, 3.0)]})
    write(folder / "assignment/hidden/variant_0.json", cases={"double": [case("h", 5.0, 10.0)]})
    asserts = "assert double(1.5) == 3.0", "assert double(5.0) == 10.0"
    _write_otter_test(folder, DOUBLE, "".join(f"    {line}\n" for line in asserts))
    _hand_in(folder, _trivial_notebook(*asserts), trivial_answers, students, python)
    return Course(
        title="a trivial assignment, one question",
        folder=folder,
        assignment=folder / "assignment",
    )


def activated(python: Path) -> dict[str, str]:
    """The environment variables with which an interpreter finds its own programs first."""
    return dict(os.environ) | {"PATH": f"{python.parent}{os.pathsep}{os.environ['PATH']}"}


def _trivial_notebook(visible: str, hidden: str) -> str:
    """The instructor's notebook of the one question, as nbgrader has it."""
    flags = {"schema_version": 3, "grade": False, "locked": False, "solution": False, "task": False}
    solution = flags | {"grade_id": "double", "solution": True}
    test = flags | {"grade_id": "check-double", "grade": True, "locked": True, "points": 2.0}
    body = "### BEGIN SOLUTION\n    return 2 * x\n    ### END SOLUTION"
    tests = f"{visible}\n### BEGIN HIDDEN TESTS\n{hidden}\n### END HIDDEN TESTS"
    cells = [
        new_code_cell("import math"),
        new_code_cell(f"def double(x):\n    {body}", metadata={"nbgrader": solution}),
        new_code_cell(tests, metadata={"nbgrader": test}),
    ]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return str(nbformat.writes(new_notebook(cells=cells, metadata={"kernelspec": kernel})))


def _write_otter_test(folder: Path, question: Question, body: str) -> None:
    (folder / "tests").mkdir(parents=True, exist_ok=True)
    (folder / "otter_config.json").write_text("{}", encoding="utf-8")
    text = OTTER_TEST.format(
        id=question.id, points=question.points, function=question.function, body=body
    )
    (folder / f"tests/{question.id}.py").write_text(text, encoding="utf-8")


def _hand_in(
    folder: Path,
    instructors: str,
    answers: Callable[[], Iterator[Answers]],
    students: int,
    python: Path,
) -> None:
    """Have nbgrader make the release, and hand in as many notebooks."""
    source = folder / "source/lab1/assignment.ipynb"
    source.parent.mkdir(parents=True)
    source.write_text(instructors, encoding="utf-8")
    config = "c = get_config()\nc.ExecutePreprocessor.timeout = 120\n"
    (folder / "nbgrader_config.py").write_text(config, encoding="utf-8")
    command = [python, OTHERS / "nbgrader_course.py", folder]
    subprocess.run(
        command, check=True, cwd=folder, env=activated(python), stdout=subprocess.DEVNULL
    )
    release = (folder / RELEASE).read_text(encoding="utf-8")
    for number, those in enumerate(islice(answers(), students)):
        path = folder / f"submitted/student{number:03}/lab1/assignment.ipynb"
        path.parent.mkdir(parents=True)
        path.write_text(answered(release, those), encoding="utf-8")


def labkit_scores(out: Path) -> dict[str, float]:
    """Each student's points by the verdicts that labkit stored."""
    lines = (out / "verdicts.jsonl").read_text(encoding="utf-8").splitlines()[1:]
    verdicts = (json.loads(line)["verdict"] for line in lines)
    return {verdict["student"]: verdict["score"] for verdict in verdicts}
