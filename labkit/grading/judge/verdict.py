"""Outcomes of calls, and the verdicts on them: one for each case, question and submission.

Verdicts go to JSON and back without loss. All texts are for the student: none holds a hidden
input, an expected value or a traceback.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from html import escape
from typing import Any

from labkit.grading.box.inside.data import Value, from_json


class Status(StrEnum):
    """How a call ended."""

    RETURNED = "returned"
    RAISED = "raised"
    NOT_WRITTEN = "not written"  # it raised NotImplementedError, as its stub does
    NO_ANSWER = "no answer"  # what it returned is no plain data
    CHANGED = "changed"  # it wrote into its arguments
    TOO_LONG = "too long"
    KILLED = "killed"  # the program ended in it
    NOT_DEFINED = "not defined"
    NO_RESULT = "no result"  # of a hidden case that was not just too long; more is not told


FROM_BOX = (Status.RAISED, Status.NOT_WRITTEN, Status.NO_ANSWER, Status.TOO_LONG)


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """The outcome of one call: a value or, with an `error`, none.

    A student can write any text into the `message`, the arguments of this call among it: of a
    hidden case it is never shown.
    """

    value: Value = None  # rebuilt outside, bounds checked; NaN is data
    status: Status = Status.RETURNED
    error: str = ""  # name of the exception, where it raised one
    message: str = ""  # as "IndexError: ... (line 3 of cell 7)"
    unwritten: str = ""  # the function that is not written yet: this one, or one that it calls
    is_writing: bool = False  # it wrote into an argument
    tried: bool = True  # False where it is known without a call, as after one that took too long


def read_outcome(reply: Mapping[str, Any]) -> Outcome:
    """Read what `box.inside.calling` says of a call; `ValueError` for anything else."""
    try:
        if "status" not in reply:
            value = from_json(reply["value"])
            return Outcome(value=value, is_writing=bool(reply.get("is_writing")))
        status = Status(reply["status"])
    except (KeyError, RecursionError) as error:
        raise ValueError(str(error)) from None
    if status not in FROM_BOX:
        raise ValueError(f"no call ends so: {status}")
    error_name, unwritten = (str(reply.get(name, "")) for name in ("error", "unwritten"))
    return Outcome(
        status=status,
        error=error_name if error_name.isidentifier() else "Exception",
        message=clean_text(reply.get("message") or ""),
        unwritten=unwritten if unwritten.isidentifier() else "",
    )


def withhold(outcome: Outcome) -> Outcome:
    """The outcome of a hidden case that is not right, without anything that tells its arguments.

    A student's code may say them by a text, by a value, and by the way in which it ends.
    """
    if not outcome.tried:
        return outcome  # no code ran
    is_told = outcome.status in (Status.TOO_LONG, Status.NOT_DEFINED)
    return Outcome(status=outcome.status if is_told else Status.NO_RESULT)


def clean_text(message: object) -> str:
    """A student's text without what a terminal or a page would not print, and cut."""
    return "".join(letter if letter.isprintable() else " " for letter in str(message)[:600])


@dataclass(frozen=True, kw_only=True)
class CaseVerdict:
    """Verdict on one call of the student's function."""

    id: str  # of the case within its question
    hidden: bool
    passed: bool
    reason: str  # a few sentences, or "" where it passes; that of a hidden case tells no number
    status: Status = Status.RETURNED


@dataclass(frozen=True, kw_only=True)
class QuestionVerdict:
    """Verdict on one question."""

    question: str
    title: str
    points: float
    score: float
    cases: tuple[CaseVerdict, ...] = ()
    misconception: str | None = None  # id of the known mistake that explains all wrong answers
    message: str = ""  # what to tell the student of the whole
    replaced: tuple[str, ...] = ()  # functions that right ones stood in for, with a better score

    @property
    def passed(self) -> bool:
        """True if the question gave all its points."""
        return self.score >= self.points

    @property
    def is_written(self) -> bool:
        """False where the function is still as it was handed out."""
        return any(case.status != Status.NOT_WRITTEN for case in self.cases)

    @property
    def cases_passed(self) -> str:
        """Count of the cases that pass: "3 of 4 cases pass."."""
        return f"{sum(case.passed for case in self.cases)} of {len(self.cases)} cases pass."


@dataclass(frozen=True, kw_only=True)
class SubmissionVerdict:
    """Verdict on one submission."""

    student: str
    submission: str  # the student's name for a person
    mode: str  # isolation that it ran in
    questions: tuple[QuestionVerdict, ...]
    score: float
    points: float
    notes: tuple[str, ...] = ()  # what else the student should know
    seconds: float = 0.0  # the only part that differs from run to run
    unread: tuple[str, ...] = ()  # what was not read, and why
    late: float = 0.0  # days
    late_percent: float = 0.0  # what they cost
    bonus: float = 0.0  # points on top
    is_graded: bool = True  # False where no code could be read, and nobody gave points
    is_excused: bool = False  # by an instructor: there is no mark
    is_waiting: bool = False  # for points of written answers, which are worth some
    adjustments: tuple[str, ...] = ()  # what an instructor changed

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks for the student on how the submission was read."""
        return self.adjustments + self.unread + self.notes


def short(value: float) -> str:
    """A score as people write it: 3, 2.5 or 0.33."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def to_html(text: str) -> str:
    """Text as HTML: a student's own is escaped, whatever stands in it.

    >>> to_html("`x` < 2")
    '<code>x</code> &lt; 2'
    """
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))
