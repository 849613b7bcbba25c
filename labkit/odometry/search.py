"""Correlative search for the pose of a scan over a window of poses [1]_.

ICP finds the answer that is nearest to its guess. Without wheels the guess is often nearer to
another one. So the search tries all poses of a window, from coarse to fine. A table, made once
per target, says for each place how near the target's points are; a pose's score is the mean
over the source's points. The coarse table holds the best value within half a coarse step, so a
coarse score is at least as high as that of any fine pose around it, as in branch and bound [2]_.

Scans leave some motions open: along a corridor any motion fits, and where two places look
alike, both fit. Wheels tell the right one; without wheels, one of the last few motions does.

References
----------
.. [1] Olson, "Real-time correlative scan matching", ICRA 2009.
.. [2] Hess, Kohler, Rapp, Andor, "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import scipy  # its parts are loaded when they are used

from labkit.arrays import FloatArray, IntArray
from labkit.compiled import compiled
from labkit.line_alignment import Information
from labkit.result import step_length
from labkit.scan import Scan
from labkit.se2 import from_xytheta, relative, to_xytheta
from labkit.target import Target

CELL = 0.1  # [m], of the table
SPREAD = 0.15  # [m]: a point this far off counts exp(−½)
COARSE = 4  # cells of a coarse step
TURN = math.radians(2.0)  # of a coarse step
FINE_TURNS = np.radians([-1.0, -0.5, 0.0, 0.5, 1.0])
REACH = 20.0  # [m]: points farther away move too far in a coarse turn
MOST_POINTS = 100  # of the source that are looked up
PROMISING = 60  # coarse poses that are looked at finely
STARTS = 16  # fine poses that are worth trying with ICP
APART = 0.3, math.radians(6.0)  # starts nearer to each other than this are one
REMEMBERED = 20  # motions
USUAL = 0.5, math.radians(20.0)  # [m] and [rad]: motions that differ so much are unlike
AGE = 0.05  # what each step since a motion adds to its surprise


@compiled
def mean_values(table: FloatArray, cells: IntArray, shifts: IntArray) -> FloatArray:
    """The mean of the table under cells (R, N, 2) moved by shifts (S, 2), shape (R, S).

    A cell beyond the table counts as the nearest one on its border.
    """
    last_row, last_column = table.shape[0] - 1, table.shape[1] - 1
    means = np.empty((len(cells), len(shifts)))
    for r in range(len(cells)):
        for s in range(len(shifts)):
            down, right, total = shifts[s, 0], shifts[s, 1], 0.0
            for n in range(cells.shape[1]):
                i = min(max(cells[r, n, 0] + down, 0), last_row)
                j = min(max(cells[r, n, 1] + right, 0), last_column)
                total += table[i, j]
            means[r, s] = total / cells.shape[1]
    return means


@dataclass(frozen=True, eq=False, kw_only=True)
class LikelihoodField:
    """Nearness of each cell to the target's points, in [0, 1]."""

    origin: FloatArray  # (2,): the corner of the first cell [m]
    fine: FloatArray  # (H, W): exp(−½ (d/SPREAD)²) of the distance d to the nearest point
    coarse: FloatArray  # (H, W): its largest value within half a coarse step

    @classmethod
    def of(cls, points: FloatArray) -> LikelihoodField:
        """The field of points (M, 2) [m], of those within `REACH` of the origin."""
        near = points[np.hypot(points[:, 0], points[:, 1]) < REACH]
        margin = CELL * (COARSE + 6)
        low = near.min(axis=0, initial=0.0) - margin
        size = np.ceil((near.max(axis=0, initial=0.0) + margin - low) / CELL).astype(np.intp)
        cells = np.unique(np.floor((near - low) / CELL) @ [1j, 1.0])
        cells = np.column_stack([cells.imag, cells.real]).astype(np.intp)
        offsets = _square(4)
        values = np.exp(-0.5 * (np.hypot(*offsets.T) * CELL / SPREAD) ** 2)
        fine = np.zeros(size)
        for k in np.argsort(values, kind="stable"):  # from the edge in, so that the best remains
            fine[cells[:, 0] + offsets[k, 0], cells[:, 1] + offsets[k, 1]] = values[k]
        coarse = scipy.ndimage.maximum_filter(fine, size=COARSE + 1, mode="constant")
        return cls(origin=low, fine=fine, coarse=coarse)

    def cells(self, points: FloatArray) -> IntArray:
        """The cells that points (..., 2) lie in."""
        return np.floor((points - self.origin) / CELL).astype(np.intp)


_fields: WeakKeyDictionary[Target, LikelihoodField] = WeakKeyDictionary()


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
    if target not in _fields:
        _fields[target] = LikelihoodField.of(target.points)
    field = _fields[target]
    x, y, turn = to_xytheta(T_target_source).tolist()
    shifts = COARSE * _square(math.ceil(window[0] / (COARSE * CELL)))
    most = math.ceil(window[1] / TURN)
    turns, middle = turn + TURN * np.arange(-most, most + 1), np.array([x, y])
    scores = mean_values(field.coarse, field.cells(_turned(points, turns) + middle), shifts)
    best = np.argsort(scores, axis=None)[::-1][:PROMISING]
    i, j = np.unravel_index(best, scores.shape)
    return apart(_finely(points, field, turns[i], middle + CELL * shifts[j]), STARTS)


def _finely(
    points: FloatArray, field: LikelihoodField, turns: FloatArray, places: FloatArray
) -> FloatArray:
    """The best fine pose around each of the coarse ones (P,) and (P, 2), the best first."""
    shifts = _square(COARSE // 2)
    fine_turns = turns[:, None] + FINE_TURNS
    moved = _turned(points, fine_turns) + places[:, None, None]
    cells = field.cells(moved).reshape(-1, len(points), 2)
    scores = mean_values(field.fine, cells, shifts).reshape(len(turns), -1)
    winner = scores.argmax(axis=1)
    which = np.arange(len(turns))
    k, s = np.unravel_index(winner, (len(FINE_TURNS), len(shifts)))
    poses = np.column_stack([places + CELL * shifts[s], fine_turns[which, k]])
    return from_xytheta(poses[np.argsort(-scores[which, winner], kind="stable")])


def apart(poses: Iterable[FloatArray], count: int) -> list[FloatArray]:
    """The first `count` poses that are not alike one before them."""
    chosen: list[FloatArray] = []
    for T in poses:
        if len(chosen) < count and not any(alike(T, other) for other in chosen):
            chosen.append(T)
    return chosen


def alike(T: FloatArray, other: FloatArray) -> bool:
    """True if two poses are so near to each other that they count as one."""
    if not math.hypot(T[0, 2] - other[0, 2], T[1, 2] - other[1, 2]) < APART[0]:
        return False  # most pairs of poses end here
    return step_length(np.array(other), np.array(T))[1] < APART[1]


def unlikeliness(T: FloatArray, expected: FloatArray) -> float:
    """0 where the pose T is the likeliest that is expected, 1 where it is unlike any."""
    least = float(_surprise(T, expected, np.zeros((1, 2))).min())
    return least / (1.0 + least)


def completed(T: FloatArray, seen: Information, expected: FloatArray) -> FloatArray:
    """The pose T, moved along what `seen` leaves free to the likeliest expected pose."""
    shifts = [v[:2] / math.hypot(v[0], v[1]) for v in seen.free.T if math.hypot(*v[:2]) > abs(v[2])]
    if not shifts:
        return T
    free = np.array(shifts)
    likeliest = expected[int(_surprise(T, expected, free).argmin())]
    moved = T.copy()
    moved[:2, 2] += ((likeliest[:2, 2] - T[:2, 2]) @ free.T) @ free
    return moved


def _surprise(T: FloatArray, expected: FloatArray, free: FloatArray) -> FloatArray:
    """Distance of T from each pose of `expected` (K, 3, 3), the likeliest first, shape (K,).

    Squared, in `USUAL` ways; the directions `free`, shape (F, 2), do not count.
    """
    offset = expected[:, :2, 2] - T[:2, 2]
    offset = offset - (offset @ free.T) @ free
    turn = relative(T, expected)
    turned = np.arctan2(turn[:, 1, 0], turn[:, 0, 0]) / USUAL[1]
    moved = np.hypot(offset[:, 0], offset[:, 1]) / USUAL[0]
    return np.asarray(moved**2 + turned**2 + AGE * np.arange(len(expected)))


def _turned(points: FloatArray, angles: FloatArray) -> FloatArray:
    """Points (N, 2) turned by angles (...): (..., N, 2)."""
    c, s = np.cos(angles)[..., None], np.sin(angles)[..., None]
    x, y = points.T
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _square(most: int) -> IntArray:
    """All (i, j) with entries from −most to most, shape (S, 2)."""
    steps = np.arange(-most, most + 1)
    i, j = np.meshgrid(steps, steps, indexing="ij")
    return np.column_stack([i.ravel(), j.ravel()])
