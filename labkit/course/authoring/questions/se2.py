"""Rotations and transforms."""

from __future__ import annotations

import math

import numpy as np

import labkit
from labkit.course.authoring.entries import Draw, Exact, Rng, question
from labkit.grading.box.inside.data import Value
from labkit.grading.questions import Answer

QUARTERS = np.array([[[0, -1], [1, 0]], [[0, 1], [-1, 0]]])
AHEAD = labkit.transform(1.0, 0.0, 0.0)


def _angle(low: float, high: float) -> Draw:
    return lambda rng: (rng.number(low, high),)


def _whole(*numbers: int) -> Draw:
    return lambda rng: (int(rng.choice(numbers)),)


def _transforms(count: int, low: float, high: float, reach: float = 2.0) -> Draw:
    return lambda rng: tuple(rng.motion((low, high), reach) for _ in range(count))


def _whole_transform(rng: Rng) -> Value:
    T = np.eye(3, dtype=np.int64)
    T[:2, :2] = rng.choice(QUARTERS)
    T[:2, 2] = rng.choice([-4, -3, -2, 2, 3, 5], 2, replace=False)
    return T


# fmt: off
@question("Rotation", points=3, answer=Answer.MATRIX,
    chapter="chapter 1, “Rotation”",
    task=r"""
Write the matrix that turns points counter-clockwise by the angle $\theta$.
""", oracle=labkit.se2.rotation, visible={
    "no turn": (0.0,),
    "a quarter turn": (math.pi / 2,),
    "a turn to the right": (-0.5,),
}, hidden={
    "a turn to the right": _angle(-1.3, -0.3),
    "a turn beyond a right angle": _angle(1.8, 2.9),
    "more than a whole turn": _angle(6.8, 7.6),
    "an angle given as a whole number": _whole(-5, -4, -2, -1, 1, 2, 4, 5),
}, mistakes={
    "reflection": ("This is a reflection, [[c, s], [s, −c]]: its determinant is −1.",
        {"[[c, -s], [s, c]]": "[[c, s], [s, -c]]"}),
    "sine_and_cosine_swapped": ("Sine and cosine are swapped: at angle 0, R is the identity.",
        {"c, s = np.cos(theta), np.sin(theta)": "s, c = np.cos(theta), np.sin(theta)"}),
    "no_minus": ("The minus before the sine is missing: the columns are not at right angles.",
        {"[[c, -s], [s, c]]": "[[c, s], [s, c]]"}),
    "small_angle": ("This is the small-angle [[1, −θ], [θ, 1]]: it stretches what it turns.",
        {"np.cos(theta), np.sin(theta)": "1.0, theta"}),
    "degrees": ("The angle is taken for degrees, or turned into them; θ is in radians, as `np.cos` "
        "takes it.",
        [{"np.cos(theta), np.sin(theta)": f"np.cos({unit}(theta)), np.sin({unit}(theta))"}
         for unit in ("np.radians", "np.degrees")]),
})
def rotation(theta):
    """Rotation matrix of an angle.

    theta: float, in radians, counter-clockwise; any size.
    Returns R, an array (2, 2).

    >>> print(np.round(rotation(np.pi / 2), 2))
    [[ 0. -1.]
     [ 1.  0.]]
    """
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s], [s, c]])


@question("Composition", points=3, answer=Answer.MATRIX,
    chapter="chapter 1, “Rotation and translation in one matrix”",
    task=r"""
`T_a_b` takes coordinates in frame $b$ to coordinates in frame $a$, and `T_b_c` from $c$ to $b$.
Chain them to the one that goes from $c$ to $a$.
""", oracle=labkit.compose, visible={
    "a step ahead, then a quarter turn": (AHEAD, labkit.transform(0.0, 0.0, math.pi / 2)),
    "two general motions": _transforms(2, 0.3, 1.2),
    "transforms given in whole numbers": lambda rng: (_whole_transform(rng), _whole_transform(rng)),
}, hidden={
    "two turns to the right": _transforms(2, -1.4, -0.3),
    "turns that pass half a turn": _transforms(2, 1.7, 2.8),
    "motions of many metres": _transforms(2, 0.4, 2.6, 40.0),
    "transforms given in whole numbers": lambda rng: (_whole_transform(rng), _whole_transform(rng)),
}, mistakes={
    "elementwise": ("The matrices are multiplied entry by entry (`*`); the product is `@`.",
        lambda T, U: T * U),
    "exchanged": ("The order is exchanged: equal letters meet, `T_a_b @ T_b_c`.",
        lambda T, U: U @ T),
    "inverted": ("One of the two is inverted: in `T_a_b @ T_b_c` equal letters meet as they are.",
        [{"T_a_b @ T_b_c": "np.linalg.inv(T_a_b) @ T_b_c"},
         {"T_a_b @ T_b_c": "T_a_b @ np.linalg.inv(T_b_c)"}]),
    "second_translation_lost": ("The translation of `T_b_c` is missing: add it, turned by R_a_b.",
        lambda T, U: np.block([[T[:2, :2] @ U[:2, :2], T[:2, 2:]], [T[2]]])),
    "translations_added": ("The translations are added; turn the second by R_a_b first.",
        lambda T, U: np.block([[T[:2, :2] @ U[:2, :2], T[:2, 2:] + U[:2, 2:]], [T[2]]])),
})
def compose(T_a_b, T_b_c):
    """Chain two transforms.

    T_a_b, T_b_c: arrays (3, 3), rigid transforms [[R, t], [0, 1]].
    Returns T_a_c, an array (3, 3).

    >>> ahead = np.array([[1, 0, 2], [0, 1, 0], [0, 0, 1]])
    >>> print(compose(ahead, ahead)[0])
    [1 0 4]
    """
    return T_a_b @ T_b_c


@question("Inverse", points=3, answer=Answer.MATRIX,
    chapter="chapter 1, “Rotation and translation in one matrix”",
    task=r"""
Turn the transform round. Its structure gives the inverse without a general solver, but that is
yours to choose.
""", oracle=labkit.invert, visible={
    "a step ahead": (AHEAD,),
    "a general motion": _transforms(1, 0.3, 1.2),
    "a transform given in whole numbers": lambda rng: (_whole_transform(rng),),
}, hidden={
    "a turn to the right": _transforms(1, -1.4, -0.3),
    "more than a right angle": _transforms(1, 1.7, 2.8),
    "a motion of many metres": _transforms(1, 0.4, 2.6, 40.0),
    "a transform given in whole numbers": lambda rng: (_whole_transform(rng),),
}, mistakes={
    "whole_matrix_transposed": ("The whole (3, 3) is transposed: R⁻¹ = Rᵀ holds for the "
        "rotation, not for the transform.", lambda T: T.T),
    "translation_turned_forwards": ("The translation is turned by R, not by Rᵀ: it is −Rᵀ t.",
        {"-R.T @ t": "-R @ t"}),
    "translation_not_turned": ("The translation changes its sign, and is not turned: it is −Rᵀ t.",
        {"-R.T @ t": "-t"}),
})
def invert(T_a_b):
    """Invert a rigid transform.

    T_a_b: array (3, 3), a rigid transform [[R, t], [0, 1]].
    Returns T_b_a, an array (3, 3).

    >>> ahead = np.array([[1, 0, 2], [0, 1, 0], [0, 0, 1]])
    >>> print(invert(ahead)[0])
    [ 1.  0. -2.]
    """
    R, t = T_a_b[:2, :2], T_a_b[:2, 2]
    T_b_a = np.eye(3)
    T_b_a[:2, :2] = R.T
    T_b_a[:2, 2] = -R.T @ t
    return T_b_a


@question("Wrapping an angle", points=2, answer=Answer.NUMBER, unit="rad",
    chapter="chapter 1, “Rotation”",
    task=r"""
An angle is known only up to full turns. Return the one in $(-\pi, \pi]$ that means the same turn.
""", oracle=labkit.wrap, visible={
    "five eighths of a turn": (1.25 * math.pi,),
    "a small angle": (0.25,),
    "an obtuse angle": (2.5,),
    "more than half a turn to the right": (-4.0,),
    "two turns and some": (14.0,),
    "half a turn": Exact((math.pi,)),
}, hidden={
    "one turn": {
        "an angle that needs no wrapping": _angle(-2.8, -0.4),
        "more than half a turn to the left": _angle(3.4, 5.9),
    },
    "several turns": {
        "two turns and some": _angle(13.0, 15.0),
        "two turns to the right and some": _angle(-15.0, -13.0),
        "an angle given as a whole number": _whole(4, 8, 9),
    },
    "the ends of the range": {
        "half a turn": Exact((math.pi,)),
        "more than half a turn to the right": _angle(-5.9, -3.4),
    },
}, mistakes={
    "to_a_full_turn": ("The angle is wrapped to [0, 2π); the lab's convention is (−π, π].",
        lambda angle: angle % (2 * np.pi)),
    "one_turn": ("One turn is taken off, and no more: an angle may hold several.",
        lambda angle: angle - 2 * np.pi * (angle > np.pi) + 2 * np.pi * (angle <= -np.pi)),
    "half_open": ("The angle is wrapped to [−π, π); the lab's range is (−π, π], π stays π.",
        lambda angle: (angle + np.pi) % (2 * np.pi) - np.pi),
    "folded": ("`arcsin` of the sine cannot tell an acute angle from an obtuse one.",
        lambda angle: np.arcsin(np.sin(angle))),
    "cut_off": ("`math.fmod`'s remainder keeps the sign of the angle: turns right go wrong.",
        lambda angle: np.fmod(angle + np.pi, 2 * np.pi) - np.pi),
})
def wrap(angle):
    """The angle in (-pi, pi].

    angle: float, in radians, of any size.
    Returns a float in radians.

    >>> print(np.round(wrap(1.5 * np.pi), 2))
    -1.57
    """
    return np.pi - (np.pi - angle) % (2 * np.pi)
