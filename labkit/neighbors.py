"""Nearest-neighbour search: box D of the lesson's flow chart (section 4).

All N·M distances are the definition: `nearest_by_brute_force`. The loop asks a grid instead.
It sorts the target into square cells once, and then looks only into the cells around a point.
Both give the same answers, bit for bit; of equally near points both take the first.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from labkit.support.arrays import FloatArray, IntArray, as_points, read_only
from labkit.support.compiled import compiled

CELLS = 8  # cells for each point: walls fill few of them
SAMPLE = 32  # points by which the grid's borders are chosen
ROUNDING = 1e-6  # of a cell's side: a point may lie this far beyond its cell
_BLOCK = 1 << 20  # brute force holds at most this many distances at once


def nearest_by_brute_force(points: FloatArray, target: FloatArray) -> IntArray:
    """Index of the nearest target point of each row, by all N·M distances: O(N M)."""
    index = np.empty(len(points), dtype=np.intp)
    rows = max(1, _BLOCK // len(target))
    for start in range(0, len(points), rows):
        block = points[start : start + rows]
        dx = block[:, 0, None] - target[:, 0]
        dy = block[:, 1, None] - target[:, 1]
        index[start : start + rows] = np.argmin(dx * dx + dy * dy, axis=1)
    return index


class NearestNeighbors:
    """Nearest-neighbour search in a target, points (M, 2) [m], built once and asked often.

    Examples
    --------
    >>> search = NearestNeighbors([[0.0, 0.0], [2.0, 0.0]])
    >>> index, distance = search.query([[1.5, 0.0]])
    >>> int(index[0]), float(distance[0])
    (1, 0.5)
    """

    def __init__(self, target: ArrayLike) -> None:
        self.target = read_only(as_points(target, "target"))
        self.grid = Grid(self.target, *sort_into_cells(self.target))

    def query(self, points: ArrayLike) -> tuple[IntArray, FloatArray]:
        """Row and distance [m] of the target point nearest to each of the points (N, 2) [m]."""
        points = as_points(points, "points")
        return nearest(points, self.grid, math.inf, np.full(len(points), -1))


class Grid(NamedTuple):
    """Points sorted into square cells; those of cell k are entries start[k] to start[k + 1] − 1."""

    points: FloatArray  # (M, 2), in their own order [m]
    entries: FloatArray  # (M, 2), cell by cell
    rows: IntArray  # (M,), of each entry among the points
    start: IntArray  # (lines · columns + 1,)
    x: float  # the lower left corner [m]
    y: float
    per_metre: float  # how many cells
    columns: int
    lines: int


@compiled
def sort_into_cells(
    points: FloatArray,
) -> tuple[FloatArray, IntArray, IntArray, float, float, float, int, int]:
    """Sort points (M, 2) by counting, for a `Grid`; the few that lie far off go to border cells."""
    count = len(points)
    left, right = trimmed_range(points[:, 0])
    low, high = trimmed_range(points[:, 1])
    width, height = right - left, high - low
    side = max(math.sqrt(width * height / (CELLS * count)), (width + height) / (CELLS * count))
    per_metre = 1.0 / side if side > 1e-300 else 1.0  # all points coincide
    columns, lines = int(width * per_metre) + 1, int(height * per_metre) + 1
    cell, start = np.empty(count, np.intp), np.zeros(columns * lines + 1, np.intp)
    for i in range(count):
        line = cell_index(points[i, 1] - low, per_metre, lines)
        cell[i] = line * columns + cell_index(points[i, 0] - left, per_metre, columns)
        start[cell[i] + 1] += 1
    for k in range(columns * lines):
        start[k + 1] += start[k]
    entries, rows, filled = np.empty((count, 2)), np.empty(count, np.intp), start.copy()
    for i in range(count):
        k = filled[cell[i]]
        filled[cell[i]] += 1
        entries[k, 0], entries[k, 1], rows[k] = points[i, 0], points[i, 1], i
    return entries, rows, start, left, low, per_metre, columns, lines


@compiled
def trimmed_range(values: FloatArray) -> tuple[float, float]:
    """A range without outliers, from a sample."""
    sample = values[:: max(1, len(values) // SAMPLE)]
    tenth = len(sample) // 10
    low, high = select(sample, tenth), select(sample, len(sample) - 1 - tenth)
    least, most = values[0], values[0]
    for value in values:
        least, most = min(least, value), max(most, value)
    if low == high:
        return least, most
    return max(least, 1.5 * low - 0.5 * high), min(most, 1.5 * high - 0.5 * low)


@compiled
def cell_index(offset: float, per_metre: float, count: int) -> int:
    """Column (or line) at this offset from the edge [m]; the border's for one outside."""
    return int(min(max(offset * per_metre, 0.0), count - 1.0))


@compiled
def cells_around(x: float, y: float, radius: float, grid: Grid) -> tuple[int, int, int, int]:
    """First and last column, first and last line of the cells that a circle [m] touches."""
    u, v, r = x - grid.x, y - grid.y, radius + ROUNDING / grid.per_metre
    left = cell_index(u - r, grid.per_metre, grid.columns)
    right = cell_index(u + r, grid.per_metre, grid.columns)
    low = cell_index(v - r, grid.per_metre, grid.lines)
    high = cell_index(v + r, grid.per_metre, grid.lines)
    return left, right, low, high


@compiled
def nearest(
    points: FloatArray, grid: Grid, reach: float, guess: IntArray
) -> tuple[IntArray, FloatArray]:
    """Row and distance [m] of the nearest target point within `reach` [m]; −1 and inf for none.

    `guess` names a row of the target for each point, at best that of one nearby, or −1 (then the
    partner of the point before is tried). The search goes out to the nearest point known so far,
    in one circle or a few growing ones.
    """
    index, distance = np.empty(len(points), np.intp), np.full(len(points), np.inf)
    row = -1
    for i in range(len(points)):
        x, y, near, least = points[i, 0], points[i, 1], guess[i], reach * reach
        if near < 0:
            near = row  # the partner of the point before
        row = -1
        if near >= 0:
            dx, dy = x - grid.points[near, 0], y - grid.points[near, 1]
            if dx * dx + dy * dy <= least:
                row, least = near, dx * dx + dy * dy
        radius = min(reach, 1.0 / grid.per_metre)
        if row >= 0:
            radius = min(radius, math.sqrt(least) * (1.0 + 1e-9))
        while True:
            left, right, low, high = cells_around(x, y, radius, grid)
            for line in range(low, high + 1):
                first = grid.start[line * grid.columns + left]
                last = grid.start[line * grid.columns + right + 1]
                for k in range(first, last):
                    dx, dy = x - grid.entries[k, 0], y - grid.entries[k, 1]
                    square = dx * dx + dy * dy
                    if square < least or (square == least and not 0 <= row < grid.rows[k]):
                        row, least = grid.rows[k], square
            if least <= radius * radius or (row < 0 and radius >= reach):
                break
            radius = min(2.0 * radius, reach)
            if row >= 0:
                radius = min(radius, math.sqrt(least) * (1.0 + 1e-9))
        index[i] = row
        if row >= 0:
            distance[i] = math.sqrt(least)
    return index, distance


@compiled
def neighbors_of(
    x: float, y: float, grid: Grid, reach: float, rows: IntArray, squares: FloatArray
) -> int:
    """Find the target points nearest to (x, y) within `reach` [m], and return how many.

    As many as `rows` takes, in ascending order; `squares` takes their squared distances [m²].
    """
    size, radius = len(rows), min(reach, 1.0 / grid.per_metre)
    while True:
        found, most = 0, radius * radius
        left, right, low, high = cells_around(x, y, radius, grid)
        for line in range(low, high + 1):
            first = grid.start[line * grid.columns + left]
            for k in range(first, grid.start[line * grid.columns + right + 1]):
                dx, dy, row = x - grid.entries[k, 0], y - grid.entries[k, 1], grid.rows[k]
                square = dx * dx + dy * dy
                if square > most or (found == size and square == most and row > rows[-1]):
                    continue
                found = min(found + 1, size)
                j = found - 1
                while j > 0 and (
                    squares[j - 1] > square or (squares[j - 1] == square and rows[j - 1] > row)
                ):
                    rows[j], squares[j] = rows[j - 1], squares[j - 1]
                    j -= 1
                rows[j], squares[j] = row, square
                if found == size:
                    most = squares[-1]
        if found == size or radius >= reach:
            return found
        radius = min(2.0 * radius, reach)


@compiled
def select(values: FloatArray, rank: int) -> float:
    """The value of that rank, counted from 0 in ascending order (Hoare's quickselect)."""
    v = values.copy()
    low, high = 0, len(v) - 1
    while low < high:
        pivot, i, j = v[(low + high) // 2], low, high
        while i <= j:
            while v[i] < pivot:
                i += 1
            while v[j] > pivot:
                j -= 1
            if i <= j:
                v[i], v[j] = v[j], v[i]
                i, j = i + 1, j - 1
        if rank <= j:
            high = j
        elif rank >= i:
            low = i
        else:
            break
    return float(v[rank])
