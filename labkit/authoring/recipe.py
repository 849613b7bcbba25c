"""A recipe for a case: what it tries, and how its arguments are drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import labkit
from labkit.arrays import FloatArray
from labkit.grading.contract import Value

Draw = Callable[[np.random.Generator], tuple[Value, ...]]


@dataclass(frozen=True)
class Recipe:
    """One case.

    Attributes
    ----------
    about : str
        What it tries, in words that give no number away.
    draw : callable
        From a random generator to the function's arguments.
    exact : bool
        The arguments lie on a limit on purpose, in numbers that single precision holds
        exactly; so they are not perturbed to find the tolerance.
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
