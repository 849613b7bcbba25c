"""The assignment as data: questions, their cases, answers of known mistakes, and their files.

`questions.json` and `visible.json` are for everybody; `hidden/` is left out of what students get.
Which folder holds them the course says (`labkit.course.assignment`).
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

from labkit.grading.box.inside.data import Value, from_json
from labkit.support.errors import LabkitError

FORMAT = 5
COURSE = "course.json"  # in `hidden/`: right functions, and whether a secret went in
CASES = "cases.json"  # in `hidden/`
WRITE = "write the assignment with `python -m labkit.course.authoring [--secret FILE]`"
LEAST = 16  # bytes of a secret


class Answer(Enum):
    """Kinds of answers; `judge.kinds` reads each."""

    MATRIX = "matrix"  # (2, 2) or (3, 3)
    VECTOR = "vector"  # (K,) of numbers with one unit
    NUMBERS = "numbers"  # several numbers or arrays, each with a unit of its own
    TRANSFORM = "transform"  # (R, t), a (3, 3), or a dict that holds either
    MATCHES = "matches"  # (indices, distances)
    MASK = "mask"  # (N,) of bool
    POSES = "poses"  # (K, 3), the last column an angle in (−π, π]
    NUMBER = "number"
    FLAG = "flag"  # one bool


@dataclass(frozen=True, kw_only=True)
class Misconception:
    """A known mistake."""

    id: str  # unique within its question
    says: str  # what the student did, and why it is wrong
    chapter: str = ""  # where the book explains it


@dataclass(frozen=True, kw_only=True)
class Question:
    """One function that the student writes."""

    id: str  # as in `check("huber_weights", ...)`
    title: str
    points: float
    function: str  # the name that the student's function must have
    signature: str  # as "(residuals, delta)"
    answer: Answer
    chapter: str = ""  # where the book explains it
    task: str = ""  # what to do, in Markdown; stands above the stub in the notebook
    docstring: str = ""  # what the stub says of arguments and result
    unit: str = ""  # of the result where it has one unit: "m" or "rad"
    low: float | None = None  # what the numbers of the result cannot go below
    high: float | None = None  # ... or above
    misconceptions: tuple[Misconception, ...] = ()

    @property
    def stub(self) -> str:
        """The function as it is handed out."""
        return self.source("# YOUR CODE HERE\nraise NotImplementedError")

    def source(self, body: str) -> str:
        """The function with a body, whose lines are indented here."""
        lines = ['"""' + self.docstring + '"""', *body.splitlines()]
        indented = "\n".join(lines).replace("\n", "\n    ")
        trimmed = "\n".join(line.rstrip() for line in indented.splitlines())
        return f"def {self.function}{self.signature}:\n    {trimmed}"

    def answers(self, question: Question) -> bool:
        """True if the right function takes all that another one does, and answers it outright."""
        takes = set(re.findall(r"\w+", self.signature))
        needed = set(re.findall(r"\w+", question.signature))
        return needed <= takes and self.answer is question.answer


@dataclass(frozen=True, eq=False, kw_only=True)
class Case:
    """One call of a question's function, and what is known about its answer.

    `mistaken` holds the answers of each misconception: several where the mistake leaves it open (a
    sign that the SVD may choose), none where it fails or ends where rounding leads it.
    """

    id: str  # unique within the question; says nothing about the case
    hidden: bool
    about: str  # what it tries, in words that give no number away: "a quarter turn"
    arguments: tuple[Value, ...]
    expected: tuple[Value, ...]  # one answer for each accepted reading of the lesson
    tolerance: float  # how far any entry may lie from the expected one
    mistaken: Mapping[str, tuple[Value, ...]]
    group: str = ""  # of hidden cases that give points together; "" for one by itself


Cases = Mapping[str, tuple[Case, ...]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Assignment:
    """All questions and cases."""

    title: str
    questions: tuple[Question, ...]  # in the order of the notebook
    visible: Cases  # the examples of each question, the same for everybody
    hidden: Cases  # those that grade; none in the students' edition
    digest: str = ""  # of the files that it was read from: another digest, other verdicts
    right: Mapping[str, str] = field(default_factory=dict)  # the source of each right function
    public: bool = False  # whether anybody can compute the hidden cases

    @property
    def points(self) -> float:
        """Points of all questions together."""
        return sum(question.points for question in self.questions)

    def question(self, id: str) -> Question:
        """The question of that id."""
        return {question.id: question for question in self.questions}[id]

    def source_to_lend(self, id: str) -> str:
        """The source of a right function and of the earlier ones that it calls, and no more."""
        needed = {id}
        sources = ["import numpy as np\n"]
        for name, source in reversed(list(self.right.items())):  # what it calls comes before it
            if name in needed:
                needed.update(re.findall(r"\w+", source))
                sources.insert(1, source)
        return "\n\n".join(sources)

    def cases(self, question: str) -> tuple[Case, ...]:
        """The visible cases of a question, and the hidden ones where there are any."""
        return self.visible[question] + self.hidden.get(question, ())


@cache
def read_assignment(folder: str | os.PathLike[str], *, hidden: bool = True) -> Assignment:
    """Read an assignment from its folder; a grader wants the `hidden` cases, a notebook has none.

    Raises `LabkitError` if a file is missing or of another format.
    """
    folder = Path(folder)
    digest = hashlib.sha256()
    head = _read(folder / "questions.json", digest)
    visible = _cases(_read(folder / "visible.json", digest), False)
    drawn: Cases = {}
    course: dict[str, Any] = {}
    if hidden:
        if not (folder / "hidden" / CASES).exists():
            raise LabkitError(
                f"{folder} holds no hidden cases: this is the students' edition; {WRITE}"
            )
        drawn = _cases(_read(folder / "hidden" / CASES, digest), True)
        if (folder / "hidden" / COURSE).exists():
            course = _read(folder / "hidden" / COURSE, digest)
    return Assignment(
        title=head["title"],
        questions=tuple(map(_question, head["questions"])),
        visible=visible,
        hidden=drawn,
        digest=digest.hexdigest(),
        **{name: course[name] for name in ("right", "public") if course},
    )


def _read(path: Path, digest: Any) -> dict[str, Any]:
    """The content of a file, which goes into the digest, too."""
    try:
        data = path.read_bytes()
        content: dict[str, Any] = json.loads(data)
        version = content.get("format") if isinstance(content, dict) else None
        if version != FORMAT:
            raise ValueError(f"it has format {version!r}, this labkit reads {FORMAT}")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", error)
        raise LabkitError(f"cannot read {path}: {reason}; {WRITE}") from None
    digest.update(data)
    return content


def _question(fields: dict[str, Any]) -> Question:
    misconceptions = tuple(Misconception(**mistake) for mistake in fields["misconceptions"])
    return Question(
        **fields | {"answer": Answer(fields["answer"]), "misconceptions": misconceptions}
    )


def _cases(content: dict[str, Any], hidden: bool) -> Cases:
    def values(trees: list[Any]) -> tuple[Any, ...]:
        return tuple(map(from_json, trees))

    def case(fields: dict[str, Any]) -> Case:
        fields |= {name: values(fields[name]) for name in ("arguments", "expected")}
        fields["mistaken"] = {id: values(answers) for id, answers in fields["mistaken"].items()}
        return Case(hidden=hidden, **fields)

    return {question: tuple(map(case, cases)) for question, cases in content["cases"].items()}


def cases_beside(path: str | os.PathLike[str]) -> Path:
    """The folder of the cases that are drawn from the secret in a file: ``course.secret.cases``."""
    return Path(f"{os.path.abspath(path)}.cases")


def refuse_outdated(drawn: Assignment, now: Assignment, secret: str | os.PathLike[str]) -> None:
    """Raise `LabkitError` where cases were drawn for other questions than there are now."""
    names = ("id", "title", "points", "signature", "docstring", "answer")
    for past, present in zip_longest(drawn.questions, now.questions):
        for name in names:
            drawn_value = getattr(past, name, None)
            value = getattr(present, name, None)
            if drawn_value != value:
                raise LabkitError(
                    f"{cases_beside(secret)} was drawn for an older assignment: the {name} of "
                    f"`{(present or past).id}` was {drawn_value!r} and is {value!r}. Draw it "
                    f"again: "
                    f"`python -m labkit.course.authoring --secret {os.fspath(secret)}`"
                )


def read_secret(path: Path) -> bytes:
    """The secret in a file, which is made for its owner alone where there is none."""
    try:
        if not path.exists():
            path.touch(mode=0o600)
            path.write_text(secrets.token_hex(32) + "\n", encoding="ascii")
        secret = path.read_bytes().strip()
    except OSError as error:
        raise LabkitError(f"cannot read or write {path}: {error.strerror}") from None
    if len(secret) < LEAST:
        problem = f"{path} holds {len(secret)} bytes, a secret needs {LEAST}"
        raise LabkitError(f"{problem}: remove it, and the same command makes one")
    return secret
