"""The assignment as data: questions, their cases, and the answers of known mistakes."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from labkit.course.grading.inside.data import Value
from labkit.support.errors import InvalidParameterError


class Answer(Enum):
    """Kinds of answers; `judging.kinds` reads each."""

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
    credit: float = 0.0  # the share of the question's points that it earns, in [0, 1)
    family: bool = False  # whether it holds for all questions; visible cases alone tell of it


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
    chance: float = 0.0  # share of right answers that a line without an idea gets; taken off
    misconceptions: tuple[Misconception, ...] = ()

    @property
    def stub(self) -> str:
        """The function as it is handed out."""
        return self.source("# YOUR CODE HERE\nraise NotImplementedError")

    def source(self, body: str) -> str:
        """The function with a body, whose lines are indented here."""
        lines = ['"""' + self.docstring + '"""', *body.splitlines()]
        text = "\n".join(lines).replace("\n", "\n    ")
        trimmed = "\n".join(line.rstrip() for line in text.splitlines())
        return f"def {self.function}{self.signature}:\n    {trimmed}"


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


Cases = Mapping[str, tuple[Case, ...]]
IMPORTS = "import numpy as np\n"  # what a right function may use


@dataclass(frozen=True, eq=False, kw_only=True)
class Assignment:
    """All questions and cases.

    Each of the `variants` holds the hidden cases, equally hard with other numbers; a student gets
    one of them.
    """

    title: str
    questions: tuple[Question, ...]  # in the order of the notebook
    visible: Cases  # the examples of each question, the same for everybody
    variants: tuple[Cases, ...]
    digest: str = ""  # of the files that it was read from: another digest, other verdicts
    right: Mapping[str, str] = field(default_factory=dict)  # the source of each right function
    salt: str = ""  # on which the choice of variants hangs
    public: bool = False  # whether anybody can compute the hidden cases

    @property
    def points(self) -> float:
        """Points of all questions together."""
        return sum(question.points for question in self.questions)

    def question(self, id: str) -> Question:
        """The question of that id; `InvalidParameterError` where there is none."""
        known = {question.id: question for question in self.questions}
        if id in known:
            return known[id]
        raise InvalidParameterError(
            f"must be one of {', '.join(known)}, got {id!r}", parameter="question"
        )

    def lent(self, id: str) -> str:
        """The source of a right function and of the earlier ones that it calls, and no more."""
        needed, found = {id}, [IMPORTS]
        for one in reversed(list(self.right)):  # what it calls comes before it
            if one in needed:
                needed.update(re.findall(r"\w+", self.right[one]))
                found.insert(1, self.right[one])
        return "\n\n".join(found)

    def answers(self, one: str, other: str) -> bool:
        """True if one right function takes all that the other does, and answers it outright."""
        mine, asked = self.question(one), self.question(other)
        takes = set(re.findall(r"\w+", asked.signature)) <= set(re.findall(r"\w+", mine.signature))
        return takes and mine.answer is asked.answer

    def variant(self, student: str) -> int:
        """The variant of a student: always the same one for the same name."""
        digest = hashlib.sha256((self.salt + student).encode("utf-8", "surrogatepass")).digest()
        return int.from_bytes(digest[:8], "big") % max(1, len(self.variants))

    def cases(self, question: str, student: str | None = None) -> tuple[Case, ...]:
        """The visible cases of a question, and a student's hidden ones where one is named."""
        visible = self.visible[self.question(question).id]
        if student is None or not self.variants:
            return visible
        return visible + self.variants[self.variant(student)][question]
