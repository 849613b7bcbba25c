"""`check`, for the notebook: what the grading says of a function, on the cases one may see.

It runs the function in the notebook's own process, so it is a help and no examination. The
hidden cases are not needed; the students' edition does not have them.
"""

from __future__ import annotations

import contextlib
import copy
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from html import escape
from types import FrameType
from typing import Any

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.assignment.questions import Case, Question
from labkit.course.grading.inside.data import NoAnswerError, plain, said_of
from labkit.course.grading.judging.compare import assess
from labkit.course.grading.judging.verdict import Outcome, QuestionVerdict, to_html
from labkit.support.errors import InvalidParameterError

Calls = set[tuple[str, str]]  # of functions, by name and module


@dataclass(frozen=True)
class Feedback:
    """The verdict on a function by its visible cases, as a notebook shows it."""

    verdict: QuestionVerdict

    @property
    def passed(self) -> bool:
        """True if all visible cases pass."""
        return self.verdict.passed

    def __repr__(self) -> str:
        """Head line, message and one line for each case that failed."""
        lines = [f"{self._mark} {self.verdict.title}: {self.verdict.message}"]
        return "\n".join(lines + [f"  - {reason}" for reason in self._reasons])

    def _repr_html_(self) -> str:
        color = {"✓": "#2a7f3f", "✗": "#b3541e"}.get(self._mark, "#777777")
        rows = "".join(f"<li>{to_html(reason)}</li>" for reason in self._reasons)
        reasons = f'<ul style="margin: 0.3em 0">{rows}</ul>' if rows else ""
        return (
            f'<div style="border-left: 4px solid {color}; padding: 0.3em 0.8em; margin: 0.3em 0">'
            f"<strong>{self._mark} {escape(self.verdict.title)}:</strong> "
            f"{to_html(self.verdict.message)}{reasons}</div>"
        )

    @property
    def _mark(self) -> str:
        unwritten = self.verdict.message.endswith("is not written yet.")
        return "✓" if self.passed else "○" if unwritten else "✗"

    @property
    def _reasons(self) -> list[str]:
        return [case.reason for case in self.verdict.cases if case.reason and self._mark == "✗"]


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
        For a question that does not exist, and for a function that is not the student's or that
        uses labkit.
    """
    assignment = load_assignment(hidden=False)
    asked, called = assignment.question(question), Calls()
    verdict = _own(asked, assignment.cases(question), function, called)
    names = {name for name, _ in called}
    for one in assignment.questions if not verdict.passed else ():
        other: Any = getattr(function, "__globals__", {}).get(one.function)
        if one is asked or one.function not in names or not callable(other):
            continue
        if not tried(one, assignment.cases(one.id), other).passed:
            cause = f"It uses your `{one.function}`, which fails its own check: mend that first"
            return Feedback(replace(verdict, message=f"{cause}. {verdict.message}"))
    return Feedback(verdict)


def score(question: str, function: Callable[..., Any], student: str = "") -> float:
    """The points of a function, by a student's hidden cases; for nbgrader's hidden tests.

    nbgrader runs a student's code in the process that grades it. This cannot mend that:
    marks that have to hold come from ``labkit grade``.

    Raises
    ------
    LabkitError
        In the students' edition, which has no hidden cases.
    """
    assignment = load_assignment()
    asked = assignment.question(question)
    return _own(asked, assignment.cases(question, student), function, Calls()).score


def tried(
    question: Question,
    cases: Sequence[Case],
    function: Callable[..., Any],
    called: Calls | None = None,
) -> QuestionVerdict:
    """The verdict on a function that is called here; `called` takes all that it calls in turn."""
    return assess(question, cases, [_outcome(case, function, called) for case in cases])


def _own(
    question: Question, cases: Sequence[Case], function: Callable[..., Any], called: Calls
) -> QuestionVerdict:
    """The verdict on a function that calls nothing of labkit, which the grading does not have."""
    if not callable(function):
        raise InvalidParameterError(
            f"must be the function itself, as in "
            f'check("{question.id}", {question.function}), got {type(function).__name__}',
            parameter="function",
        )
    verdict = tried(question, cases, function, called)
    for name, module in filter(_is_labkits, called):
        raise InvalidParameterError(
            f"must be your own, got one that calls `{name}` from {module}, which the grading "
            f"does not have; write that part yourself, and run the cell that defines your "
            f"`{question.function}` again",
            parameter="function",
        )
    return verdict


def _is_labkits(call: tuple[str, str]) -> bool:
    return f"{call[1]}.".startswith("labkit.") and not call[1].startswith("labkit.course.authoring")


def _outcome(case: Case, function: Callable[..., Any], called: Calls | None) -> Outcome:
    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and called is not None:
            called.add(call := (frame.f_code.co_name, str(frame.f_globals.get("__name__"))))
            if _is_labkits(call):
                raise RuntimeError("labkit is called")  # which ends the call

    arguments, before = copy.deepcopy(case.arguments), sys.getprofile()
    try:
        with contextlib.redirect_stderr(sys.stdout):  # a warning there costs nbgrader's points
            sys.setprofile(before if called is None else note)
            try:
                value = function(*arguments)
            finally:
                sys.setprofile(before)
        return Outcome(value=plain(value))
    except NoAnswerError as error:
        return Outcome(error=type(error).__name__, message=str(error))
    except (Exception, SystemExit) as error:  # the student's own, whatever it is
        where = error.__traceback__ and error.__traceback__.tb_next
        line = f" (line {where.tb_lineno} of its cell)" if where else ""
        return Outcome(error=type(error).__name__, message=said_of(error) + line)
