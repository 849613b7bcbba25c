"""Outcomes of calls, and the verdicts on them: one for each case, question and submission.

Verdicts are plain frozen data that goes to JSON and back without loss, so that one can be stored
as soon as it is known and every report and export reads the same thing. All texts are for the
student: none holds a hidden input, an expected value or a traceback.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from html import escape

from labkit.course.grading.inside.data import Value

KILLED, NOT_DEFINED, CELL_FAILED = "Killed", "NotDefined", "CellFailed"
NO_RESULT = "NoResult"  # of a hidden case, whatever ended the call


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """The outcome of one call: a value or, with an `error`, none.

    The error is the name of an exception, of the box's own among them (`OutOfTime`,
    `NotDataError`, `TooMuchError`), or one of the three above. The `message` is the student's,
    "IndexError: ... (line 3 of cell 7)", or what the box saw: at most 600 printable characters.
    A student can write any text there, the arguments of this call among it: of a hidden case it
    is never shown.
    """

    value: Value = None  # rebuilt outside, bounds checked; NaN is data
    error: str = ""
    message: str = ""


@dataclass(frozen=True, kw_only=True)
class CaseVerdict:
    """Verdict on one call of the student's function.

    `id` is the case within its question. `reason` holds one or two sentences, or nothing where all
    is well; that of a `hidden` case tells no number.
    """

    id: str
    hidden: bool
    passed: bool
    reason: str


@dataclass(frozen=True, kw_only=True)
class QuestionVerdict:
    """Verdict on one question.

    `misconception` is the id of the known mistake that explains all wrong answers, `message` what
    to tell the student of the whole. `replaced` names the functions of earlier questions that are
    wrong and that right ones stood in for when this question was graded once more: the score is
    the better of the two.
    """

    question: str
    title: str
    points: float
    score: float
    cases: tuple[CaseVerdict, ...]
    misconception: str | None
    message: str
    replaced: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """True if the question gave all its points."""
        return self.score >= self.points

    @property
    def cases_passed(self) -> str:
        """Count of the cases that pass: "3 of 4 cases pass."."""
        return f"{sum(case.passed for case in self.cases)} of {len(self.cases)} cases pass."


@dataclass(frozen=True, kw_only=True)
class SubmissionVerdict:
    """Verdict on one submission.

    `mode` is the isolation that it ran in. `notes` say what else the student should know,
    `unread` what was not read and why, `adjustments` what an instructor changed. `late` counts
    days. `seconds` is the only part that differs from run to run.
    """

    student: str
    submission: str
    mode: str
    questions: tuple[QuestionVerdict, ...]
    score: float
    points: float
    notes: tuple[str, ...]
    seconds: float
    unread: tuple[str, ...] = ()
    late: float = 0.0
    adjustments: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks for the student on how the submission was read."""
        return self.adjustments + self.unread + self.notes


def short(value: float) -> str:
    """A score as people write it.

    >>> short(3.0), short(2.5), short(1 / 3)
    ('3', '2.5', '0.33')
    """
    return f"{value:.2f}".rstrip("0").rstrip(".")


def to_html(text: str) -> str:
    """Text as HTML: a student's own is escaped, whatever stands in it.

    >>> to_html("`x` < 2")
    '<code>x</code> &lt; 2'
    """
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))
