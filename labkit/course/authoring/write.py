"""From the questions' texts, in the TOML files of `questions/`, to the assignment's files.

They are written one line a question, a mistake or a case, so that changes can be read.
"""

from __future__ import annotations

import inspect
import json
import textwrap
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from tqdm import tqdm

from labkit.course.authoring import solution
from labkit.course.authoring.compute import hidden_cases, visible_cases
from labkit.course.authoring.sections import ENTRIES
from labkit.course.grading.assignment.files import COURSE, FORMAT, salt_of
from labkit.course.grading.assignment.questions import Answer, Case, Cases, Misconception, Question
from labkit.course.grading.inside.data import to_json
from labkit.files import atomic_write

VARIANTS = 8  # sets of hidden cases, which students are spread over
FOLDER = Path(__file__).with_name("questions")


def write_assignment(folder: Path, secret: bytes = b"") -> list[Path]:
    """Compute the assignment and write its files into an existing folder; which ones, is returned.

    The hidden cases are drawn from the `secret`; without one they are public.

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
    with ProcessPoolExecutor() as pool:
        drawn = chain([first], pool.map(others, range(1, VARIANTS)))
        for variant, cases in enumerate(tqdm(drawn, "variants", VARIANTS, disable=None)):
            files[hidden / f"variant_{variant}.json"] = cases_file(cases)
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
    """The text of `course.json`: stand-ins for wrong functions, and what the secret leads to."""
    right = {one.id: stand_in(one.function) for one in questions}
    return _text({"public": not secret, "salt": salt_of(secret), "right": right})


def stand_in(function: str) -> str:
    """Source that defines a right function, and nothing else that can be reached by a name.

    >>> names = {}
    >>> exec(stand_in("align"), names)
    >>> sorted(name for name in names if name != "__builtins__")
    ['align']
    """
    body = textwrap.indent(inspect.getsource(solution), "    ")
    return f"def _right():\n{body}    return {function}\n\n\n{function} = _right()\ndel _right\n"


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
        "docstring": table["docstring"].strip() + "\n",
        "answer": Answer(table["answer"]),
    }
    return Question(id=id, function=id, misconceptions=known, **given)
