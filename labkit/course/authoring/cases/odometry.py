"""Cases on the integration of increments and the sanity check."""

from __future__ import annotations

import math

import numpy as np

from labkit.course.authoring.entries import Draw, Recipe, Recipes, uniform
from labkit.course.grading.contract import Value


def _increments(
    count: int, turn: tuple[float, float], start: tuple[float, float, float] | None = None
) -> Draw:
    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        steps = np.column_stack(
            [
                np.round(rng.uniform(0.2, 0.8, count), 3),
                np.round(rng.uniform(-0.3, 0.3, count), 3),
                np.round(rng.uniform(*turn, count), 3),
            ]
        )
        first = [uniform(rng, 1.0, 3.0), uniform(rng, -3.0, -1.0), uniform(rng, 0.4, 1.5)]
        return steps, np.array(first if start is None else start)

    return draw


def _whole_increments(rng: np.random.Generator) -> tuple[Value, ...]:
    steps = np.column_stack([rng.integers(1, 4, 4), rng.integers(-2, 3, 4), [1, -1, 1, 1]])
    return steps.astype(np.int64), np.array([2, -1, 1])


def _half_turn(rng: np.random.Generator) -> tuple[Value, ...]:
    steps = np.array([[uniform(rng, 0.2, 0.8), 0.3, math.pi], [uniform(rng, 0.2, 0.8), -0.2, 0.4]])
    return steps, np.array([uniform(rng, 1.0, 3.0), -2.0, 0.0])


LIMITS = (0.5, 0.75, 0.375, 0.125)  # m, rad, ratio, m; exact in single precision


def _step(
    length: float = 0.3, turn: float = 0.2, ratio: float = 0.8, rmse: float = 0.04, **fixed: float
) -> Draw:
    """A step before the sanity check; `heading` fixes the way that it goes."""

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        vary = 1.0 if fixed.get("exact") else uniform(rng, 0.9, 1.1)
        way = fixed.get("heading", uniform(rng, -0.6, 0.6))
        increment = vary * np.array([length * math.cos(way), length * math.sin(way), turn])
        return increment, vary * ratio, vary * rmse, *LIMITS

    return draw


DIAGONAL = math.pi / 4
ON_ALL_LIMITS = _step(length=0.5, turn=0.75, ratio=0.375, rmse=0.125, heading=0.0, exact=1.0)

RECIPES = {
    "integrate": Recipes(
        visible=[
            Recipe(
                "ahead, a quarter turn, ahead",
                lambda _: (
                    np.array([[1.0, 0.0, math.pi / 2], [1.0, 0.0, 0.0]]),
                    np.array([0.0, 0.0, 0.0]),
                ),
            ),
            Recipe("a curve from another start", _increments(3, (0.2, 0.5))),
            Recipe("a loop past half a turn", _increments(5, (0.8, 0.9))),
        ],
        hidden=[
            Recipe("a curve to the left", _increments(5, (0.1, 0.4))),
            Recipe("a curve to the right", _increments(5, (-0.5, -0.1))),
            Recipe("a loop past half a turn", _increments(8, (0.5, 0.9))),
            Recipe("a loop to the right past half a turn", _increments(9, (-0.9, -0.6))),
            Recipe("one step", _increments(1, (0.2, 0.6))),
            Recipe("increments given as whole numbers", _whole_increments),
            Recipe("half a turn on the way", _half_turn, exact=True),
        ],
    ),
    "is_plausible": Recipes(
        visible=[
            Recipe("an ordinary step", _step()),
            Recipe("a step too far", _step(length=0.9)),
            Recipe("too few inliers", _step(ratio=0.2)),
            Recipe("an ordinary turn", _step(length=0.05, turn=0.5)),
            Recipe("an ordinary step back, turning right", _step(length=-0.3, turn=-0.5)),
            Recipe("a step aside, too far", _step(length=0.8, heading=1.5)),
            Recipe("a turn too far to the right", _step(turn=-1.1)),
            Recipe("a step on all limits", ON_ALL_LIMITS, exact=True),
            Recipe("a large residual", _step(rmse=0.2)),
            Recipe("a match without a pair", _step(rmse=math.nan)),
            Recipe("nearly no motion", _step(length=0.02, turn=-0.02)),
            Recipe("a poor but sufficient match", _step(ratio=0.42, rmse=0.1)),
        ],
        hidden=[
            Recipe("an ordinary step ahead", _step()),
            Recipe("an ordinary step back", _step(length=-0.3)),
            Recipe("an ordinary turn to the right", _step(turn=-0.5)),
            Recipe("an ordinary turn on the spot", _step(length=0.0, turn=0.6)),
            Recipe("a poor but sufficient match", _step(ratio=0.45, rmse=0.11)),
            Recipe("a step on all limits", ON_ALL_LIMITS, exact=True),
            Recipe("an ordinary step to the left", _step(heading=1.5)),
            Recipe("nearly no motion", _step(length=0.01, turn=0.01)),
            Recipe("a step aslant, too far", _step(length=0.6, heading=DIAGONAL)),
            Recipe("a step back, too far", _step(length=-0.9)),
            Recipe("a turn too far to the left", _step(turn=1.2)),
            Recipe("a turn too far to the right", _step(turn=-1.2)),
            Recipe("too few inliers", _step(ratio=0.2)),
            Recipe("a large residual", _step(rmse=0.3)),
            Recipe("all beyond the limits", _step(length=2.0, turn=2.0, ratio=0.1, rmse=0.5)),
            Recipe("a residual that is no number", _step(rmse=math.nan)),
        ],
    ),
}
