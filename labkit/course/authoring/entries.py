"""Entries of an author for a question: tables of its cases, and of the mistakes that are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

import labkit
from labkit.arrays import FloatArray
from labkit.course.authoring.edits import Edits, edited
from labkit.course.grading.contract import Value

Rng = np.random.Generator
Arguments = tuple[Value, ...]
Draw = Callable[[Rng], Arguments]


@dataclass(frozen=True)
class Exact:
    """Arguments on a limit, in numbers that single precision holds; they are not perturbed."""

    drawn: Arguments | Draw


Entry = Arguments | Draw | Exact
Table = Mapping[str, Entry]


class Recipes(NamedTuple):
    """Arguments, or how they are drawn, by what the case tries, in words without a number.

    The visible cases are the same for everybody; each variant draws its own hidden ones.
    """

    visible: Table
    hidden: Table


def uniform(rng: Rng, low: float, high: float, digits: int = 3) -> float:
    """A number with few digits, so that a case can be read."""
    return round(float(rng.uniform(low, high)), digits)


def points(rng: Rng, count: int, span: float = 4.0) -> FloatArray:
    """Points in a square about the origin, to the centimetre."""
    return np.round(rng.uniform(-span, span, (count, 2)), 2)


def whole_points(rng: Rng, count: int) -> Value:
    """Distinct points with whole coordinates, as integers."""
    cells = rng.choice(21 * 21, size=count, replace=False)
    return np.column_stack([cells // 21 - 10, cells % 21 - 10]).astype(np.int64)


def motion(rng: Rng, turn: tuple[float, float], reach: float = 1.0) -> FloatArray:
    """A transform by an angle in `turn` [rad] and up to `reach` [m] along each axis."""
    x, y = uniform(rng, -reach, reach), uniform(rng, -reach, reach)
    return labkit.transform(x, y, uniform(rng, *turn))


@dataclass(frozen=True)
class Mistake:
    """A known mistake: what the student is told, the share of the points that it earns, the chapter
    that explains it (empty for the question's own), and how the right function goes wrong."""

    question: str
    id: str
    says: str
    credit: float
    chapter: str
    wrong: Callable[..., Any] | Edits | Sequence[Edits]

    @property
    def ways(self) -> list[Callable[..., Any]]:
        """The wrong functions, one for each way in which the mistake can come out."""
        if callable(self.wrong):
            return [self.wrong]
        several = [self.wrong] if isinstance(self.wrong, Mapping) else self.wrong
        return [way for edits in several for way in edited(self.question, edits)]


MISTAKES: list[Mistake] = []


def mistakes(question: str, table: Mapping[str, tuple[Any, ...]]) -> None:
    """Enter the mistakes of a question by their id, each with its credit, what is said of it, how
    it goes wrong, and the chapter that explains it where that is not the question's own.

    A mistake is a function, or the solution with some texts replaced by others; several of them
    where it can come out in several ways.
    """
    for id, (credit, says, wrong, *chapter) in table.items():
        MISTAKES.append(Mistake(question, id, says, credit, "".join(chapter), wrong))
