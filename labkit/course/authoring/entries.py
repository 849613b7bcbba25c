"""What an author enters for a question: recipes of its cases, and mistakes that are known.

A recipe says what a case tries, and how its arguments are drawn. The register of mistakes says
what each does wrong, what it earns, and where to read on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import labkit
from labkit.arrays import FloatArray
from labkit.course.grading.contract import Value

Draw = Callable[[np.random.Generator], tuple[Value, ...]]
Function = Callable[..., Any]


@dataclass(frozen=True)
class Recipe:
    """One case: what it tries, in words that give no number away, and how its arguments are drawn.

    The arguments of an `exact` one lie on a limit on purpose, in numbers that single precision
    holds exactly; so they are not perturbed to find the tolerance.
    """

    about: str
    draw: Draw
    exact: bool = False


@dataclass(frozen=True)
class Recipes:
    """The cases of one question: the same for everybody, and those that each variant draws."""

    visible: Sequence[Recipe]
    hidden: Sequence[Recipe]


def uniform(rng: np.random.Generator, low: float, high: float, digits: int = 3) -> float:
    """A number with few digits, so that a case can be read."""
    return round(float(rng.uniform(low, high)), digits)


def points(rng: np.random.Generator, count: int, span: float = 4.0) -> FloatArray:
    """Points in a square about the origin, to the centimetre."""
    return np.round(rng.uniform(-span, span, (count, 2)), 2)


def whole_points(rng: np.random.Generator, count: int) -> Value:
    """Distinct points with whole coordinates, as integers."""
    cells = rng.choice(21 * 21, size=count, replace=False)
    return np.column_stack([cells // 21 - 10, cells % 21 - 10]).astype(np.int64)


def motion(rng: np.random.Generator, turn: tuple[float, float], reach: float = 1.0) -> FloatArray:
    """A transform by an angle in `turn` [rad] and up to `reach` [m] along each axis."""
    return labkit.transform(
        uniform(rng, -reach, reach), uniform(rng, -reach, reach), uniform(rng, *turn)
    )


def moved(T: FloatArray, p: FloatArray, rng: np.random.Generator, noise: float) -> FloatArray:
    """The points after a motion, with noise [m], to the millimetre."""
    return np.round(labkit.apply(T, p) + rng.normal(0.0, noise, p.shape), 3)


@dataclass(frozen=True)
class Several:
    """The answers of a mistake that can come out in more than one way."""

    answers: tuple[Value, ...]


@dataclass(frozen=True)
class Mistake:
    """A wrong function: what the student is told, the share of the points that it earns, and the
    chapter that explains it (empty for the question's own)."""

    question: str
    id: str
    says: str
    credit: float
    chapter: str
    function: Function


MISTAKES: list[Mistake] = []


def mistakes(question: str, table: Mapping[str, tuple[Any, ...]]) -> None:
    """Enter wrong functions by their id, each with its credit, what is said, and the chapter that
    explains it where it is not the question's own."""
    for id, (credit, says, function, *chapter) in table.items():
        MISTAKES.append(Mistake(question, id, says, credit, "".join(chapter), function))
