"""Correlative search for the pose of a scan over a window of poses [1]_.

ICP finds the answer that is nearest to its guess. Without wheels the guess is often nearer to
another one. So the search tries all poses of a window, from coarse to fine. A table says for
each place how near the target's points are; a pose's score is the mean over the source's points.
The coarse table holds the best value within half a coarse step, so a coarse score is at least
as high as that of any fine pose around it, as in branch and bound [2]_.

References
----------
.. [1] Olson, "Real-time correlative scan matching", ICRA 2009.
.. [2] Hess, Kohler, Rapp, Andor, "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.result import step_length
from labkit.scan import Scan
from labkit.se2 import from_xytheta
from labkit.support.arrays import FloatArray, IntArray
from labkit.support.compiled import compiled
from labkit.target import Target

CELL, NEAR = 0.1, 4  # [m]: a point this far off counts exp(−½); so many cells off, nothing
COARSE = 4  # cells of a coarse step
TURN = math.radians(2.0)  # of a coarse step
FINE_TURNS = from_xytheta([[0.0, 0.0, math.radians(turn)] for turn in (-1, -0.5, 0, 0.5, 1)])
REACH = 20.0  # [m]: points farther away move too far in a coarse turn
FARTHEST = 10.0  # [m]: a search reaches no farther, however long the robot has been lost
MOST_POINTS = 100  # of the source that are looked up
PROMISING = 200  # coarse poses that are looked at finely
STARTS = 8  # fine poses that are worth trying with ICP, and expected ones
APART = 0.3, math.radians(6.0)  # starts nearer to each other than this are one


@compiled
def mean_values(
    table: FloatArray,
    corner: FloatArray,
    points: FloatArray,
    poses: FloatArray,
    shifts: IntArray,
) -> FloatArray:
    """The mean of the table under points (N, 2) [m], shape (R, S).

    The points are moved by each of the poses (R, 3, 3), and then by each of the shifts (S, 2), in
    cells. `corner` [m] is that of the table's first cell. A cell beyond the table counts as the
    nearest one on its border.
    """
    last_row, last_column = table.shape[0] - 1, table.shape[1] - 1
    means = np.empty((len(poses), len(shifts)))
    rows, columns = np.empty(len(points), np.intp), np.empty(len(points), np.intp)
    for r in range(len(poses)):
        T = poses[r]
        for n in range(len(points)):
            x = T[0, 0] * points[n, 0] + T[0, 1] * points[n, 1] + T[0, 2]
            y = T[1, 0] * points[n, 0] + T[1, 1] * points[n, 1] + T[1, 2]
            rows[n] = math.floor((x - corner[0]) / CELL)
            columns[n] = math.floor((y - corner[1]) / CELL)
        for s in range(len(shifts)):
            down, right, total = shifts[s, 0], shifts[s, 1], 0.0
            for n in range(len(points)):
                i = min(max(rows[n] + down, 0), last_row)
                j = min(max(columns[n] + right, 0), last_column)
                total += table[i, j]
            means[r, s] = total / len(points)
    return means


@compiled
def nearness(occupied: IntArray, shape: tuple[int, int], blunt: int) -> FloatArray:
    """The largest exp(−½ d²) within `blunt` cells, d [cells] away from the nearest `occupied`."""
    field, reach = np.zeros(shape), NEAR + blunt
    values = np.exp(-0.5 * np.maximum(np.abs(np.arange(-reach, reach + 1)) - blunt, 0) ** 2)
    for row, column in occupied:
        for i in range(-reach, reach + 1):
            for j in range(-reach, reach + 1):
                value = values[reach + i] * values[reach + j]
                field[row + i, column + j] = max(field[row + i, column + j], value)
    return field


class LikelihoodField(NamedTuple):
    """Nearness of each cell to the target's points, in [0, 1]."""

    corner: FloatArray  # (2,): of the first cell [m]
    fine: FloatArray  # (H, W): exp(−½ d²) of the distance d [cells] to the nearest point
    coarse: FloatArray  # (H, W): its largest value within half a coarse step

    @classmethod
    def of(cls, points: FloatArray) -> LikelihoodField:
        """The field of points (M, 2) [m], of those within `REACH` of the origin."""
        near = points[np.hypot(points[:, 0], points[:, 1]) < REACH]
        margin = CELL * (NEAR + COARSE)
        low = near.min(axis=0, initial=0.0) - margin
        rows, columns = np.ceil((near.max(axis=0, initial=0.0) + margin - low) / CELL).astype(int)
        occupied = np.floor((near - low) / CELL).astype(np.intp)
        return cls(low, *(nearness(occupied, (rows, columns), by) for by in (0, COARSE // 2)))


def search(
    source: Scan, target: Target, T_target_source: FloatArray, window: tuple[float, float]
) -> list[FloatArray]:
    """At most `STARTS` poses where ICP is worth trying, the best first, apart from each other.

    The window reaches [m] along x and y, and [rad], to either side of `T_target_source`.
    """
    points = source.points[np.hypot(source.points[:, 0], source.points[:, 1]) < REACH]
    points = points[:: max(1, math.ceil(len(points) / MOST_POINTS))]
    if len(points) == 0:
        return []
    field = LikelihoodField.of(target.points)
    reach, most = min(window[0], FARTHEST), math.ceil(min(window[1], math.pi) / TURN)
    points = np.array(points, order="C")  # one kind of array, compiled once and ahead
    turned = T_target_source @ from_xytheta(np.outer(np.arange(-most, most + 1), [0.0, 0.0, TURN]))
    shifts = COARSE * _square(math.ceil(reach / (COARSE * CELL)))
    scores = mean_values(field.coarse, field.corner, points, turned, shifts)
    best = np.argpartition(scores, -min(PROMISING, scores.size), axis=None)[-PROMISING:]
    i, j = np.unravel_index(best, scores.shape)
    poses = turned[i]
    poses[:, :2, 2] += CELL * shifts[j]
    return apart(_finely(points, field, poses), STARTS)


def _finely(points: FloatArray, field: LikelihoodField, poses: FloatArray) -> FloatArray:
    """The best fine pose around each of the coarse ones (P, 3, 3), the best first."""
    shifts, turned = _square(COARSE // 2), poses[:, None] @ FINE_TURNS
    scores = mean_values(field.fine, field.corner, points, turned.reshape(-1, 3, 3), shifts)
    scores = scores.reshape(len(poses), -1)
    k, s = np.unravel_index(scores.argmax(axis=1), (len(FINE_TURNS), len(shifts)))
    fine = turned[np.arange(len(poses)), k]
    fine[:, :2, 2] += CELL * shifts[s]
    return fine[np.argsort(-scores.max(axis=1), kind="stable")]


def apart(poses: FloatArray, count: int) -> list[FloatArray]:
    """The first `count` poses that are not alike one before them."""
    chosen: list[FloatArray] = []
    for T in poses:
        if len(chosen) < count and not any(alike(T, other) for other in chosen):
            chosen.append(T)
    return chosen


def alike(T: FloatArray, other: FloatArray) -> bool:
    """True if two poses are so near to each other that they count as one."""
    moved, turned = step_length(np.array(other), np.array(T))
    return moved < APART[0] and turned < APART[1]


def _square(most: int) -> IntArray:
    """All (i, j) with entries from −most to most, shape (S, 2)."""
    i, j = np.indices((2 * most + 1, 2 * most + 1)) - most
    return np.column_stack([i.ravel(), j.ravel()])
