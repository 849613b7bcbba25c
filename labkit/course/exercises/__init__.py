"""Checks for the exercises of the chapters: they try a function and name the mistake.

In a chapter an exercise with code is one cell with the tag ``stub``, below its text::

    def turn_about(c, theta):
        '''Transform (3, 3) that turns the plane by `theta` [rad] about the point `c` (2,).'''
        raise NotImplementedError  # your code here


    check(turn_about)

The stub keeps quiet as long as nothing is written, so the chapter runs from end to end. The
solution stands below it, in cells with the tag ``solution``, and ends in the same call of
`check`; the students' edition takes these cells away and keeps the stub. What follows and needs
the function stands below ``if check(turn_about).passed:``.

**To add an exercise**, write a right function of the same name in the module of its chapter's
topic here, what it is tried on, and the mistakes that it knows (a new module is found by itself)::

    @exercise("Turn about a point", {
        "a turn by 0.7 rad about (2, −1)": (np.array([2.0, -1.0]), 0.7),
    }, {
        "This turns about the origin: bring `c` there first.": lambda c, theta: ...,
        "This turns the other way.": {"rotation(theta)": "rotation(-theta)"},
    })
    def turn_about(c, theta):
        ...  # by another way than the solution in the notebook, where there is one

Each mistake is a wrong function, or the right one with some of its text replaced, by the sentence
that is said of it. A name is said only where its function gives all of the answers that came, the
right ones among them; so a mistake may be right in some cases, and no two may agree in all.
Relations to the right answer that need no idea of the question (the inverse, the sign, the square,
degrees, the order of two results) are known everywhere.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from labkit.course.grading.assignment.questions import Answer, Case, Misconception, Question
from labkit.course.grading.check import Feedback, tried
from labkit.course.grading.inside.data import plain
from labkit.course.grading.judging.kinds import read
from labkit.support.errors import InvalidParameterError

Function = Callable[..., Any]
Arguments = Mapping[str, tuple[Any, ...]]
_FOUND: dict[str, exercise] = {}
_source = cache(inspect.getsource)


@dataclass(eq=False)
class exercise:
    """Enter the decorated function as the right one of the name that students write."""

    title: str
    arguments: Arguments | Callable[[], Arguments]  # that it is tried on, by words that say what
    mistakes: Mapping[str, Function | Mapping[str, str]]  # by the sentence that is said of them
    tolerance: float = 1e-6  # of an entry, relative to the largest of its result or to 1

    def __call__(self, right: Function) -> Function:
        """Enter the function."""
        assert right.__name__ not in _FOUND, f"{right.__name__} is checked twice"
        _FOUND[right.__name__], self.right = self, right
        return right

    @cached_property
    def wrong(self) -> dict[str, Function]:
        """The wrong functions, by the sentence that is said of them."""
        return {
            says: one if callable(one) else edited(self.right, one)
            for says, one in self.mistakes.items()
        }

    @cached_property
    def asked(self) -> tuple[Question, list[Case]]:
        """The exercise as the judge knows it."""
        given = self.arguments() if callable(self.arguments) else self.arguments
        cases = [self._case(about, arguments) for about, arguments in given.items()]
        known = (Misconception(id=one, says=one) for one in self.mistakes)
        question = Question(
            id=self.right.__name__,
            title=self.title,
            points=float(len(cases)),
            function=self.right.__name__,
            signature=f"({', '.join(inspect.signature(self.right).parameters)})",
            answer=_kind(*cases[0].expected),
            misconceptions=tuple(known),
        )
        return question, cases

    def _case(self, about: str, arguments: tuple[Any, ...]) -> Case:
        """A call with its right answer, and the answers of all mistakes that do not fail."""
        wanted, mistaken = plain(self.right(*arguments)), {}
        for says, wrong in self.wrong.items():
            with suppress(ArithmeticError, ValueError, IndexError), np.errstate(all="ignore"):
                mistaken[says] = (plain(wrong(*arguments)),)
        answer = _kind(wanted)
        sizes = np.abs(read(answer, wanted)) * (answer is not Answer.NUMBERS)
        return Case(
            id=about,
            hidden=False,
            about=f"for {about}",
            arguments=arguments,
            expected=(wanted,),
            tolerance=self.tolerance * sizes[np.isfinite(sizes)].max(initial=1.0),
            mistaken=mistaken,
        )


def _kind(right: Any) -> Answer:
    """The kind of answer, by the form of the right one."""
    if isinstance(right, tuple):
        return Answer.TRANSFORM if np.ndim(right[0]) == 2 else Answer.NUMBERS
    array = np.asarray(right)
    if array.dtype == bool:
        return Answer.MASK
    if array.shape == (3, 3):
        is_rigid = np.array_equal(array[2], (0.0, 0.0, 1.0))
        return Answer.TRANSFORM if is_rigid else Answer.MATRIX
    return (Answer.NUMBER, Answer.VECTOR, Answer.POSES)[array.ndim]


def edited(right: Function, edits: Mapping[str, str]) -> Function:
    """The function with each text of `edits` replaced by another, wherever it stands in it."""
    _, head, source = _source(right).partition(f"def {right.__name__}(")
    for text, wrong in edits.items():
        assert text in source, f"{right.__name__} does not hold {text!r}, which a mistake replaces"
        source = source.replace(text, wrong)
    names: dict[str, Function] = {}
    exec(head + source, right.__globals__, names)
    return names[right.__name__]


def exercises() -> Mapping[str, exercise]:
    """All exercises of the book, by the name of their function."""
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
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
