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

from labkit.odometry.constants import (
    CELL,
    COARSE_CELLS,
    COARSE_TURN,
    MAX_COARSE_POSES,
    MAX_POINTS,
    MAX_RANGE,
    MAX_STARTS,
    SAME_POSE,
)
from labkit.result import step_length
from labkit.scan import Scan
from labkit.se2 import from_xytheta
from labkit.support.arrays import FloatArray, IntArray
from labkit.support.compiled import compiled
from labkit.target import Target


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
    last_row = table.shape[0] - 1
    last_column = table.shape[1] - 1
    means = np.empty((len(poses), len(shifts)))
    rows = np.empty(len(points), np.intp)
    columns = np.empty(len(points), np.intp)
    for r in range(len(poses)):
        T = poses[r]
        for n in range(len(points)):
            x = T[0, 0] * points[n, 0] + T[0, 1] * points[n, 1] + T[0, 2]
            y = T[1, 0] * points[n, 0] + T[1, 1] * points[n, 1] + T[1, 2]
            rows[n] = math.floor((x - corner[0]) / CELL)
            columns[n] = math.floor((y - corner[1]) / CELL)
        for s in range(len(shifts)):
            total = 0.0
            for n in range(len(points)):
                i = min(max(rows[n] + shifts[s, 0], 0), last_row)
                j = min(max(columns[n] + shifts[s, 1], 0), last_column)
                total += table[i, j]
            means[r, s] = total / len(points)
    return means


@compiled
def nearness(occupied: IntArray, shape: tuple[int, int], margin: int) -> FloatArray:
    """The largest exp(−½ d²) within `margin` cells, d [cells] away from the nearest `occupied`."""
    table = np.zeros(shape)
    reach = COARSE_CELLS + margin
    offsets = np.abs(np.arange(-reach, reach + 1))
    values = np.exp(-0.5 * np.maximum(offsets - margin, 0) ** 2)
    for row, column in occupied:
        for i in range(-reach, reach + 1):
            for j in range(-reach, reach + 1):
                value = values[reach + i] * values[reach + j]
                table[row + i, column + j] = max(table[row + i, column + j], value)
    return table


class LikelihoodField(NamedTuple):
    """Nearness of each cell to the target's points, in [0, 1]."""

    corner: FloatArray  # (2,): of the first cell [m]
    fine: FloatArray  # (H, W): exp(−½ d²) of the distance d [cells] to the nearest point
    coarse: FloatArray  # (H, W): its largest value within half a coarse step

    @classmethod
    def of(cls, points: FloatArray) -> LikelihoodField:
        """The field of points (M, 2) [m], of those within `MAX_RANGE` of the origin."""
        points = within_range(points)
        border = CELL * (COARSE_CELLS + COARSE_CELLS)
        low = points.min(axis=0, initial=0.0) - border
        high = points.max(axis=0, initial=0.0) + border
        rows, columns = np.ceil((high - low) / CELL).astype(int)
        is_occupied = np.zeros((rows, columns), np.bool_)
        row, column = np.floor((points - low) / CELL).astype(np.intp).T
        is_occupied[row, column] = True
        occupied = np.array(np.argwhere(is_occupied), order="C")
        fine = nearness(occupied, (rows, columns), 0)
        coarse = nearness(occupied, (rows, columns), COARSE_CELLS // 2)
        return cls(low, fine, coarse)


def within_range(points: FloatArray) -> FloatArray:
    """The points (N, 2) [m] within `MAX_RANGE` of the origin."""
    return points[np.hypot(points[:, 0], points[:, 1]) < MAX_RANGE]


def search(
    source: Scan, target: Target, T_target_source: FloatArray, window: tuple[float, float]
) -> list[FloatArray]:
    """At most `MAX_STARTS` poses where ICP is worth trying, the best first, apart from each other.

    The window reaches [m] along x and y, and [rad], to either side of `T_target_source`.
    """
    points = within_range(source.points)
    points = points[:: max(1, math.ceil(len(points) / MAX_POINTS))]
    if len(points) == 0:
        return []
    field = LikelihoodField.of(target.points)
    points = np.array(points, order="C")  # one kind of array, compiled once and ahead
    turn_count = math.ceil(min(window[1], math.pi) / COARSE_TURN)
    turns = np.outer(np.arange(-turn_count, turn_count + 1), [0.0, 0.0, COARSE_TURN])
    max_shift = min(window[0], 0.5 * MAX_RANGE)
    shifts = COARSE_CELLS * _square(math.ceil(max_shift / (COARSE_CELLS * CELL)))
    rotated = T_target_source @ from_xytheta(turns)
    scores = mean_values(field.coarse, field.corner, points, rotated, shifts)
    highest = np.argpartition(scores, -min(MAX_COARSE_POSES, scores.size), axis=None)
    turn, shift = np.unravel_index(highest[-MAX_COARSE_POSES:], scores.shape)
    poses = rotated[turn]
    poses[:, :2, 2] += CELL * shifts[shift]
    return drop_duplicates(refine(points, field, poses), MAX_STARTS)


def refine(points: FloatArray, field: LikelihoodField, poses: FloatArray) -> FloatArray:
    """The best fine pose around each of the coarse ones (P, 3, 3), the best first."""
    shifts = _square(COARSE_CELLS // 2)
    turns = np.outer(np.linspace(-0.5, 0.5, 5), [0.0, 0.0, COARSE_TURN])
    rotated = poses[:, None] @ from_xytheta(turns)
    scores = mean_values(field.fine, field.corner, points, rotated.reshape(-1, 3, 3), shifts)
    scores = scores.reshape(len(poses), -1)
    turn, shift = np.unravel_index(scores.argmax(axis=1), (len(turns), len(shifts)))
    fine = rotated[np.arange(len(poses)), turn]
    fine[:, :2, 2] += CELL * shifts[shift]
    return fine[np.argsort(-scores.max(axis=1), kind="stable")]


def drop_duplicates(poses: FloatArray, count: int) -> list[FloatArray]:
    """The first `count` poses, without those that count as one with a pose before them."""
    chosen: list[FloatArray] = []
    for T in poses:
        if len(chosen) < count and not any(is_same_pose(T, T_chosen) for T_chosen in chosen):
            chosen.append(T)
    return chosen


def is_same_pose(T_a: FloatArray, T_b: FloatArray) -> bool:
    """True if two poses are so near to each other that they count as one."""
    shift, turn = step_length(np.array(T_b), np.array(T_a))
    return shift < SAME_POSE[0] and turn < SAME_POSE[1]


def _square(radius: int) -> IntArray:
    """All (i, j) with entries from −radius to radius, shape (S, 2)."""
    i, j = np.indices((2 * radius + 1, 2 * radius + 1)) - radius
    return np.column_stack([i.ravel(), j.ravel()])
