"""`check`, for the notebook: what the grading says of a function, on the cases one may see.

It runs the function in the notebook's own process, so it is a help and no examination. The
hidden cases are not needed; the students' edition does not have them.
"""

from __future__ import annotations

import contextlib
import copy
import dis
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape
from types import CodeType
from typing import Any

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.assignment.questions import Case, Question
from labkit.course.grading.contract import Outcome, OutcomeStatus
from labkit.course.grading.feedback import to_html
from labkit.course.grading.inside.data import NotDataError, TooMuchError, plain
from labkit.course.grading.judging.compare import assess
from labkit.course.grading.judging.verdict import QuestionVerdict
from labkit.errors import InvalidParameterError

LONGEST_ERROR = 500
STATUS: dict[type[BaseException], OutcomeStatus] = {
    NotDataError: OutcomeStatus.NOT_DATA,
    TooMuchError: OutcomeStatus.TOO_LARGE,
}
OUTSIDE = {"LOAD_GLOBAL", "LOAD_NAME", "IMPORT_NAME"}


@dataclass(frozen=True)
class Feedback:
    """The verdict on a function by its visible cases, as a notebook shows it."""

    verdict: QuestionVerdict

    @property
    def passed(self) -> bool:
        """Whether all visible cases pass."""
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
    asked = assignment.question(question)
    verdict = tried(asked, assignment.cases(question), own(asked, function))
    if not verdict.passed:
        used = used_by(function)
        for one in assignment.questions:
            other: Any = used.get(one.function)
            mine = one is not asked and callable(other)
            if mine and not tried(one, assignment.cases(one.id), other).passed:
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
    return tried(asked, assignment.cases(question, student), own(asked, function)).score


def tried(
    question: Question, cases: Sequence[Case], function: Callable[..., Any]
) -> QuestionVerdict:
    """The verdict on a function that is called here."""
    return assess(question, cases, [_outcome(case, function) for case in cases])


def own(question: Question, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, if it is one and needs no labkit, which the grading does not have."""
    if not callable(function):
        raise InvalidParameterError(
            f"must be the function itself, as in "
            f'check("{question.id}", {question.function}), got {type(function).__name__}',
            parameter="function",
        )
    for name, used in ({question.function: function} | used_by(function)).items():
        home = used if isinstance(used, str) else getattr(used, "__module__", None)
        home = home or getattr(used, "__name__", None) or ""
        if f"{home}.".startswith("labkit.") and not home.startswith("labkit.course.authoring"):
            where = "it" if used is function else f"`{name}`"
            raise InvalidParameterError(
                f"must be your own, got one that takes {where} from {home}, which the grading does "
                f"not have; write that part yourself, and run the cell that defines your "
                f"`{question.function}` again",
                parameter="function",
            )
    return function


def used_by(function: Callable[..., Any]) -> dict[str, Any]:
    """What a function, and those of its notebook that it calls, take from outside, by name."""
    waiting, found = [function], dict[str, Any]()
    while waiting:
        one = waiting.pop()
        known = getattr(one, "__globals__", {})
        for name in _names(getattr(one, "__code__", None)):
            if name not in found:
                found[name] = known.get(name, name)
                if getattr(found[name], "__globals__", None) is known:
                    waiting.append(found[name])
    return found


def _names(code: CodeType | None) -> Iterator[str]:
    """The global names and imports of a function and of those inside it."""
    if code is not None:
        yield from (i.argval for i in dis.get_instructions(code) if i.opname in OUTSIDE)
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                yield from _names(constant)


def _outcome(case: Case, function: Callable[..., Any]) -> Outcome:
    try:
        with contextlib.redirect_stderr(sys.stdout):  # a warning there costs nbgrader's points
            value = plain(function(*copy.deepcopy(case.arguments)))
        return Outcome(id=case.id, status=OutcomeStatus.RETURNED, value=value)
    except (Exception, SystemExit) as error:  # the student's own, whatever it is
        status = STATUS.get(type(error), OutcomeStatus.RAISED)
        name, said, trace = type(error).__name__, "", error.__traceback__
        with contextlib.suppress(Exception, SystemExit):  # it may raise another one instead
            said = str(error)
        if status is OutcomeStatus.RAISED:
            line = (
                f" (line {trace.tb_next.tb_lineno} of its cell)" if trace and trace.tb_next else ""
            )
            said = f"{name}: {said}"[:LONGEST_ERROR] + line
        return Outcome(id=case.id, status=status, message=said, error=name)
