"""The walls that a map remembers after their key scans left it: a robot comes back to them.

They are rows (x, y, nx, ny) of a point [m] and its normal, in the frame of the first key scan: the
points on lines near which another key scan saw something, too, one in each square of
`REPEAT_DISTANCE`. They stay for ever, so a speck that one scan saw must not be among them.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labkit.neighbors import Grid, cells_around, squared
from labkit.odometry.constants import MAX_RANGE, REPEAT_DISTANCE
from labkit.support.arrays import BoolArray, FloatArray, IntArray
from labkit.support.compiled import compiled
from labkit.target import Target

NO_ROWS = np.empty((0, 4))


class Walls(NamedTuple):
    """Remembered walls in square tiles, so that few of them are looked at, however many there are.

    A tile is as wide as a search looks, `MAX_RANGE`, and named column + i·row.
    """

    tiles: Mapping[complex, FloatArray]  # (M, 4) each

    def add(self, rows: FloatArray) -> Walls:
        """These walls and more, (N, 4); of each square the first one stays."""
        tiles = dict(self.tiles)
        tile_of_row = squares_of(rows, MAX_RANGE)
        for tile in np.unique(tile_of_row).tolist():
            both = np.vstack([tiles.get(tile, NO_ROWS), rows[tile_of_row == tile]])
            tiles[tile] = both[first_of_squares(both, REPEAT_DISTANCE)]
        return Walls(tiles)

    def around(self, T: FloatArray) -> FloatArray:
        """Those in the tile of a pose (3, 3), and in the eight around it, (K, 4)."""
        [tile] = squares_of(T[None, :2, 2], MAX_RANGE).tolist()
        near = [tile + complex(i, j) for i, j in product((-1, 0, 1), repeat=2)]
        return np.vstack([self.tiles.get(each, NO_ROWS) for each in near])


NO_WALLS = Walls({})


def squares_of(rows: FloatArray, side: float) -> NDArray[np.complex128]:
    """In which square of this side [m] each of the rows (x, y, …) lies: column + i·row.

    One number each: sorted in a tenth of the time of a pair.
    """
    column, row = np.floor(rows[:, :2] / side).T
    return np.asarray(column + 1j * row)


def first_of_squares(rows: FloatArray, side: float) -> IntArray:
    """The first of the rows (x, y, …) in each square of this side [m], square by square."""
    return np.unique(squares_of(rows, side), return_index=True)[1]


def with_normals(target: Target, rows: slice = slice(None)) -> FloatArray:
    """The points of a target and their normals, (N, 4), or some of these rows."""
    return np.hstack([target.points[rows], target.normals[rows]])


def move(rows: FloatArray, T: FloatArray) -> FloatArray:
    """Points and their normals (N, 4), moved by a transform (3, 3)."""
    R = T[:2, :2]
    return np.hstack([rows[:, :2] @ R.T + T[:2, 2], rows[:, 2:] @ R.T])


def walls_seen_twice(target: Target, first: int, end: int) -> FloatArray:
    """Of a target's rows from `first` to before `end` those on a line and near a later one."""
    leaving = with_normals(target, slice(first, end))
    is_seen_twice = mask_near(leaving, target, end, len(target.points))
    return leaving[is_seen_twice & np.isfinite(leaving[:, 2])]


def mask_near(rows: FloatArray, target: Target, first: int, end: int) -> BoolArray:
    """Mask of the rows (x, y, …) near one of a target's points from `first` to before `end`."""
    points = np.array(rows[:, :2], order="C")
    return mask_within(points, target.search.grid, first, end, REPEAT_DISTANCE)


@compiled
def mask_within(points: FloatArray, grid: Grid, first: int, end: int, distance: float) -> BoolArray:
    """Mask of the points (N, 2) within a distance [m] of one of those rows of a grid."""
    is_near = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        left, right, low, high = cells_around(x, y, distance, grid)
        for line in range(low, high + 1):
            row = line * grid.columns
            for k in range(grid.start[row + left], grid.start[row + right + 1]):
                is_meant = first <= grid.rows[k] < end
                if is_meant and squared(x, y, grid.entries, k) < distance * distance:
                    is_near[i] = True
    return is_near
