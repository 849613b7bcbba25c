"""Cases on the convergence test, the integration of increments and the sanity check."""

from __future__ import annotations

import math

import numpy as np

import labkit
from labkit.authoring.recipe import Draw, Recipe, Recipes, uniform
from labkit.grading.contract import Value

STEP, TURN, COST, BUDGET = 1e-3, 1e-3, 1e-6, 50


def _ending(
    step: float = 0.1,
    turn: float = 0.1,
    cost: float = -0.01,
    iteration: int = 10,
    heading: float | None = None,
) -> Draw:
    """A step of that many tolerances; ``step=0.5`` is half of ε_t. A heading fixes its way."""

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        way = uniform(rng, -3.0, 3.0) if heading is None else heading
        vary = uniform(rng, 0.95, 1.05)
        dT = labkit.transform(
            vary * step * STEP * math.cos(way),
            vary * step * STEP * math.sin(way),
            vary * turn * TURN if abs(turn) < 1000 else turn * TURN - 0.0004 * vary,
        )
        return dT, vary * cost, iteration, STEP, TURN, COST, BUDGET

    return draw


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
HALF_TURN = 1000.0 * math.pi

RECIPES = {
    "has_converged": Recipes(
        visible=[
            Recipe("a tiny step", _ending(0.3, 0.3)),
            Recipe("a long step", _ending(90.0, 90.0, cost=0.01)),
            Recipe("no shift, but a turn to the left", _ending(0.1, 60.0)),
            Recipe("a cost that stands still", _ending(90.0, 90.0, cost=1e-7)),
        ],
        hidden=[
            Recipe("a step below both tolerances", _ending(0.6, 0.5)),
            Recipe("a step below both, to the right", _ending(0.5, -0.6)),
            Recipe("a step just below both tolerances", _ending(0.8, 0.8)),
            Recipe("a cost that rose by next to nothing", _ending(80.0, 70.0, cost=2e-7)),
            Recipe("a cost that fell by next to nothing", _ending(80.0, -70.0, cost=-2e-7)),
            Recipe("the last iteration of the budget", _ending(80.0, 70.0, iteration=50)),
            Recipe("an iteration past the budget", _ending(80.0, -70.0, iteration=51)),
            Recipe("a cost that did not change", _ending(200.0, 150.0, cost=0.0)),
            Recipe("a turn to the left without a shift", _ending(0.2, 60.0, cost=0.01)),
            Recipe("a turn to the right without a shift", _ending(0.2, -60.0)),
            Recipe("a shift without a turn", _ending(300.0, 0.2)),
            Recipe("a shift of a few tolerances", _ending(8.0, 0.2, cost=0.02)),
            Recipe("a shift aslant", _ending(1.3, 0.2, heading=DIAGONAL)),
            Recipe("a cost that fell much", _ending(40.0, 90.0, cost=-0.5)),
            Recipe("the last but one iteration", _ending(80.0, 70.0, cost=0.01, iteration=49)),
            Recipe("half a turn on the spot", _ending(0.2, HALF_TURN)),
        ],
    ),
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
        ],
        hidden=[
            Recipe("a curve to the left", _increments(5, (0.1, 0.4))),
            Recipe("a curve to the right", _increments(5, (-0.5, -0.1))),
            Recipe("a loop past half a turn", _increments(8, (0.5, 0.9))),
            Recipe("a loop to the right past half a turn", _increments(9, (-0.9, -0.6))),
            Recipe("one step", _increments(1, (0.2, 0.6))),
            Recipe("increments given as whole numbers", _whole_increments),
        ],
    ),
    "is_plausible": Recipes(
        visible=[
            Recipe("an ordinary step", _step()),
            Recipe("a step too far", _step(length=0.9)),
            Recipe("too few inliers", _step(ratio=0.2)),
            Recipe("an ordinary turn", _step(length=0.05, turn=0.5)),
        ],
        hidden=[
            Recipe("an ordinary step ahead", _step()),
            Recipe("an ordinary step back", _step(length=-0.3)),
            Recipe("an ordinary turn to the right", _step(turn=-0.5)),
            Recipe("an ordinary turn on the spot", _step(length=0.0, turn=0.6)),
            Recipe("a poor but sufficient match", _step(ratio=0.45, rmse=0.11)),
            Recipe(
                "a step on all limits",
                _step(length=0.5, turn=0.75, ratio=0.375, rmse=0.125, heading=0.0, exact=1.0),
                exact=True,
            ),
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
