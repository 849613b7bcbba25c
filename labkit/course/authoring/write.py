"""From the questions' texts, in the TOML files of `questions/`, to the assignment's files.

They are written one line a question or a case, so that changes can be read.
"""

from __future__ import annotations

import ast
import inspect
import json
import textwrap
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from labkit.course.authoring import solution
from labkit.course.authoring.compute import hidden_cases, visible_cases
from labkit.course.authoring.misconceptions import MISTAKES
from labkit.course.grading.assignment.files import COURSE, FORMAT, salt_of
from labkit.course.grading.assignment.questions import Answer, Case, Cases, Misconception, Question
from labkit.course.grading.inside.data import to_json
from labkit.files import atomic_write

VARIANTS = 8

Progress = Callable[[Iterable[Cases]], Iterable[Cases]]
FOLDER = Path(__file__).with_name("questions")


def write_assignment(
    folder: Path, variants: int = VARIANTS, progress: Progress = iter, *, secret: bytes = b""
) -> list[Path]:
    """Compute the assignment and write its files into an existing folder; which ones, is returned.

    Students are spread over so many `variants` of the hidden cases, which are drawn from the
    `secret`; without one they are public. `progress` wraps the variants as they come.

    Raises
    ------
    LabkitError
        If a file cannot be written, or if no cases tell the mistakes apart.
    """
    title, questions = read_texts()
    visible = {question.id: visible_cases(question) for question in questions}
    files = {
        folder / "questions.json": questions_file(title, questions),
        folder / "visible.json": cases_file(visible),
        folder / "hidden" / COURSE: course_file(questions, secret),
    }
    first = _hidden_of(0, visible, {}, secret)
    others = partial(_hidden_of, visible=visible, like=first, secret=secret)
    with ProcessPoolExecutor() as pool:
        drawn = chain([first], pool.map(others, range(1, variants)))
        for variant, hidden in enumerate(progress(drawn)):
            files[folder / "hidden" / f"variant_{variant}.json"] = cases_file(hidden)
    (folder / "hidden").mkdir(exist_ok=True)
    for stale in set((folder / "hidden").glob("variant_*.json")) - files.keys():
        stale.unlink()
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
        for one in read_texts()[1]
    }


def course_file(questions: Sequence[Question], secret: bytes = b"") -> str:
    """The text of `course.json`: stand-ins for wrong functions, and what the secret leads to."""
    content = {
        "format": FORMAT,
        "public": not secret,
        "salt": salt_of(secret),
        "right": {one.id: stand_in(one.function) for one in questions},
    }
    return json.dumps(content, ensure_ascii=False, indent=1) + "\n"


def stand_in(function: str) -> str:
    """Source that defines a right function, and nothing else that can be reached by a name.

    >>> names = {}
    >>> exec(stand_in("align"), names)
    >>> sorted(name for name in names if name != "__builtins__")
    ['align']
    """
    needed = [function]
    for name in needed:
        names = ast.walk(ast.parse(inspect.getsource(getattr(solution, name))))
        used = {node.id for node in names if isinstance(node, ast.Name)}
        needed += [
            one
            for one in sorted(used)
            if callable(getattr(solution, one, None)) and one not in needed
        ]
    sources = [inspect.getsource(getattr(solution, name)) for name in reversed(needed)]
    body = textwrap.indent("import numpy as np\n\n" + "\n".join(sources), "    ")
    return f"def _right():\n{body}    return {function}\n\n\n{function} = _right()\ndel _right\n"


def questions_file(title: str, questions: Iterable[Question]) -> str:
    """The text of `questions.json`."""
    rows = [{**asdict(question), "answer": question.answer.value} for question in questions]
    head = f'"format": {FORMAT},\n"title": {_json(title)}'
    return f'{{\n{head},\n"questions": {_lines(rows)}\n}}\n'


def cases_file(cases: Cases) -> str:
    """The text of `visible.json`, or of one variant."""
    parts = [f"{_json(id)}: {_lines(map(_row, those))}" for id, those in cases.items()]
    return f'{{\n"format": {FORMAT},\n"cases": {{\n' + ",\n".join(parts) + "\n}\n}\n"


def _row(case: Case) -> Mapping[str, Any]:
    return {
        "id": case.id,
        "about": case.about,
        "arguments": [to_json(value) for value in case.arguments],
        "expected": [to_json(value) for value in case.expected],
        "tolerance": case.tolerance,
        "mistaken": {
            id: [to_json(value) for value in answers] for id, answers in case.mistaken.items()
        },
    }


def _lines(rows: Iterable[Mapping[str, Any]]) -> str:
    return "[\n" + ",\n".join(map(_json, rows)) + "\n]"


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def read_texts() -> tuple[str, tuple[Question, ...]]:
    """The assignment's title and its questions, in their order."""
    head = tomllib.loads((FOLDER / "assignment.toml").read_text("utf-8"))
    tables: dict[str, dict[str, Any]] = {}
    for name in head["sections"]:
        tables |= tomllib.loads((FOLDER / f"{name}.toml").read_text("utf-8"))
    return head["title"], tuple(_question(id, table) for id, table in tables.items())


def introduction() -> str:
    """What stands above the first question, in Markdown."""
    text: str = tomllib.loads((FOLDER / "assignment.toml").read_text("utf-8"))["introduction"]
    return text.strip()


@dataclass(frozen=True, kw_only=True)
class ClosingCell:
    """A cell after the questions: a text, given code, or (kind "answer") a text of the student's.

    Cells of the `stretch` task stand there where an instructor wants them; `alt` says what the
    figure of a code cell shows.
    """

    id: str
    kind: str
    text: str
    stretch: bool = False
    alt: str = ""


def closing(*, stretch: bool) -> list[ClosingCell]:
    """What stands after the last question: the student's functions on recorded scans."""
    rows = tomllib.loads((FOLDER / "closing.toml").read_text("utf-8"))["cells"]
    cells = (ClosingCell(**row | {"text": row["text"].strip()}) for row in rows)
    return [cell for cell in cells if stretch or not cell.stretch]


def _question(id: str, table: dict[str, Any]) -> Question:
    chapter = table["chapter"]
    return Question(
        id=id,
        title=table["title"],
        chapter=chapter,
        points=float(table["points"]),
        function=table.get("function", id),
        signature=table["signature"],
        task=table["task"].strip(),
        docstring=table["docstring"].strip() + "\n",
        answer=Answer(table["answer"]),
        unit=table.get("unit", ""),
        low=table.get("low"),
        high=table.get("high"),
        chance=table.get("chance", 0.0),
        builds_on=tuple(table.get("builds_on", ())),
        misconceptions=tuple(
            Misconception(
                id=one.id, says=one.says, chapter=one.chapter or chapter, credit=one.credit
            )
            for one in MISTAKES
            if one.question == id
        ),
    )
