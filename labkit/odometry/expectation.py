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
from labkit.se2 import from_xytheta

REMEMBERED = 20  # motions
USUAL = 0.5, math.radians(20.0)  # [m] and [rad]: motions that differ so much are unlike
AGE = 0.05  # what each step since a motion adds to its surprise


class Expectation:
    """The motions that may be repeated, the likeliest first.

    Parameters
    ----------
    motions : ndarray, shape (K, 3), K ≥ 1
        Increments (Δx, Δy, Δψ): the prior alone, or the last motions, the newest first.
    T_target_last : ndarray, shape (3, 3)
        Where they start from, in the target's frame.
    """

    def __init__(self, motions: FloatArray, T_target_last: FloatArray) -> None:
        self.motions = motions
        self.poses = T_target_last @ from_xytheta(motions)
        self._age = AGE * np.arange(len(motions))

    def surprise(self, T: FloatArray, free: FloatArray | None = None) -> FloatArray:
        """How far the pose T is from that of each motion, shape (K,), squared, in `USUAL` ways.

        The directions `free`, shape (F, 2), do not count.
        """
        apart = self.poses[:, :2, 2] - T[:2, 2]
        if free is not None:
            apart = apart - (apart @ free.T) @ free
        c = self.poses[:, 0, 0] * T[0, 0] + self.poses[:, 1, 0] * T[1, 0]
        s = self.poses[:, 1, 0] * T[0, 0] - self.poses[:, 0, 0] * T[1, 0]
        moved = np.hypot(apart[:, 0], apart[:, 1]) / USUAL[0]
        turned = np.arctan2(s, c) / USUAL[1]
        return np.asarray(moved**2 + turned**2 + self._age)

    def unlikeliness(self, T: FloatArray) -> float:
        """0 where the pose T is what was expected, 1 where it is unlike any motion."""
        least = float(self.surprise(T).min())
        return least / (1.0 + least)

    def completed(self, T: FloatArray, seen: Information) -> FloatArray:
        """The pose T, moved along what `seen` leaves free to where it is expected.

        That is the place of the motion that is most like T in all that is not free.
        """
        shifts = [v[:2] / math.hypot(v[0], v[1]) for v in seen.free.T if _shifts(v)]
        if not shifts:
            return T
        free = np.array(shifts)
        likeliest = self.poses[int(self.surprise(T, free).argmin())]
        moved = T.copy()
        moved[:2, 2] += ((likeliest[:2, 2] - T[:2, 2]) @ free.T) @ free
        return moved


def _shifts(motion: FloatArray) -> bool:
    """Whether a motion (Δx, Δy, ℓΔψ) is more of a shift than of a turn."""
    along: float = math.hypot(*motion[:2].tolist())
    return along > abs(float(motion[2]))
