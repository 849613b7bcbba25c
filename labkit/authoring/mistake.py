"""The register of known mistakes: what each does wrong, what it earns, where to read on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from labkit.grading.contract import Value

Function = Callable[..., Any]


@dataclass(frozen=True)
class Several:
    """The answers of a mistake that can come out in more than one way."""

    answers: tuple[Value, ...]


@dataclass(frozen=True)
class Mistake:
    """A wrong implementation and what is said of it.

    Attributes
    ----------
    question, id : str
        Whose mistake it is.
    says : str
        Told to the student: what was done, and why it is wrong.
    credit : float
        The share of the points that it earns.
    chapter : str
        Where the book explains it; empty for the question's own chapter.
    function : callable
        Makes the mistake.
    """

    question: str
    id: str
    says: str
    credit: float
    chapter: str
    function: Function


MISTAKES: list[Mistake] = []


def mistake(question: str, credit: float, chapter: str = "") -> Callable[[Function], Function]:
    """Enter a function as a mistake: its docstring is what the student reads.

    The function is named after question and mistake, ``align__transposed``; the id is the
    second half.
    """

    def enter(function: Function) -> Function:
        prefix, _, id = function.__name__.partition("__")
        assert prefix == question
        says = " ".join((function.__doc__ or "").split())
        MISTAKES.append(Mistake(question, id, says, credit, chapter, function))
        return function

    return enter
