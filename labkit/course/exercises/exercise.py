"""Exercise: the right function, the cases that it is tried on, and its known mistakes."""

from __future__ import annotations

import copy
import importlib
import inspect
import pkgutil
from collections import UserDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

import labkit.course.exercises
from labkit.course.grading.assignment.questions import Answer, Case, Misconception, Question
from labkit.course.grading.check import Feedback, tried
from labkit.course.grading.judging.kinds import read
from labkit.errors import InvalidParameterError

Function = Callable[..., Any]
Arguments = Mapping[str, tuple[Any, ...]]
_FOUND: dict[str, Exercise] = {}
_source = cache(inspect.getsource)


@dataclass(frozen=True, eq=False)
class Exercise:
    """A function that students write."""

    title: str
    right: Function  # of the same name
    arguments: Callable[[], Arguments]  # makes what it is tried on, by words that say what
    mistakes: Mapping[str, Function]  # wrong ones, by the sentence that is said of them
    tolerance: float  # how far off an entry may be, relative to the largest of its result or to 1

    @cached_property
    def asked(self) -> tuple[Question, list[Case]]:
        """The exercise as the judge knows it."""
        cases = []
        for number, (about, arguments) in enumerate(self.arguments().items(), start=1):
            wanted = _data(self.right(*copy.deepcopy(arguments)))
            answer = _kind(wanted)
            sizes = np.abs(read(answer, wanted)) * (answer is not Answer.NUMBERS)
            cases.append(
                Case(
                    id=str(number),
                    hidden=False,
                    about=f"for {about}",
                    arguments=arguments,
                    expected=(wanted,),
                    tolerance=self.tolerance * sizes[np.isfinite(sizes)].max(initial=1.0),
                    mistaken=_Later(partial(self._mistaken, arguments)),
                )
            )
        known = (Misconception(id=one, says=one, chapter="", credit=0.0) for one in self.mistakes)
        names = inspect.signature(self.right).parameters
        question = Question(
            id=self.right.__name__,
            title=self.title,
            chapter="",
            points=float(len(cases)),
            function=self.right.__name__,
            signature=f"({', '.join(names)})",
            task="",
            docstring="",
            answer=answer,
            misconceptions=tuple(known),
        )
        return question, cases

    def _mistaken(self, arguments: tuple[Any, ...]) -> dict[str, tuple[Any, ...]]:
        """Answers of the mistakes, without those that fail."""
        found = {}
        for says, wrong in self.mistakes.items():
            try:
                with np.errstate(all="ignore"):
                    found[says] = (_data(wrong(*copy.deepcopy(arguments))),)
            except (ArithmeticError, ValueError, IndexError):
                continue
        return found


class _Later(UserDict[str, Any]):
    """A mapping that is computed when it is first asked: a stub and a right answer never do."""

    def __init__(self, compute: Callable[[], dict[str, Any]]) -> None:
        self._compute = compute

    @cached_property
    def data(self) -> dict[str, Any]:  # type: ignore[override]
        """All of it."""
        return self._compute()


def _data(value: Any) -> Any:
    return tuple(map(_data, value)) if isinstance(value, tuple) else np.asarray(value)


def _kind(right: Any) -> Answer:
    """The kind of answer, by the form of the right one."""
    if isinstance(right, tuple):
        return Answer.TRANSFORM if right[0].ndim == 2 else Answer.NUMBERS
    if right.dtype == bool:
        return Answer.MASK
    if right.ndim < 2:
        return Answer.VECTOR if right.ndim else Answer.NUMBER
    if right.shape != (3, 3):
        return Answer.POSES
    return Answer.TRANSFORM if np.array_equal(right[2], (0.0, 0.0, 1.0)) else Answer.MATRIX


def exercise(
    title: str,
    arguments: Arguments | Callable[[], Arguments],
    mistakes: Mapping[str, Function | Mapping[str, str]],
    *,
    tolerance: float = 1e-6,
) -> Callable[[Function], Function]:
    """Enter a right function as the check of the students' function of the same name."""

    def enter(right: Function) -> Function:
        assert right.__name__ not in _FOUND, f"{right.__name__} is checked twice"
        made = arguments if callable(arguments) else lambda: arguments
        wrong = {
            says: one if callable(one) else edited(right, one) for says, one in mistakes.items()
        }
        _FOUND[right.__name__] = Exercise(title, right, made, wrong, tolerance)
        return right

    return enter


def edited(right: Function, edits: Mapping[str, str]) -> Function:
    """The function with each text of `edits` replaced by another, wherever it stands in it."""
    _, head, source = _source(right).partition(f"def {right.__name__}(")
    for text, wrong in edits.items():
        assert text in source, f"{right.__name__} does not hold {text!r}, which a mistake replaces"
        source = source.replace(text, wrong)
    names: dict[str, Function] = {}
    exec(head + source, right.__globals__, names)
    return names[right.__name__]


def exercises() -> Mapping[str, Exercise]:
    """All exercises of the book, by the name of their function."""
    for module in pkgutil.iter_modules(labkit.course.exercises.__path__):
        importlib.import_module(f"labkit.course.exercises.{module.name}")
    return _FOUND


def check(function: Function) -> Feedback:
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
    if name not in exercises():
        raise InvalidParameterError(
            f"no exercise asks for a function named {name!r}; leave the name as its stub has it"
        )
    verdict = tried(*_FOUND[name].asked, function)
    return Feedback(replace(verdict, message="right in every case.") if verdict.passed else verdict)
