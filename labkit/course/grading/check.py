"""`check`, for the notebook: what the grading says of a function, on the cases one may see.

It runs the function in the notebook's own process, so it is a help and no examination. The
hidden cases are not needed; the students' edition does not have them.
"""

from __future__ import annotations

import contextlib
import copy
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.assignment.questions import Case, Question
from labkit.course.grading.contract import Outcome, OutcomeStatus
from labkit.course.grading.feedback import to_html
from labkit.course.grading.inside.data import NotDataError, TooMuchError, plain
from labkit.course.grading.judging.compare import assess
from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict
from labkit.errors import InvalidParameterError

MOST_BYTES = 8 << 20
LONGEST_ERROR = 500


@dataclass(frozen=True)
class Feedback:
    """The verdict on a function, as a notebook shows it.

    Attributes
    ----------
    verdict : QuestionVerdict
        What is shown; its score counts the visible cases alone.
    """

    verdict: QuestionVerdict

    @property
    def passed(self) -> bool:
        """Whether all visible cases pass."""
        return self.verdict.passed

    def __repr__(self) -> str:
        """Head line, message and one line for each case that failed."""
        lines = [f"{self._mark} {self.verdict.title}: {self.verdict.message}"]
        lines += [f"  - {case.reason}" for case in self._failed]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        color = {"✓": "#2a7f3f", "✗": "#b3541e"}.get(self._mark, "#777777")
        rows = "".join(f"<li>{to_html(case.reason)}</li>" for case in self._failed)
        reasons = f'<ul style="margin: 0.3em 0">{rows}</ul>' if rows else ""
        return (
            f'<div style="border-left: 4px solid {color}; padding: 0.3em 0.8em; margin: 0.3em 0">'
            f"<strong>{self._mark} {escape(self.verdict.title)}:</strong> "
            f"{to_html(self.verdict.message)}{reasons}</div>"
        )

    @property
    def _unwritten(self) -> bool:
        return self.verdict.message.endswith("is not written yet.")

    @property
    def _mark(self) -> str:
        return "✓" if self.passed else "○" if self._unwritten else "✗"

    @property
    def _failed(self) -> list[CaseVerdict]:
        return [case for case in self.verdict.cases if case.reason and not self._unwritten]


def check(question: str, function: Callable[..., Any]) -> Feedback:
    """Try a function on the examples of its question, and say what is wrong with it.

    Parameters
    ----------
    question : str
        The question's id, as it stands in the notebook.
    function : callable
        The function to try. It gets copies: it may change its arguments.

    Returns
    -------
    Feedback
        Shows itself as the last line of a cell.

    Raises
    ------
    InvalidParameterError
        For a question that does not exist, or what is no function of the student's.

    Examples
    --------
    >>> def distance_gate(distances, max_distance):
    ...     return distances < max_distance
    >>> print(check("distance_gate", distance_gate).verdict.misconception)
    strict
    """
    assignment = load_assignment(hidden=False)
    return Feedback(_assessed(assignment.question(question), assignment.cases(question), function))


def score(question: str, function: Callable[..., Any], student: str = "") -> float:
    """The points of a function, by its hidden cases; for nbgrader's hidden tests.

    nbgrader runs a student's code in the process that grades it. This cannot mend that:
    marks that have to hold come from ``labkit grade``.

    Parameters
    ----------
    question, function
        As for `check`.
    student : str
        Whose variant of the hidden cases is asked.

    Returns
    -------
    float
        In [0, points of the question].

    Raises
    ------
    LabkitError
        In the students' edition, which has no hidden cases.
    """
    assignment = load_assignment()
    cases = assignment.cases(question, student)
    return _assessed(assignment.question(question), cases, function).score


def _assessed(
    question: Question, cases: Sequence[Case], function: Callable[..., Any]
) -> QuestionVerdict:
    if not callable(function):
        raise InvalidParameterError(
            f"must be the function itself, as in "
            f'check("{question.id}", {question.function}), got {type(function).__name__}',
            parameter="function",
        )
    home = getattr(function, "__module__", None) or ""
    if home.startswith("labkit.") and not home.startswith(
        ("labkit.course.authoring", "labkit.course.grading")
    ):
        raise InvalidParameterError(
            f"must be your own, got the one that was imported from {home}, which the "
            f"grading does not have; run the cell that defines your `{question.function}` again",
            parameter="function",
        )
    return assess(question, cases, [_outcome(case, function) for case in cases])


def _outcome(case: Case, function: Callable[..., Any]) -> Outcome:
    start = time.perf_counter()
    status, value, message, error = OutcomeStatus.RETURNED, None, "", ""
    try:
        with contextlib.redirect_stderr(sys.stdout):  # a warning there costs nbgrader's points
            value = plain(function(*map(_writable, case.arguments)), MOST_BYTES)
    except NotDataError as why:
        status, message = OutcomeStatus.NOT_DATA, str(why)
    except TooMuchError as why:
        status, message = OutcomeStatus.TOO_LARGE, str(why)
    except (Exception, SystemExit) as why:  # the student's own, whatever it is
        status, error = OutcomeStatus.RAISED, type(why).__name__
        message = f"{error}: {_text_of(why)}"[:LONGEST_ERROR] + _line_of(why)
    seconds = time.perf_counter() - start
    return Outcome(
        id=case.id, status=status, value=value, message=message, error=error, seconds=seconds
    )


def _writable(argument: Any) -> Any:
    return copy.deepcopy(argument)


def _text_of(error: BaseException) -> str:
    """Its message, or none where it raises another error instead of saying it."""
    with contextlib.suppress(Exception, SystemExit):
        return str(error)
    return ""


def _line_of(error: BaseException) -> str:
    """Where in the student's function it was raised."""
    trace = error.__traceback__
    line = 0
    while trace is not None and (trace := trace.tb_next) is not None:
        line = line or trace.tb_lineno
    return f" (line {line} of its cell)" if line else ""
