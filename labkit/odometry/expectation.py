"""Which motion is expected, and how much a match deviates: a robot moves as it did before.

Scans leave some motions open. Along a corridor any motion fits, and where two places look
alike, both fit. Wheels tell the right one; without wheels, the last motions do. A robot that
drives a metre and then turns in place seldom repeats its last motion, but mostly one of the
last few.
"""

from __future__ import annotations

import math

import numpy as np

from labkit.arrays import FloatArray
from labkit.line_alignment import Information
from labkit.se2 import relative

REMEMBERED = 20  # motions
USUAL = 0.5, math.radians(20.0)  # [m] and [rad]: motions that differ so much are unlike
AGE = 0.05  # what each step since a motion adds to its surprise


def unlikeliness(T: FloatArray, expected: FloatArray) -> float:
    """0 where the pose T is the likeliest that is expected, 1 where it is unlike any."""
    least = float(_surprise(T, expected).min())
    return least / (1.0 + least)


def completed(T: FloatArray, seen: Information, expected: FloatArray) -> FloatArray:
    """The pose T, moved along what `seen` leaves free to where it is expected.

    That is the place of the expected pose that is most like T in all that is not free.
    """
    shifts = [v[:2] / math.hypot(v[0], v[1]) for v in seen.free.T if math.hypot(*v[:2]) > abs(v[2])]
    if not shifts:
        return T
    free = np.array(shifts)
    likeliest = expected[int(_surprise(T, expected, free).argmin())]
    moved = T.copy()
    moved[:2, 2] += ((likeliest[:2, 2] - T[:2, 2]) @ free.T) @ free
    return moved


def _surprise(T: FloatArray, expected: FloatArray, free: FloatArray | None = None) -> FloatArray:
    """How far T is from each pose of `expected` (K, 3, 3), the likeliest first, shape (K,).

    Squared, in `USUAL` ways; the directions `free`, shape (F, 2), do not count.
    """
    apart = expected[:, :2, 2] - T[:2, 2]
    if free is not None:
        apart = apart - (apart @ free.T) @ free
    turn = relative(T, expected)
    turned = np.arctan2(turn[:, 1, 0], turn[:, 0, 0]) / USUAL[1]
    moved = np.hypot(apart[:, 0], apart[:, 1]) / USUAL[0]
    surprise: FloatArray = moved**2 + turned**2 + AGE * np.arange(len(expected))
    return surprise
