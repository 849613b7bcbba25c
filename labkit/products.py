"""Nearest neighbours by matrix products: the fast ways of `labkit.neighbors`.

The nearest of the points qⱼ to p is the one with the least ‖qⱼ‖² − 2 p·qⱼ, which is a product
of (p, 1) with factors (−2 qⱼ, ‖qⱼ‖²) that are made once. In single precision it would take
two thirds of the time, but give one or two of 1,000 points another partner in every search
(of 360 points, one in thirty searches), and with it the match another last digit.
"""

from __future__ import annotations

import numpy as np

from labkit.arrays import FloatArray, IntArray

_CACHED = 45_000  # numbers that one product makes at most: a third of a megabyte
_RUN = 48  # consecutive beams that are looked at together


class MatrixSearch:
    """argmin over j of ‖qⱼ‖² − 2 p·qⱼ, for columns seen from the target's centre.

    All N·M numbers of 360 beams fill a processor's second cache and drive out the rest of
    the match. By blocks that leave room, the match takes 1 to 4 % less.
    """

    def __init__(self, target: FloatArray) -> None:
        self.factors = _factors(target)
        self.block = max(1, _CACHED // target.shape[1])

    def nearest(self, columns: FloatArray) -> IntArray:
        """Index of the nearest target point of each column (x, y, 1)."""
        count = columns.shape[1]
        if count <= self.block:
            index: IntArray = (columns.T @ self.factors).argmin(axis=1)
            return index
        starts = range(0, count, self.block)
        found = [(columns[:, a : a + self.block].T @ self.factors).argmin(axis=1) for a in starts]
        return np.concatenate(found)


class SweepSearch:
    """The same for large scans in beam order, whose neighbours are near each other.

    A run of beams lies in a small box. No point of a box has its nearest neighbour in a
    target box that is farther than the partners which the points had before, so that a
    product of each box with a few others does for all of them.
    """

    def __init__(self, target: FloatArray) -> None:
        self.target = target
        self.factors = _factors(target)
        self.low, self.high = _boxes(target)

    def nearest(self, columns: FloatArray, before: IntArray | None) -> IntArray:
        """The nearest of each column; any partners `before` will do, near ones are faster.

        They may be those of more or fewer points along the same sweep.
        """
        points, count = columns[:2], columns.shape[1]
        if before is None:  # between two scans, a beam mostly meets the same wall
            before = np.arange(self.target.shape[1])
        if len(before) != count:
            before = before.take(np.arange(count) * len(before) // count)
        away = points - self.target.take(before, axis=1)
        away *= away
        reach = np.maximum.reduceat(away[0] + away[1], range(0, count, _RUN))
        low, high = _boxes(points)
        gap = np.maximum(self.low[:, None] - high[:, :, None], low[:, :, None] - self.high[:, None])
        np.maximum(gap, 0.0, out=gap)
        gap *= gap
        near = gap[0] + gap[1] <= reach[:, None] * (1.0 + 1e-9)
        first = (near.argmax(axis=1) * _RUN).tolist()
        stop = ((near.shape[1] - near[:, ::-1].argmax(axis=1)) * _RUN).tolist()
        index = np.empty(count, dtype=np.intp)
        for run, (start, end) in enumerate(zip(first, stop, strict=True)):
            at = slice(run * _RUN, run * _RUN + _RUN)
            product = columns[:, at].T @ self.factors[:, start:end]
            product.argmin(axis=1, out=index[at])
            index[at] += start
        return index


def _factors(target: FloatArray) -> FloatArray:
    """(−2 qⱼ, ‖qⱼ‖²) of each column, shape (3, M)."""
    factors = np.empty((3, target.shape[1]))
    np.multiply(target, -2.0, out=factors[:2])
    squares = target * target
    np.add(squares[0], squares[1], out=factors[2])
    return factors


def _boxes(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The corners, each (2, B), of the boxes around runs of points (2, N)."""
    starts = range(0, points.shape[1], _RUN)
    return np.minimum.reduceat(points, starts, axis=1), np.maximum.reduceat(points, starts, axis=1)
