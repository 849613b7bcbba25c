"""Cases on the integration of increments and the sanity check."""

from __future__ import annotations

import math

import numpy as np

from labkit.course.authoring.entries import Arguments, Draw, Exact, Recipes, Rng, uniform

LIMITS = (0.5, 0.75, 0.375, 0.125)  # m, rad, ratio, m; exact in single precision
ON_ALL_LIMITS = Exact((np.array([0.5, 0.0, 0.75]), 0.375, 0.125, *LIMITS))
DIAGONAL, ASIDE = math.pi / 4, 1.5


def _increments(count: int, low: float, high: float) -> Draw:
    """Steps of some decimetres that turn by `low` to `high` [rad] each, and a start."""

    def draw(rng: Rng) -> Arguments:
        steps = rng.uniform((0.2, -0.3, low), (0.8, 0.3, high), (count, 3))
        start = [uniform(rng, 1.0, 3.0), uniform(rng, -3.0, -1.0), uniform(rng, 0.4, 1.5)]
        return np.round(steps, 3), np.array(start)

    return draw


def _whole_increments(rng: Rng) -> Arguments:
    steps = np.column_stack([rng.integers(1, 4, 4), rng.integers(-2, 3, 4), [1, -1, 1, 1]])
    return steps.astype(np.int64), np.array([2, -1, 1])


def _half_turn(rng: Rng) -> Arguments:
    steps = np.array([[uniform(rng, 0.2, 0.8), 0.3, math.pi], [uniform(rng, 0.2, 0.8), -0.2, 0.4]])
    return steps, np.array([uniform(rng, 1.0, 3.0), -2.0, 0.0])


def _step(
    length: float = 0.3,
    turn: float = 0.2,
    ratio: float = 0.8,
    rmse: float = 0.04,
    heading: float | None = None,
) -> Draw:
    """A step before the sanity check; `heading` fixes the way that it goes."""

    def draw(rng: Rng) -> Arguments:
        vary = uniform(rng, 0.9, 1.1)
        way = uniform(rng, -0.6, 0.6) if heading is None else heading
        increment = vary * np.array([length * math.cos(way), length * math.sin(way), turn])
        return increment, vary * ratio, vary * rmse, *LIMITS

    return draw


# fmt: off
RECIPES = {
    "integrate": Recipes({
        "ahead, a quarter turn, ahead": (
            np.array([[1.0, 0.0, math.pi / 2], [1.0, 0.0, 0.0]]), np.zeros(3)),
        "a curve from another start": _increments(3, 0.2, 0.5),
        "a loop past half a turn": _increments(5, 0.8, 0.9),
    }, {
        "a curve to the left": _increments(5, 0.1, 0.4),
        "a curve to the right": _increments(5, -0.5, -0.1),
        "a loop past half a turn": _increments(8, 0.5, 0.9),
        "a loop to the right past half a turn": _increments(9, -0.9, -0.6),
        "one step": _increments(1, 0.2, 0.6),
        "increments given as whole numbers": _whole_increments,
        "half a turn on the way": Exact(_half_turn),
    }),
    "is_plausible": Recipes({
        "an ordinary step": _step(),
        "a step too far": _step(length=0.9),
        "too few inliers": _step(ratio=0.2),
        "an ordinary turn": _step(length=0.05, turn=0.5),
        "an ordinary step back, turning right": _step(length=-0.3, turn=-0.5),
        "a step aside, too far": _step(length=0.8, heading=ASIDE),
        "a turn too far to the right": _step(turn=-1.1),
        "a step on all limits": ON_ALL_LIMITS,
        "a large residual": _step(rmse=0.2),
        "a match without a pair": _step(rmse=math.nan),
        "nearly no motion": _step(length=0.02, turn=-0.02),
        "a poor but sufficient match": _step(ratio=0.42, rmse=0.1),
    }, {
        "an ordinary step ahead": _step(),
        "an ordinary step back": _step(length=-0.3),
        "an ordinary turn to the right": _step(turn=-0.5),
        "an ordinary turn on the spot": _step(length=0.0, turn=0.6),
        "a poor but sufficient match": _step(ratio=0.45, rmse=0.11),
        "a step on all limits": ON_ALL_LIMITS,
        "an ordinary step to the left": _step(heading=ASIDE),
        "nearly no motion": _step(length=0.01, turn=0.01),
        "a step aslant, too far": _step(length=0.6, heading=DIAGONAL),
        "a step back, too far": _step(length=-0.9),
        "a turn too far to the left": _step(turn=1.2),
        "a turn too far to the right": _step(turn=-1.2),
        "too few inliers": _step(ratio=0.2),
        "a large residual": _step(rmse=0.3),
        "all beyond the limits": _step(length=2.0, turn=2.0, ratio=0.1, rmse=0.5),
        "a residual that is no number": _step(rmse=math.nan),
    }),
}
