"""From the questions and their cases to the assignment's files and its notebook.

The files are written one line a question, a mistake or a case, so that changes can be read. Of the
notebook the cells of the questions are written anew; those before and after are its own, and edited
in it. Its metadata are nbgrader's (schema 3): each question is a task, a stub, and a cell that
checks it. With solutions it is the instructor's notebook, from which nbgrader makes its release:
solutions stand between ``### BEGIN SOLUTION`` and ``### END SOLUTION``, and hidden tests give
nbgrader the points.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import labkit
from labkit.course.assignment import PLAIN_ANSWERS
from labkit.course.authoring.compute import hidden_cases, rounded, visible_cases
from labkit.course.authoring.entries import question
from labkit.course.authoring.fairness import refuse_slow_cases, refuse_unseen_mistakes
from labkit.course.authoring.questions import QUESTIONS, TITLE
from labkit.course.exercises.entries import answers
from labkit.course.exercises.stages import stages_of
from labkit.grading.box.inside.data import to_json
from labkit.grading.questions import CASES, COURSE, FORMAT, Case, Question
from labkit.support.errors import LabkitError
from labkit.support.files import atomic_write
from labkit.support.progress import show_progress

HANDED_OUT = Path(labkit.__file__).parents[1] / "notebooks/assignment.ipynb"  # of a checkout
IMPORTS = "import numpy as np\n\nfrom labkit.course.exercises import check"
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
REGION = "### BEGIN SOLUTION\n{}### END SOLUTION"
SCORE = """
### BEGIN HIDDEN TESTS
from labkit.course.exercises import score
score({})
### END HIDDEN TESTS"""

Cell = dict[str, Any]


def write_assignment(
    folder: Path,
    secret: bytes,
    notebooks: Mapping[Path, bool],
    *,
    questions: Sequence[question] = QUESTIONS,
) -> list[Path]:
    """Compute the assignment, write its files into an existing folder, and list them.

    The hidden cases are drawn from the `secret`; without one they are public. The `notebooks` are
    written, too: the students', or where it says True the instructor's.

    Raises
    ------
    LabkitError
        If a file cannot be written, if no cases tell the mistakes apart, if a solution and its
        oracle disagree, or if the cases are not fair: see `fairness`.
    """
    visible, drawn = dict[str, Sequence[Case]](), dict[str, Sequence[Case]]()
    for entry in show_progress(questions, "drawing", unit="question"):
        id = entry.right.__name__
        visible[id] = visible_cases(entry)
        drawn[id] = hidden_cases(entry, visible[id], secret=secret)
        refuse_unseen_mistakes(entry, visible[id], drawn[id])
        refuse_slow_cases(entry, (*visible[id], *drawn[id]))
    hidden = folder / "hidden"
    files = {
        folder / "questions.json": questions_file(entry.asked_for for entry in questions),
        folder / "visible.json": cases_file(visible),
        folder / PLAIN_ANSWERS: plain_answers_file(questions, visible),
        hidden / COURSE: course_file(questions, secret),
        hidden / CASES: cases_file(drawn),
    }
    for path, solutions in notebooks.items():
        files[path] = notebook_text(path, solutions, questions)
    hidden.mkdir(exist_ok=True)
    for path, content_text in files.items():
        with atomic_write(path) as file:
            file.write(content_text)
    return list(files)


def course_file(questions: Sequence[question], secret: bytes = b"") -> str:
    """The text of `course.json`: right functions, each once, and what the secret leads to."""
    sources = {entry.right.__name__: entry.solution for entry in questions}
    return _text({"public": not secret, "right": sources})


def questions_file(questions: Iterable[Question]) -> str:
    """The text of `questions.json`."""
    rows = [{**asdict(question), "answer": question.answer.value} for question in questions]
    return _text({"title": TITLE, "questions": rows})


def cases_file(cases: Mapping[str, Sequence[Case]]) -> str:
    """The text of `visible.json`, or of the hidden cases."""
    return _text({"cases": {id: list(map(_row, those_cases)) for id, those_cases in cases.items()}})


def plain_answers_file(questions: Sequence[question], visible: Mapping[str, Sequence[Case]]) -> str:
    """The text of `plain_answers.json`: right answers to plainer calls of the visible cases."""
    rows = {}
    for entry in questions:
        cases = {}
        for case in visible[entry.right.__name__]:
            stages = {}
            for stage in stages_of(entry.asked_for, case.arguments):
                values = answers(entry.apply_edits({}), stage.arguments)
                if values:
                    stages[stage.phrase] = list(map(to_json, rounded(values)))
            cases[case.id] = stages
        rows[entry.right.__name__] = cases
    content_text = json.dumps(rows, ensure_ascii=False, allow_nan=False)
    return content_text.replace('"v1": ', '\n"v1": ') + "\n"


def _row(case: Case) -> dict[str, Any]:
    row = {
        **vars(case),
        "arguments": list(map(to_json, case.arguments)),
        "expected": list(map(to_json, case.expected)),
        "mistaken": {id: list(map(to_json, values)) for id, values in case.mistaken.items()},
    }
    del row["hidden"]
    return row


def _text(content: dict[str, Any]) -> str:
    content_text = json.dumps({"format": FORMAT, **content}, ensure_ascii=False, allow_nan=False)
    return content_text.replace('{"id": ', '\n{"id": ') + "\n"


def notebook_text(
    path: Path = HANDED_OUT, solutions: bool = False, questions: Sequence[question] = QUESTIONS
) -> str:
    """The notebook at a path as JSON, with the questions' cells written anew: the students', or
    with `solutions` the instructor's. Where there is none, a new one has the questions alone."""
    present_cells = _read_cells(HANDED_OUT if solutions and HANDED_OUT.exists() else path)
    marks = [place for place, cell in enumerate(present_cells) if _is_written(cell)] or [
        len(present_cells) - 1
    ]
    cells_before = [cell for cell in present_cells[: marks[0] + 1] if not _is_written(cell)]
    cells_after = [cell for cell in present_cells[marks[0] + 1 :] if not _is_written(cell)]
    cells = [*cells_before, _cell("markdown", "points", _points(questions))]
    for entry in questions:
        cells.extend(_section(entry, solutions))
    for cell in cells_after:
        is_answer = cell["metadata"].get("nbgrader", {}).get("solution")
        # without such a region nbgrader would put its own words for all of the text
        content_text = "".join(cell["source"]) + (
            f"\n\n{REGION.format('')}" if solutions and is_answer else ""
        )
        cells.append({**cell, "source": content_text.splitlines(keepends=True)})
    content = {"cells": cells, "metadata": METADATA, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(content, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def _read_cells(path: Path) -> list[Cell]:
    try:
        cells: list[Cell] = json.loads(path.read_bytes())["cells"] if path.exists() else []
    except (ValueError, KeyError, OSError) as error:
        raise LabkitError(f"{path} is no notebook that can be written anew: {error}") from None
    title = _cell("markdown", "title", f"# Assignment: {TITLE}")
    return cells or [title, _cell("code", "imports", IMPORTS)]


def _is_written(cell: Cell) -> bool:
    """True for the cells of the questions; answers in words are the notebook's own."""
    mark = cell["metadata"].get("nbgrader", {})
    return cell.get("id") == "points" or bool(
        mark and (mark["locked"] or cell["cell_type"] == "code")
    )


def _points(questions: Sequence[question]) -> str:
    rows = "".join(f"| {entry.title} | {entry.points:g} |\n" for entry in questions)
    total = sum(entry.points for entry in questions)
    return f"| question | points |\n|---|---|\n{rows}| **together** | **{total:g}** |"


def _section(entry: question, solutions: bool) -> Iterator[Cell]:
    asked_question = entry.asked_for
    name = asked_question.id.replace("_", "-")
    plural = "" if asked_question.points == 1 else "s"
    about = f"*{asked_question.points:g} point{plural}; see {asked_question.chapter}.*"
    task = f"## {asked_question.title}\n\n{asked_question.task}\n\n{about}"
    yield _cell("markdown", f"task-{name}", task, locked=True)
    body = REGION.format("".join(f"{line[4:]}\n" for line in entry.body.splitlines()))
    source = asked_question.source(body) if solutions else asked_question.stub
    yield _cell("code", name, source, solution=True)
    check = f"check({asked_question.function})" + (
        SCORE.format(asked_question.function) if solutions else ""
    )
    yield _cell(
        "code", f"check-{name}", check, grade=True, locked=True, points=asked_question.points
    )


def _cell(kind: str, id: str, source: str, **marks: Any) -> Cell:
    """A cell; with marks, nbgrader knows it. A text that is locked is not graded."""
    cell: Cell = {"cell_type": kind, "id": id, "metadata": {}}
    cell["source"] = source.splitlines(keepends=True)
    if kind == "code":
        cell |= {"execution_count": None, "outputs": []}
    if marks:
        usual = {"grade": False, "locked": False, "solution": False, "task": False}
        mark = {"schema_version": 3, "grade_id": id, **usual, **marks}
        cell["metadata"]["nbgrader"] = mark
    return cell
