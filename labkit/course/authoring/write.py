"""From the texts in `questions/` and the cases to the assignment's files and its notebook.

The files are written one line a question, a mistake or a case, so that changes can be read. The
notebook has the metadata that nbgrader works by (schema 3): each question is a section of its task,
its stub, and a cell that checks it. With solutions it is the instructor's notebook, from which
nbgrader makes its release: solutions stand between ``### BEGIN SOLUTION`` and ``### END SOLUTION``,
and hidden tests give nbgrader the points.
"""

from __future__ import annotations

import inspect
import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import nbformat
from nbformat import v4
from tqdm.contrib.concurrent import process_map

from labkit.course.authoring import solution
from labkit.course.authoring.compute import hidden_cases, visible_cases
from labkit.course.authoring.sections import ENTRIES
from labkit.course.grading.assignment.files import COURSE, FORMAT, salt_of
from labkit.course.grading.assignment.questions import Answer, Case, Cases, Misconception, Question
from labkit.course.grading.inside.data import to_json
from labkit.support.files import atomic_write

VARIANTS = 8  # sets of hidden cases, which students are spread over
FOLDER = Path(__file__).with_name("questions")
IMPORTS = "import numpy as np\n\nfrom labkit.course.grading.check import check"
KERNEL = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
REGION = "### BEGIN SOLUTION\n{}### END SOLUTION"


def write_assignment(folder: Path, secret: bytes, notebooks: Mapping[Path, bool]) -> list[Path]:
    """Compute the assignment, write its files into an existing folder, and list them.

    The hidden cases are drawn from the `secret`; without one they are public. The `notebooks` are
    written, too: the students', or where it says True the instructor's.

    Raises
    ------
    LabkitError
        If a file cannot be written, or if no cases tell the mistakes apart.
    """
    title, questions = read_questions()
    visible = {question.id: visible_cases(question) for question in questions}
    hidden = folder / "hidden"
    files = {
        folder / "questions.json": questions_file(title, questions),
        folder / "visible.json": cases_file(visible),
        hidden / COURSE: course_file(questions, secret),
    }
    first = _hidden_of(0, visible, {}, secret)
    others = partial(_hidden_of, visible=visible, like=first, secret=secret)
    drawn = [first, *process_map(others, range(1, VARIANTS), desc="variants", disable=None)]
    files |= {hidden / f"variant_{k}.json": cases_file(cases) for k, cases in enumerate(drawn)}
    files |= {path: notebook_text(solutions) for path, solutions in notebooks.items()}
    hidden.mkdir(exist_ok=True)
    for path, text in files.items():
        with atomic_write(path) as file:
            file.write(text)
    return list(files)


def _hidden_of(variant: int, visible: Cases, like: Cases, secret: bytes) -> Cases:
    """The hidden cases of a variant; `like` is another one, as hard as which it is to be."""
    return {
        one.id: hidden_cases(
            one, variant, visible[one.id], secret=secret, like=like.get(one.id, ())
        )
        for one in read_questions()[1]
    }


def course_file(questions: Sequence[Question], secret: bytes = b"") -> str:
    """The text of `course.json`: right functions, each once, and what the secret leads to."""
    right = {one.id: inspect.getsource(getattr(solution, one.function)) for one in questions}
    return _text({"public": not secret, "salt": salt_of(secret), "right": right})


def questions_file(title: str, questions: Iterable[Question]) -> str:
    """The text of `questions.json`."""
    rows = [{**asdict(question), "answer": question.answer.value} for question in questions]
    return _text({"title": title, "questions": rows})


def cases_file(cases: Cases) -> str:
    """The text of `visible.json`, or of one variant."""
    return _text({"cases": {id: list(map(_row, those)) for id, those in cases.items()}})


def _row(case: Case) -> dict[str, Any]:
    row = {
        **vars(case),
        "arguments": list(map(to_json, case.arguments)),
        "expected": list(map(to_json, case.expected)),
        "mistaken": {id: list(map(to_json, wrong)) for id, wrong in case.mistaken.items()},
    }
    del row["hidden"]
    return row


def _text(content: dict[str, Any]) -> str:
    text = json.dumps({"format": FORMAT, **content}, ensure_ascii=False, allow_nan=False)
    return text.replace('{"id": ', '\n{"id": ') + "\n"


def read_toml(name: str) -> dict[str, Any]:
    """Read a file of `questions/`."""
    return tomllib.loads((FOLDER / f"{name}.toml").read_text("utf-8"))


def read_questions() -> tuple[str, tuple[Question, ...]]:
    """The assignment's title and its questions, in their order."""
    head = read_toml("assignment")
    tables = chain.from_iterable(read_toml(name).items() for name in head["sections"])
    return head["title"], tuple(_question(id, table) for id, table in tables)


def _question(id: str, table: Mapping[str, Any]) -> Question:
    known = tuple(
        Misconception(
            id=one.id, says=one.says, chapter=one.chapter or table["chapter"], credit=one.credit
        )
        for one in ENTRIES[id].mistakes
    )
    given = {
        **table,
        "points": float(table["points"]),
        "task": table["task"].strip(),
        "answer": Answer(table["answer"]),
    }
    return Question(id=id, function=id, misconceptions=known, **given)


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
