"""Cases on alignment: exact and noisy pairs, wide turns, outliers, mirror images."""

from __future__ import annotations

import math

import numpy as np

import labkit
from labkit.arrays import FloatArray
from labkit.course.authoring.entries import (
    Draw,
    Recipe,
    Recipes,
    motion,
    moved,
    points,
    whole_points,
)
from labkit.course.grading.contract import Value
from labkit.se2 import rotation

LEFT, WIDE, BACK = (0.3, 1.2), (1.8, 2.8), (-2.8, -1.8)
TRIANGLE = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
SHIFT = np.array([1.0, 2.0])
MIRROR = np.array([1.0, -1.0])


def _pairs(count: int, turn: tuple[float, float], noise: float = 0.02, away: float = 0.0) -> Draw:
    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        p = points(rng, count) + away
        return p, moved(motion(rng, turn), p, rng, noise)

    return draw


def _mirrored(count: int, turn: tuple[float, float]) -> Draw:
    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        p = points(rng, count) * (1.0, 0.4)
        return p, moved(motion(rng, turn), p * MIRROR, rng, 0.02)

    return draw


def _whole(mirror: int) -> Draw:
    """Whole coordinates after a quarter turn and a whole step, one of them a metre off."""

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        p = np.asarray(whole_points(rng, 6))
        q = np.column_stack([-mirror * p[:, 1], p[:, 0]]) + rng.integers(-5, 6, 2)
        q[rng.integers(6), 0] += 1
        return p, q

    return draw


def _weighted(draw: Draw, low: float, high: float, outliers: int = 1, whole: bool = False) -> Draw:
    """Pairs with weights; the first `outliers` of them are wrong."""

    def draw_all(rng: np.random.Generator) -> tuple[Value, ...]:
        p, q = draw(rng)
        assert isinstance(p, np.ndarray)
        assert isinstance(q, np.ndarray)
        w = np.round(rng.uniform(low, high, len(p)), 2)
        w[:outliers] = np.round(low / 4.0, 2)
        q = q.copy()
        q[:outliers] += rng.choice([-3, 2, 3], (outliers, 2))
        return p, q, np.maximum(w, 1).astype(np.int64) if whole else w

    return draw_all


def _translation(count: int, turn: tuple[float, float]) -> Draw:
    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        p = points(rng, count) + 1.0
        T = motion(rng, turn)
        return T[:2, :2], p, moved(T, p, rng, 0.05)

    return draw


def _turned(T: FloatArray) -> FloatArray:
    return np.round(labkit.apply(T, TRIANGLE), 12)


def _whole_translation(rng: np.random.Generator) -> tuple[Value, ...]:
    p, q = _whole(1)(rng)
    return np.array([[0, -1], [1, 0]]), p, q


QUARTER = labkit.transform(1.0, 2.0, math.pi / 2)
FAR_ROUND = labkit.transform(1.0, 2.0, 2.0)

RECIPES = {
    "best_translation": Recipes(
        visible=[
            Recipe("no turn", lambda _: (np.eye(2), TRIANGLE, TRIANGLE + SHIFT)),
            Recipe(
                "a quarter turn",
                lambda _: (np.round(rotation(math.pi / 2), 12), TRIANGLE, _turned(QUARTER)),
            ),
        ],
        hidden=[
            Recipe("a turn to the left", _translation(5, LEFT)),
            Recipe("a turn to the right", _translation(8, (-1.2, -0.3))),
            Recipe("more than a right angle", _translation(12, WIDE)),
            Recipe("many pairs", _translation(40, LEFT)),
            Recipe("points given as whole numbers", _whole_translation),
        ],
    ),
    "align": Recipes(
        visible=[
            Recipe("a triangle after a wide turn", lambda _: (TRIANGLE, _turned(FAR_ROUND))),
            Recipe("noisy pairs", _pairs(6, LEFT)),
        ],
        hidden=[
            Recipe("exact pairs", _pairs(5, LEFT, noise=0.0)),
            Recipe("noisy pairs", _pairs(20, (-1.2, -0.3), noise=0.05)),
            Recipe("more than a right angle to the left", _pairs(10, WIDE)),
            Recipe("more than a right angle to the right", _pairs(10, BACK)),
            Recipe("points far from the origin", _pairs(8, LEFT, away=15.0)),
            Recipe("points given as whole numbers", _whole(1)),
            Recipe("two pairs", _pairs(2, LEFT)),
        ],
    ),
    "align_weighted": Recipes(
        visible=[
            Recipe(
                "a wrong pair without weight",
                lambda _: (
                    np.vstack([TRIANGLE, [[3.0, 3.0]]]),
                    np.vstack([_turned(FAR_ROUND), [[9.0, 9.0]]]),
                    np.array([1.0, 1.0, 1.0, 0.0]),
                ),
            ),
            Recipe("a wrong pair with a small weight", _weighted(_pairs(6, LEFT), 0.4, 1.0)),
        ],
        hidden=[
            Recipe("weights below one", _weighted(_pairs(10, LEFT), 0.4, 1.0)),
            Recipe("weights above one", _weighted(_pairs(10, (-1.2, -0.3)), 4.0, 30.0)),
            Recipe("wrong pairs without weight", _weighted(_pairs(12, LEFT), 0.0, 1.0, 3)),
            Recipe("a wide turn", _weighted(_pairs(8, WIDE), 0.4, 1.0)),
            Recipe("whole numbers", _weighted(_whole(1), 4.0, 9.0, whole=True)),
        ],
    ),
    "align_svd": Recipes(
        visible=[
            Recipe("noisy pairs", _pairs(6, LEFT)),
            Recipe(
                "a mirror image",
                lambda _: (
                    np.array([[3.0, 0.0], [-3.0, 0.5], [1.0, 1.0], [-2.0, -1.0]]),
                    np.array([[3.0, 0.0], [-3.0, -0.5], [1.0, -1.0], [-2.0, 1.0]]),
                ),
            ),
        ],
        hidden=[
            Recipe("noisy pairs", _pairs(15, LEFT, noise=0.05)),
            Recipe("a wide turn", _pairs(8, BACK)),
            Recipe("a mirror image, turned to the left", _mirrored(10, LEFT)),
            Recipe("a mirror image, turned to the right", _mirrored(10, (-1.2, -0.3))),
            Recipe("a mirror image after a wide turn", _mirrored(10, WIDE)),
            Recipe("whole numbers", _whole(1)),
        ],
    ),
}
