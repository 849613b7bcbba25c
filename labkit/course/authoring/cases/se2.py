"""Cases on rotations and transforms."""

from __future__ import annotations

import math

import numpy as np

import labkit
from labkit.course.authoring.entries import Draw, Exact, Recipes, Rng, motion, uniform
from labkit.course.grading.contract import Value

QUARTERS = np.array([[[0, -1], [1, 0]], [[0, 1], [-1, 0]]])
AHEAD = labkit.transform(1.0, 0.0, 0.0)


def _angle(low: float, high: float) -> Draw:
    return lambda rng: (uniform(rng, low, high),)


def _whole(*numbers: int) -> Draw:
    return lambda rng: (int(rng.choice(numbers)),)


def _transforms(count: int, low: float, high: float, reach: float = 2.0) -> Draw:
    return lambda rng: tuple(motion(rng, (low, high), reach) for _ in range(count))


def _whole_transforms(count: int) -> Draw:
    def transform(rng: Rng) -> Value:
        T = np.eye(3, dtype=np.int64)
        T[:2, :2] = rng.choice(QUARTERS)
        T[:2, 2] = rng.choice([-4, -3, -2, 2, 3, 5], 2, replace=False)
        return T

    return lambda rng: tuple(transform(rng) for _ in range(count))


# fmt: off
RECIPES = {
    "rotation": Recipes({
        "no turn": (0.0,),
        "a quarter turn": (math.pi / 2,),
        "a turn to the right": (-0.5,),
    }, {
        "a turn to the left": _angle(0.3, 1.2),
        "a turn to the right": _angle(-1.3, -0.3),
        "a turn beyond a right angle": _angle(1.8, 2.9),
        "more than a whole turn": _angle(6.8, 7.6),
        "an angle given as a whole number": _whole(-5, -4, -2, -1, 1, 2, 4, 5),
    }),
    "compose": Recipes({
        "a step ahead, then a quarter turn": (AHEAD, labkit.transform(0.0, 0.0, math.pi / 2)),
        "two general motions": _transforms(2, 0.3, 1.2),
    }, {
        "two turns to the left": _transforms(2, 0.3, 1.4),
        "two turns to the right": _transforms(2, -1.4, -0.3),
        "turns that pass half a turn": _transforms(2, 1.7, 2.8),
        "motions of many metres": _transforms(2, 0.4, 2.6, 40.0),
        "transforms given in whole numbers": _whole_transforms(2),
    }),
    "invert": Recipes({"a step ahead": (AHEAD,), "a general motion": _transforms(1, 0.3, 1.2)}, {
        "a turn to the left": _transforms(1, 0.3, 1.4),
        "a turn to the right": _transforms(1, -1.4, -0.3),
        "more than a right angle": _transforms(1, 1.7, 2.8),
        "a motion of many metres": _transforms(1, 0.4, 2.6, 40.0),
        "a transform given in whole numbers": _whole_transforms(1),
    }),
    "wrap": Recipes({
        "three quarters of a turn": (1.5 * math.pi,),
        "a small angle": (0.25,),
        "an obtuse angle": (2.5,),
        "more than half a turn to the right": (-4.0,),
        "two turns and some": (14.0,),
        "half a turn": Exact((math.pi,)),
    }, {
        "an angle that needs no wrapping": _angle(-2.8, -0.4),
        "more than half a turn to the left": _angle(3.4, 5.9),
        "more than half a turn to the right": _angle(-5.9, -3.4),
        "two turns and some": _angle(13.0, 15.0),
        "two turns to the right and some": _angle(-15.0, -13.0),
        "an angle given as a whole number": _whole(4, 8, 9),
        "half a turn": Exact((math.pi,)),
    }),
}
