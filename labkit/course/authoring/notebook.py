"""The notebook that is handed out, with the metadata that nbgrader works by (schema 3).

Each question is a section: its task, its stub, and a cell that checks it. With solutions it
is the instructor's notebook, from which nbgrader makes its release: solutions stand between
``### BEGIN SOLUTION`` and ``### END SOLUTION``, and hidden tests give nbgrader the points.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from typing import Any

import nbformat
from nbformat import v4

from labkit.course.authoring import solution
from labkit.course.authoring.write import read_questions, read_toml
from labkit.course.grading.assignment.questions import Question

IMPORTS = "import numpy as np\n\nfrom labkit.course.grading.check import check"
KERNEL = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
REGION = "### BEGIN SOLUTION\n{}### END SOLUTION"


def notebook_text(solutions: bool = False) -> str:
    """The notebook as JSON, the same bytes each time: the students', or with `solutions` the
    instructor's."""
    title, questions = read_questions()
    opening = f"# Assignment: {title}\n\n{read_toml('assignment')['introduction'].strip()}"
    cells = [
        _cell("markdown", "title", f"{opening}\n\n{_points(questions)}"),
        _cell("code", "imports", IMPORTS),
    ]
    for question in questions:
        cells.extend(_section(question, solutions))
    cells.extend(_closing_cell(one, solutions) for one in read_toml("closing")["cells"])
    return f"{nbformat.writes(v4.new_notebook(cells=cells, metadata=KERNEL))}\n"


def _points(questions: tuple[Question, ...]) -> str:
    rows = "".join(f"| {one.title} | {one.points:g} |\n" for one in questions)
    total = sum(one.points for one in questions)
    return f"| question | points |\n|---|---|\n{rows}| **together** | **{total:g}** |"


def _section(question: Question, solutions: bool) -> Iterator[Any]:
    name = question.id.replace("_", "-")
    plural = "" if question.points == 1 else "s"
    about = f"*{question.points:g} point{plural}; see {question.chapter}.*"
    task = f"## {question.title}\n\n{question.task}\n\n{about}"
    yield _cell("markdown", f"task-{name}", task, locked=True)
    source = question.source(_solution(question)) if solutions else question.stub
    yield _cell("code", name, source, solution=True)
    check = f'check("{question.id}", {question.function})'
    if solutions:
        check += (
            "\n### BEGIN HIDDEN TESTS\nfrom labkit.course.grading.check import score\n"
            f'score("{question.id}", {question.function})\n### END HIDDEN TESTS'
        )
    yield _cell("code", f"check-{name}", check, grade=True, locked=True, points=question.points)


def _closing_cell(given: Mapping[str, str], solutions: bool) -> Any:
    """A cell after the questions; an answer in words is the student's, and worth no points here."""
    id, kind, text = given["id"], given["kind"], given["text"].strip()
    if kind == "answer":
        if solutions:  # without such a region nbgrader would put its own words for all of the text
            text += "\n\n" + REGION.format("")
        return _cell("markdown", id, text, grade=True, solution=True, points=0)
    cell = _cell(kind, id, text)
    if "alt" in given:
        cell.metadata.mystnb = {"image": {"alt": given["alt"]}}
    return cell


def _cell(kind: str, id: str, source: str, **marks: Any) -> Any:
    """A cell; with marks, nbgrader knows it. A text that is locked is not graded."""
    cell = {"code": v4.new_code_cell, "markdown": v4.new_markdown_cell}[kind](source, id=id)
    if marks:
        usual = {"grade": False, "locked": False, "solution": False, "task": False}
        cell.metadata.nbgrader = {"schema_version": 3, "grade_id": id, **usual, **marks}
    return cell


def _solution(question: Question) -> str:
    """The body of the reference submission's function, between nbgrader's marks."""
    _, *lines = inspect.getsource(getattr(solution, question.function)).splitlines()
    return REGION.format("".join(f"{line[4:]}\n" for line in lines))
