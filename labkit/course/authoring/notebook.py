"""The notebook that is handed out, with the metadata that nbgrader works by (schema 3).

Each question is a section: its task, its stub, and a cell that checks it. With solutions it
is the instructor's notebook, from which nbgrader makes its release: solutions stand between
``### BEGIN SOLUTION`` and ``### END SOLUTION``, and hidden tests give nbgrader the points.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from typing import Any

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from labkit.course.authoring import solution
from labkit.course.authoring.write import ClosingCell, closing, introduction, read_texts
from labkit.course.grading.assignment.questions import Question

IMPORTS = "import numpy as np\n\nfrom labkit.course.grading.check import check"
KERNEL = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def notebook_text(solutions: bool = False, *, stretch: bool = False) -> str:
    """The notebook as JSON, the same bytes each time: the students', or with `solutions` the
    instructor's, and with the `stretch` task at the end."""
    title, questions = read_texts()
    cells = [
        new_markdown_cell(f"# Assignment: {title}\n\n{_opening(questions)}", id="title"),
        new_code_cell(IMPORTS, id="imports"),
    ]
    for question in questions:
        cells.extend(_section(question, solutions))
    cells.extend(_closing_cell(one, solutions) for one in closing(stretch=stretch))
    notebook = new_notebook(cells=cells, metadata=KERNEL)
    nbformat.validate(notebook)
    text: str = nbformat.writes(notebook, indent=1, ensure_ascii=False)
    return text + "\n"


def _opening(questions: tuple[Question, ...]) -> str:
    rows = [f"| {one.title} | {one.points:g} |" for one in questions]
    total = sum(one.points for one in questions)
    table = ["| question | points |", "|---|---|", *rows, f"| **together** | **{total:g}** |"]
    return introduction() + "\n\n" + "\n".join(table)


def _section(question: Question, solutions: bool) -> Iterator[Any]:
    name = question.id.replace("_", "-")
    plural = "" if question.points == 1 else "s"
    about = f"*{question.points:g} point{plural}; see {question.chapter}.*"
    yield _cell(
        new_markdown_cell(f"## {question.title}\n\n{question.task}\n\n{about}", id=f"task-{name}"),
        grade_id=f"task-{name}",
        locked=True,
    )
    source = question.source(_solution(question)) if solutions else question.stub
    yield _cell(new_code_cell(source, id=name), grade_id=name, solution=True)
    check = f'check("{question.id}", {question.function})'
    if solutions:
        check += (
            "\n### BEGIN HIDDEN TESTS\nfrom labkit.course.grading.check import score\n"
            f'score("{question.id}", {question.function})\n### END HIDDEN TESTS'
        )
    yield _cell(
        new_code_cell(check, id=f"check-{name}"),
        grade_id=f"check-{name}",
        grade=True,
        locked=True,
        points=question.points,
    )


def _closing_cell(cell: ClosingCell, solutions: bool) -> Any:
    """A cell after the questions; an answer in words is the student's, and worth no points here."""
    if cell.kind == "code":
        metadata = {"mystnb": {"image": {"alt": cell.alt}}} if cell.alt else {}
        return new_code_cell(cell.text, id=cell.id, metadata=metadata)
    text = new_markdown_cell(cell.text, id=cell.id)
    if cell.kind == "answer":
        if solutions:  # without such a region nbgrader would put its own words for all of the text
            text.source += "\n\n### BEGIN SOLUTION\n### END SOLUTION"
        return _cell(text, grade_id=cell.id, grade=True, solution=True, points=0)
    return text


def _cell(cell: Any, *, points: float | None = None, **flags: Any) -> Any:
    """Add nbgrader's metadata; a text that is locked says what to do and is not graded."""
    marks = {
        "schema_version": 3,
        "grade": False,
        "locked": False,
        "solution": False,
        "task": False,
        **flags,
    }
    if points is not None:
        marks["points"] = points
    cell.metadata["nbgrader"] = dict(sorted(marks.items()))
    return cell


def _solution(question: Question) -> str:
    """The body of the reference submission's function, between nbgrader's marks."""
    source = inspect.getsource(getattr(solution, question.function))
    (function,) = ast.parse(source).body
    assert isinstance(function, ast.FunctionDef)
    lines = source.splitlines()[function.body[0].lineno - 1 :]
    body = "\n".join(line[4:] for line in lines)
    return f"### BEGIN SOLUTION\n{body}\n### END SOLUTION"
