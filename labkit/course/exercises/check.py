"""`check`: try a student's function on the cases of its exercise and say what is wrong."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from labkit.course.exercises.exercise import Case, Exercise, exercises
from labkit.course.grading.check import Feedback
from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict
from labkit.errors import InvalidParameterError

LONGEST_ERROR = 300


def check(function: Callable[..., Any]) -> Feedback:
    """Try a function of an exercise, and say what is wrong with it.

    Parameters
    ----------
    function : callable
        The function itself, under the name that its stub has. It gets copies of its arguments.

    Returns
    -------
    Feedback
        Shows itself as the last line of a cell; ``passed`` tells whether every case is right.

    Raises
    ------
    InvalidParameterError
        For what is no function of an exercise.

    Examples
    --------
    >>> def motion_between(T_w_k, T_w_k1):
    ...     return T_w_k1 @ np.linalg.inv(T_w_k)
    >>> print(check(motion_between).passed)
    False
    """
    name = getattr(function, "__name__", None)
    if not callable(function) or name is None:
        raise InvalidParameterError(
            f"`function` must be the function itself, as in check(turn_about), "
            f"got {type(function).__name__}"
        )
    known = exercises()
    if name not in known:
        raise InvalidParameterError(
            f"no exercise asks for a function named {name!r}; leave the name as its stub has it"
        )
    return Feedback(_verdict(known[name], function))


def _verdict(exercise: Exercise, function: Callable[..., Any]) -> QuestionVerdict:
    verdicts = []
    for number, case in enumerate(exercise.cases(), start=1):
        try:
            answer = function(*copy.deepcopy(case.arguments))
        except NotImplementedError:
            message = f"`{exercise.name}` is not written yet."
            return _of(exercise, [], message)
        except Exception as error:  # the student's own, whatever it is
            said = f"{type(error).__name__}: {error}"[:LONGEST_ERROR]
            reason, mistake = f"for {case.where} it raises {said}{_line_of(error)}", None
        else:
            reason, mistake = _fault(case, answer)
        verdicts.append(
            CaseVerdict(
                id=str(number),
                hidden=False,
                credit=0.0 if reason else 1.0,
                reason=reason,
                misconception=mistake,
            )
        )
    wrong = [verdict for verdict in verdicts if not verdict.passed]
    named = [verdict.misconception for verdict in wrong if verdict.misconception]
    if not wrong:
        message = "right in every case." if len(verdicts) > 1 else "right."
    else:
        message = named[0] if named else f"{len(wrong)} of {len(verdicts)} cases are wrong."
    return _of(exercise, verdicts, message)


def _of(exercise: Exercise, cases: list[CaseVerdict], message: str) -> QuestionVerdict:
    passed = sum(case.passed for case in cases)
    named = {case.misconception for case in cases if case.misconception}
    return QuestionVerdict(
        question=exercise.name,
        title=exercise.title,
        points=float(max(1, len(cases))),
        score=float(passed),
        cases=tuple(cases),
        misconception=named.pop() if len(named) == 1 else None,
        message=message,
    )


def _fault(case: Case, answer: Any) -> tuple[str, str | None]:
    """What is wrong with an answer, empty if nothing is, and the known mistake that it is."""
    if answer is None:
        return f"for {case.where} it returns nothing; is the `return` missing?", None
    off = _off(answer, case.right)
    if isinstance(off, str):
        return f"for {case.where} {off}.", None
    if off <= case.tolerance * _scale(case.right):
        return "", None
    reason = f"for {case.where} the result is off by {'up to ' * _many(case.right)}{off:.2g}."
    for says, value in case.mistakes.items():
        near = _off(answer, value)
        if not isinstance(near, str) and near <= case.tolerance * _scale(value):
            return reason, says
    return reason, None


def _off(answer: Any, wanted: Any) -> float | str:
    """The largest difference of any number, or in words why there is none."""
    if isinstance(wanted, tuple):
        if not isinstance(answer, tuple | list) or len(answer) != len(wanted):
            return f"it should return {len(wanted)} values, as a tuple"
        parts = [_off(a, w) for a, w in zip(answer, wanted, strict=True)]
        texts = [part for part in parts if isinstance(part, str)]
        return texts[0] if texts else max(part for part in parts if not isinstance(part, str))
    try:
        got = np.asarray(answer, dtype=float)
    except (TypeError, ValueError):
        return f"it returns a {type(answer).__name__}, where numbers are expected"
    right = np.asarray(wanted, dtype=float)
    if got.shape != right.shape:
        return f"the result has shape {got.shape}, expected {right.shape}"
    if (np.isfinite(got) != np.isfinite(right)).any():
        return "the result holds NaN or infinity; look for a division by zero"
    finite = np.isfinite(right)
    return float(np.abs(got - right)[finite].max(initial=0.0))


def _scale(right: Any) -> float:
    parts = right if isinstance(right, tuple) else (right,)
    finite = [np.nan_to_num(np.abs(np.asarray(part, float)), posinf=0.0) for part in parts]
    return max(1.0, *(float(part.max(initial=0.0)) for part in finite))


def _many(right: Any) -> bool:
    return isinstance(right, tuple) or np.size(right) > 1


def _line_of(error: BaseException) -> str:
    trace = error.__traceback__
    trace = trace.tb_next if trace is not None else None
    return f" (line {trace.tb_lineno} of its cell)" if trace is not None else ""
