"""Entries of an author for a question: tables of its cases, and of the mistakes that are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

import labkit
from labkit.arrays import FloatArray
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
    """A wrong function, which returns a list where it can come out in more than one way: what the
    student is told, the share of the points that it earns, and the chapter that explains it (empty
    for the question's own)."""

    question: str
    id: str
    says: str
    credit: float
    chapter: str
    function: Callable[..., Any]


MISTAKES: list[Mistake] = []


def mistakes(question: str, table: Mapping[str, tuple[Any, ...]]) -> None:
    """Enter wrong functions by their id, each with its credit, what is said, and the chapter that
    explains it where it is not the question's own."""
    for id, (credit, says, function, *chapter) in table.items():
        MISTAKES.append(Mistake(question, id, says, credit, "".join(chapter), function))
