"""`check`, for the notebooks: it tries a function, and says what is wrong with it.

It runs the function in the notebook's own process, so it is a help and no examination. For the
assignment's questions it asks the cases that everybody may see.
"""

from __future__ import annotations

import contextlib
import copy
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from importlib import import_module
from pkgutil import iter_modules
from types import FrameType, FunctionType
from typing import Any

import numpy as np

import labkit.course.exercises as chapters
from labkit.course.assignment import load_assignment, load_plain_answers
from labkit.course.exercises.entries import ENTRIES, exercise
from labkit.course.exercises.stages import Stages, stages_of
from labkit.grading.box.inside.calling import OutOfTime, call_function, limit_time
from labkit.grading.judge.compare import assess
from labkit.grading.judge.verdict import Outcome, QuestionVerdict, Status, read_outcome, to_html
from labkit.grading.questions import Case, Question
from labkit.support.errors import InvalidParameterError

Calls = set[tuple[str, str]]  # of functions, by name and module
SECONDS = 10.0  # of processor time for all cases of a check
AGAIN = 1.0  # [s] after which a check is interrupted again
PATIENT = ("numba", "llvmlite", "pdb", "bdb")  # compiling and debugging are not counted
HINTS = {  # what a message of numpy means here
    r"matmul: Input operand 1 has a mismatch": "a (3, 3) transform does not multiply (N, 2) "
    "points: apply(T, points) moves them, in this order",
    r"arrays used as indices must be of integer": "are indices and distances exchanged? A search "
    "returns the indices first",
    r"boolean index did not match": "a mask has one entry for each source point: it selects pairs, "
    "so it goes with the moved points and with their partners, `target[index]`",
    r"got nan at index": "a normal is nan where a target point has too few neighbours: leave these "
    "pairs out",
}


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
        if self.passed:
            return "✓"
        return "✗" if self.verdict.is_written else "○"

    @property
    def _reasons(self) -> list[str]:
        return [case.reason for case in self.verdict.cases if case.reason and self._mark == "✗"]


def check(function: Callable[..., Any]) -> Feedback:
    """Try a function on the examples of its exercise or question, and say what is wrong with it.

    Parameters
    ----------
    function : callable
        The function itself, under the name that its stub has: defined there, or assigned to it, as
        a lambda or any other callable is. It gets copies of its arguments, and ten seconds for all
        of them.

    Returns
    -------
    Feedback
        Shows itself as the last line of a cell; ``passed`` tells whether every case is right.

    Raises
    ------
    InvalidParameterError
        For what is no function of an exercise; for a function of the assignment that uses labkit.

    Examples
    --------
    >>> def motion_between(T_w_k, T_w_k1):
    ...     return T_w_k1 @ np.linalg.inv(T_w_k)
    >>> print(check(motion_between).passed)
    False
    """
    space = sys._getframe(1).f_globals
    assignment = load_assignment(hidden=False)
    questions = {question.function: question for question in assignment.questions}
    name = _name(function, [*questions, *exercises()], space)
    if name not in questions:
        entry = exercises()[name]
        verdict = judge_exercise(entry, function)
        if not verdict.is_written:
            verdict = replace(verdict, message=verdict.message + _name_twin(entry, space))
        return Feedback(verdict)
    question = questions[name]
    called = Calls()
    verdict = _judge_own_code(question, assignment.cases(question.id), function, called)
    if verdict.passed:
        return Feedback(verdict)
    cases = assignment.cases(question.id)
    outcomes = _outcomes(cases, function)
    verdict = _ask_by_stages(question, cases, outcomes, function, _plainer(question), verdict)
    names = {name for name, _ in called}
    for part in assignment.questions:
        callee: Any = getattr(function, "__globals__", space).get(part.function)
        if part is question or part.function not in names or not callable(callee):
            continue
        if not judge_function(part, assignment.cases(part.id), callee).passed:
            cause = f"It uses your `{part.function}`, which fails its own check: mend that first"
            return Feedback(replace(verdict, message=f"{cause}. {verdict.message}"))
    return Feedback(verdict)


def score(function: Callable[..., Any]) -> float:
    """The points of a function, by the hidden cases; for nbgrader's hidden tests.

    nbgrader runs a student's code in the process that grades it. This cannot mend that:
    marks that have to hold come from ``labkit grade``.

    Raises
    ------
    LabkitError
        In the students' edition, which has no hidden cases.
    """
    assignment = load_assignment()
    questions = {question.function: question for question in assignment.questions}
    question = questions[_name(function, questions.keys(), sys._getframe(1).f_globals)]
    return _judge_own_code(question, assignment.cases(question.id), function, Calls()).score


def exercises() -> dict[str, exercise]:
    """All exercises of the chapters, by the name of their function."""
    for module in iter_modules(chapters.__path__):
        import_module(f"{chapters.__name__}.{module.name}")
    return {
        name: entry
        for name, entry in ENTRIES.items()
        if entry.right.__module__.startswith(chapters.__name__)
    }


def _name(function: Callable[..., Any], names: Collection[str], space: Mapping[str, Any]) -> str:
    """The name that is asked for: the function's own, or that which it has in a space."""
    own = getattr(function, "__name__", None)
    if own in names:
        return str(own)
    assigned = [name for name in names if space.get(name) is function]
    if callable(function) and assigned:
        return assigned[0]
    if not callable(function) or own is None:
        raise InvalidParameterError(
            f"`function` must be the function itself, as in check(rotation), "
            f"got {type(function).__name__}"
        )
    raise InvalidParameterError(
        f"no exercise asks for a function named {own!r}; leave the name as its stub has it"
    )


def _name_twin(entry: exercise, space: Mapping[str, Any]) -> str:
    """A sentence on a function of the notebook with the exercise's parameters and another name."""
    parameters = parameters_of(entry.right)
    for name, other in space.items():
        is_own = isinstance(other, FunctionType) and other.__globals__ is space
        if not is_own or parameters_of(other) != parameters:
            continue
        asked = exercises().get(name)
        if asked is None or parameters_of(asked.right) != parameters:
            own_name = entry.right.__name__
            return f" Your `{name}` has its parameters: rename it to `{own_name}`?"
    return ""


def parameters_of(function: Callable[..., Any]) -> set[str]:
    """The names of a function's parameters."""
    return set(inspect.signature(function).parameters)


def judge_exercise(entry: exercise, function: Callable[..., Any]) -> QuestionVerdict:
    """The verdict on a function of a chapter."""
    question, cases = entry.asked
    outcomes = _outcomes(cases, function, in_place=False)  # later cells read the arguments
    verdict = assess(question, cases, outcomes)
    if verdict.passed:
        return replace(verdict, message="right in every case.")
    return _ask_by_stages(question, cases, outcomes, function, entry.plainer, verdict)


def judge_function(
    question: Question,
    cases: Sequence[Case],
    function: Callable[..., Any],
    called: Calls | None = None,
) -> QuestionVerdict:
    """The verdict on a function that is called here; `called` takes all that it calls in turn."""
    return assess(question, cases, _outcomes(cases, function, called))


def _ask_by_stages(
    question: Question,
    cases: Sequence[Case],
    outcomes: Sequence[Outcome],
    function: Callable[..., Any],
    plainer: Callable[[Case], dict[str, Case]],
    verdict: QuestionVerdict,
) -> QuestionVerdict:
    """The verdict, with what plainer calls show; with a mistake's name only where it fits them."""
    if not verdict.is_written or any(o.status is Status.TOO_LONG for o in outcomes):
        return verdict
    try:
        with limit_time(SECONDS, again=AGAIN, is_patient=_is_patient):
            stages = Stages(
                question,
                cases,
                outcomes,
                lambda case: _outcome(case, function, None, True),
                plainer,
            )
            sentences = list(stages.sentences())
    except OutOfTime:
        return verdict
    if verdict.misconception is not None:
        if stages.fits(verdict.misconception):
            return verdict
        verdict = assess(replace(question, misconceptions=()), cases, outcomes)
        if verdict.misconception is not None:
            return verdict
    message = " ".join([verdict.message, *sentences])
    return replace(verdict, message=message)


def _judge_own_code(
    question: Question, cases: Sequence[Case], function: Callable[..., Any], called: Calls
) -> QuestionVerdict:
    """The verdict on a function that calls nothing of labkit, which the grading does not have."""
    verdict = judge_function(question, cases, function, called)
    for name, _ in filter(_is_labkits, called):
        raise InvalidParameterError(
            f"your function calls labkit's `{name}`, which is not available during grading; "
            f"write that part yourself, and run the cell that defines your "
            f"`{question.function}` again"
        )
    return verdict


def _plainer(question: Question) -> Callable[[Case], dict[str, Case]]:
    """From a visible case of the assignment to the cases of its stages."""
    answers = load_plain_answers()[question.id]

    def plainer(case: Case) -> dict[str, Case]:
        return {
            stage.phrase: replace(
                case,
                arguments=stage.arguments,
                expected=answers[case.id][stage.phrase],
                mistaken={},
            )
            for stage in stages_of(question, case.arguments)
            if stage.phrase in answers[case.id]
        }

    return plainer


def _is_labkits(call: tuple[str, str]) -> bool:
    """True if a call leads into labkit, but for the timer here and for solutions."""
    own = (__name__, "labkit.course.authoring", "labkit.grading.box.inside.calling")
    return f"{call[1]}.".startswith("labkit.") and not call[1].startswith(own)


def _outcomes(
    cases: Sequence[Case],
    function: Callable[..., Any],
    called: Calls | None = None,
    *,
    in_place: bool = True,
) -> list[Outcome]:
    """The outcomes of all cases within the time for a check; once it is over, no more are asked."""
    outcomes = list[Outcome]()
    try:
        with limit_time(SECONDS, again=AGAIN, is_patient=_is_patient):
            for case in cases:
                outcomes.append(_outcome(case, function, called, in_place))
    except OutOfTime:
        late = Outcome(status=Status.TOO_LONG, message=f"it did not end within {SECONDS:g} seconds")
        untried = [replace(late, tried=False)] * len(cases)
        outcomes += [late, *untried][: len(cases) - len(outcomes)]
    return outcomes


def _is_patient(frame: FrameType | None) -> bool:
    while frame is not None:
        if str(frame.f_globals.get("__name__")).partition(".")[0] in PATIENT:
            return True
        frame = frame.f_back
    return False


def _outcome(
    case: Case, function: Callable[..., Any], called: Calls | None, in_place: bool
) -> Outcome:
    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and called is not None:
            called.add(call := (frame.f_code.co_name, str(frame.f_globals.get("__name__"))))
            if _is_labkits(call):
                raise RuntimeError("labkit is called")  # which ends the call

    def call(*arguments: Any) -> Any:
        previous = sys.getprofile()
        sys.setprofile(previous if called is None else note)
        try:
            return function(*arguments)
        finally:
            sys.setprofile(previous)

    arguments = copy.deepcopy(case.arguments)
    with contextlib.redirect_stderr(sys.stdout):  # a warning there costs nbgrader's points
        reply = call_function(call, arguments, _find_line, (Exception, SystemExit))
    changed = "" if in_place else _name_changed(function, arguments, case.arguments)
    if changed and "error" not in reply:
        return Outcome(status=Status.CHANGED, message=changed)
    outcome = read_outcome(reply)
    hints = [advice for sign, advice in HINTS.items() if re.search(sign, outcome.message)]
    return replace(outcome, message="; ".join([outcome.message, *hints[:1]]))


def _find_line(error: BaseException) -> str:
    """The line of a student's function in which an error was raised."""
    _, _, *frames = traceback.walk_tb(error.__traceback__)  # but for the calls here
    return f" (line {frames[0][1]} of its cell)" if frames else ""


def _name_changed(
    function: Callable[..., Any], now: Sequence[Any], originals: Sequence[Any]
) -> str:
    """The arguments that a call wrote into."""
    code = getattr(function, "__code__", None)
    names = list(getattr(code, "co_varnames", ()))
    names += [f"number {k + 1}" for k in range(len(names), len(now))]
    changed = []
    for name, value, original in zip(names, now, originals, strict=False):
        if isinstance(value, np.ndarray) and value.tobytes() != original.tobytes():
            changed.append(name)
    return ", ".join(changed)
