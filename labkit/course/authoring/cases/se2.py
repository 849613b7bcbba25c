"""Cases on rotations and transforms."""

from __future__ import annotations

import math

import numpy as np

import labkit
from labkit.course.authoring.entries import Draw, Recipe, Recipes, motion, uniform
from labkit.course.grading.contract import Value

QUARTERS = np.array([[[0, -1], [1, 0]], [[-1, 0], [0, -1]], [[0, 1], [-1, 0]]])


def _angle(low: float, high: float) -> Draw:
    return lambda rng: (uniform(rng, low, high),)


def _transforms(count: int, low: float, high: float, reach: float = 2.0) -> Draw:
    return lambda rng: tuple(motion(rng, (low, high), reach) for _ in range(count))


def _whole_transforms(count: int) -> Draw:
    return lambda rng: tuple(_whole_transform(rng) for _ in range(count))


def _whole_transform(rng: np.random.Generator) -> Value:
    T = np.eye(3, dtype=np.int64)
    T[:2, :2] = QUARTERS[rng.choice([0, 2])]
    T[:2, 2] = rng.choice([-4, -3, -2, 2, 3, 5], 2, replace=False)
    return T


RECIPES = {
    "rotation": Recipes(
        visible=[
            Recipe("no turn", lambda _: (0.0,)),
            Recipe("a quarter turn", lambda _: (math.pi / 2,)),
            Recipe("a turn to the right", lambda _: (-0.5,)),
        ],
        hidden=[
            Recipe("a turn to the left", _angle(0.3, 1.2)),
            Recipe("a turn to the right", _angle(-1.3, -0.3)),
            Recipe("a turn beyond a right angle", _angle(1.8, 2.9)),
            Recipe("more than a whole turn", _angle(6.8, 7.6)),
            Recipe("an angle given as a whole number", lambda rng: (int(rng.choice([1, -1])),)),
        ],
    ),
    "compose": Recipes(
        visible=[
            Recipe(
                "a step ahead, then a quarter turn",
                lambda _: (
                    labkit.transform(1.0, 0.0, 0.0),
                    labkit.transform(0.0, 0.0, math.pi / 2),
                ),
            ),
            Recipe("two general motions", _transforms(2, 0.3, 1.2)),
        ],
        hidden=[
            Recipe("two turns to the left", _transforms(2, 0.3, 1.4)),
            Recipe("two turns to the right", _transforms(2, -1.4, -0.3)),
            Recipe("turns that pass half a turn", _transforms(2, 1.7, 2.8)),
            Recipe("motions of many metres", _transforms(2, 0.4, 2.6, 40.0)),
            Recipe("transforms given in whole numbers", _whole_transforms(2)),
        ],
    ),
    "invert": Recipes(
        visible=[
            Recipe("a step ahead", lambda _: (labkit.transform(1.0, 0.0, 0.0),)),
            Recipe("a general motion", _transforms(1, 0.3, 1.2)),
        ],
        hidden=[
            Recipe("a turn to the left", _transforms(1, 0.3, 1.4)),
            Recipe("a turn to the right", _transforms(1, -1.4, -0.3)),
            Recipe("more than a right angle", _transforms(1, 1.7, 2.8)),
            Recipe("a motion of many metres", _transforms(1, 0.4, 2.6, 40.0)),
            Recipe("a transform given in whole numbers", _whole_transforms(1)),
        ],
    ),
    "wrap": Recipes(
        visible=[
            Recipe("three quarters of a turn", lambda _: (1.5 * math.pi,)),
            Recipe("a small angle", lambda _: (0.25,)),
            Recipe("an obtuse angle", lambda _: (2.5,)),
            Recipe("more than half a turn to the right", lambda _: (-4.0,)),
            Recipe("two turns and some", lambda _: (14.0,)),
            Recipe("half a turn", lambda _: (math.pi,), exact=True),
        ],
        hidden=[
            Recipe("an angle that needs no wrapping", _angle(-2.8, -0.4)),
            Recipe("more than half a turn to the left", _angle(3.4, 5.9)),
            Recipe("more than half a turn to the right", _angle(-5.9, -3.4)),
            Recipe("two turns and some", _angle(13.0, 15.0)),
            Recipe("two turns to the right and some", _angle(-15.0, -13.0)),
            Recipe("an angle given as a whole number", lambda rng: (int(rng.choice([4, 5])),)),
            Recipe("half a turn", lambda _: (math.pi,), exact=True),
        ],
    ),
}
