"""Cases on alignment: exact and noisy pairs, wide turns, outliers, mirror images."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import labkit
from labkit.arrays import FloatArray
from labkit.course.authoring.entries import Arguments, Recipes, Rng, motion, points, whole_points
from labkit.se2 import rotation

LEFT, RIGHT, WIDE, BACK = (0.3, 1.2), (-1.2, -0.3), (1.8, 2.8), (-2.8, -1.8)
TRIANGLE = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
SHIFT = np.array([1.0, 2.0])


def _pairs(
    count: int,
    turn: tuple[float, float],
    noise: float = 0.02,
    away: float = 0.0,
    mirrored: bool = False,
) -> Any:
    """Points `away` from the origin and, with noise [m], the same after a motion."""

    def draw(rng: Rng) -> Arguments:
        p = points(rng, count) * (1.0, 0.4 if mirrored else 1.0) + away
        q = labkit.apply(motion(rng, turn), p * (1.0, -1.0 if mirrored else 1.0))
        return p, np.round(q + rng.normal(0.0, noise, p.shape), 3)

    return draw


def _whole(rng: Rng) -> Arguments:
    """Whole coordinates after a quarter turn and a whole step, one of them a metre off."""
    p = np.asarray(whole_points(rng, 6))
    q = np.column_stack([-p[:, 1], p[:, 0]]) + rng.integers(-5, 6, 2)
    q[rng.integers(6), 0] += 1
    return p, q


def _weighted(draw: Any, low: float, high: float, outliers: int = 1, whole: bool = False) -> Any:
    """Pairs with weights; the first `outliers` of them are wrong."""

    def draw_all(rng: Rng) -> Arguments:
        p, q = draw(rng)
        w = np.round(rng.uniform(low, high, len(p)), 2)
        w[:outliers] = np.round(low / 4.0, 2)
        q[:outliers] += rng.choice([-3, 2, 3], (outliers, 2))
        return p, q, np.maximum(w, 1).astype(np.int64) if whole else w

    return draw_all


def _translation(count: int, turn: tuple[float, float]) -> Any:
    def draw(rng: Rng) -> Arguments:
        p = points(rng, count) + 1.0
        T = motion(rng, turn)
        return T[:2, :2], p, np.round(labkit.apply(T, p) + rng.normal(0.0, 0.05, p.shape), 3)

    return draw


def _turned(angle: float) -> FloatArray:
    return np.round(labkit.apply(labkit.transform(1.0, 2.0, angle), TRIANGLE), 12)


# fmt: off
RECIPES = {
    "best_translation": Recipes({
        "no turn": (np.eye(2), TRIANGLE, TRIANGLE + SHIFT),
        "a quarter turn": (rotation(math.pi / 2), TRIANGLE, _turned(math.pi / 2)),
    }, {
        "a turn to the left": _translation(5, LEFT),
        "a turn to the right": _translation(8, RIGHT),
        "more than a right angle": _translation(12, WIDE),
        "many pairs": _translation(40, LEFT),
        "points given as whole numbers": lambda rng: (np.array([[0, -1], [1, 0]]), *_whole(rng)),
    }),
    "align": Recipes({
        "a triangle after a wide turn": (TRIANGLE, _turned(2.0)),
        "noisy pairs": _pairs(6, LEFT),
    }, {
        "exact pairs": _pairs(5, LEFT, noise=0.0),
        "noisy pairs": _pairs(20, RIGHT, noise=0.05),
        "more than a right angle to the left": _pairs(10, WIDE),
        "more than a right angle to the right": _pairs(10, BACK),
        "points far from the origin": _pairs(8, LEFT, away=15.0),
        "points given as whole numbers": _whole,
        "two pairs": _pairs(2, LEFT),
    }),
    "align_weighted": Recipes({
        "a wrong pair without weight": (
            np.vstack([TRIANGLE, [[3.0, 3.0]]]),
            np.vstack([_turned(2.0), [[9.0, 9.0]]]),
            np.array([1.0, 1.0, 1.0, 0.0])),
        "a wrong pair with a small weight": _weighted(_pairs(6, LEFT), 0.4, 1.0),
    }, {
        "weights below one": _weighted(_pairs(10, LEFT), 0.4, 1.0),
        "weights above one": _weighted(_pairs(10, RIGHT), 4.0, 30.0),
        "wrong pairs without weight": _weighted(_pairs(12, LEFT), 0.0, 1.0, 3),
        "a wide turn": _weighted(_pairs(8, WIDE), 0.4, 1.0),
        "whole numbers": _weighted(_whole, 4.0, 9.0, whole=True),
    }),
    "align_svd": Recipes({
        "noisy pairs": _pairs(6, LEFT),
        "a mirror image": (
            np.array([[3.0, 0.0], [-3.0, 0.5], [1.0, 1.0], [-2.0, -1.0]]),
            np.array([[3.0, 0.0], [-3.0, -0.5], [1.0, -1.0], [-2.0, 1.0]])),
    }, {
        "noisy pairs": _pairs(15, LEFT, noise=0.05),
        "a wide turn": _pairs(8, BACK),
        "a mirror image, turned to the left": _pairs(10, LEFT, mirrored=True),
        "a mirror image, turned to the right": _pairs(10, RIGHT, mirrored=True),
        "a mirror image after a wide turn": _pairs(10, WIDE, mirrored=True),
        "whole numbers": _whole,
    }),
}
