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
SAFELY = 1.0 + 1e-9  # a margin for rounding
ROUNDING = 1e-6  # of a cell's side: a point may lie this far beyond its cell


def nearest_by_brute_force(points: FloatArray, target: FloatArray) -> IntArray:
    """Index of the nearest target point of each row, by all N·M distances: O(N M)."""
    dx, dy = points[:, :1] - target[:, 0], points[:, 1:] - target[:, 1]
    return np.asarray(np.argmin(dx * dx + dy * dy, axis=1))


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
        checked = as_points(points, "points")
        rows, places = np.zeros((len(checked), 2), np.intp), np.zeros((len(checked), 2))
        return nearest(checked, self.grid, math.inf, Known(rows, places, np.zeros(len(checked))))


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
    per_metre = 1.0 / side if side > 1e-150 else 1.0  # all points coincide
    columns, lines = int(width * per_metre) + 1, int(height * per_metre) + 1
    cell, start = np.empty(count, np.intp), np.zeros(columns * lines + 1, np.intp)
    for i in range(count):
        line = cell_index((points[i, 1] - low) * per_metre, lines)
        cell[i] = line * columns + cell_index((points[i, 0] - left) * per_metre, columns)
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
    sample = values[:: max(1, len(values) // SAMPLE)].copy()
    tenth = len(sample) // 10
    low, high = select(sample, tenth), select(sample, len(sample) - 1 - tenth)
    least, most = values[0], values[0]
    for value in values:
        least, most = min(least, value), max(most, value)
    if low == high:
        return least, most
    return max(least, 1.5 * low - 0.5 * high), min(most, 1.5 * high - 0.5 * low)


@compiled
def cell_index(offset: float, count: int) -> int:
    """Column (or line) at this offset from the edge [cells]; the border's for one outside."""
    return int(min(max(offset, 0.0), count - 1.0))


@compiled
def cells_around(x: float, y: float, radius: float, grid: Grid) -> tuple[int, int, int, int, float]:
    """First and last column, first and last line of the cells that a circle [m] touches.

    And the radius [m] of the circle that they hold.
    """
    u, v = (x - grid.x) * grid.per_metre, (y - grid.y) * grid.per_metre
    r, inside = radius * grid.per_metre + ROUNDING, math.inf
    left, right = cell_index(u - r, grid.columns), cell_index(u + r, grid.columns)
    low, high = cell_index(v - r, grid.lines), cell_index(v + r, grid.lines)
    if left > 0:
        inside = min(inside, u - left)
    if right < grid.columns - 1:
        inside = min(inside, right + 1.0 - u)
    if low > 0:
        inside = min(inside, v - low)
    if high < grid.lines - 1:
        inside = min(inside, high + 1.0 - v)
    return left, right, low, high, (inside - ROUNDING) / grid.per_metre


class Known(NamedTuple):
    """Memory of a search for the next one, row by row."""

    rows: IntArray  # (N, 2), two target points
    places: FloatArray  # (N, 2), from where they are the nearest ones [m]
    clear: FloatArray  # (N,), the distance from there within which lies no other [m]


@compiled
def nothing_known(count: int) -> Known:
    """The start of a search for so many points."""
    return Known(np.zeros((count, 2), np.intp), np.zeros((count, 2)), np.zeros(count))


@compiled
def nearest(
    points: FloatArray, grid: Grid, reach: float, known: Known
) -> tuple[IntArray, FloatArray]:
    """Row and distance [m] of the nearest target point within `reach` [m]; −1 and inf for none.

    Where a point has moved so little that no third target point can be the nearest, one of the
    two known ones is [1]_. Else the search goes out to the nearest point known so far, in one
    circle or a few growing ones.

    .. [1] Greenspan, Godin, "A nearest neighbor method for efficient ICP", 3DIM 2001.
    """
    index, distance = np.empty(len(points), np.intp), np.empty(len(points))
    before = 0  # the partner of the point before
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        row, other = known.rows[i, 0], known.rows[i, 1]
        square, square_other = squared(x, y, grid.points, row), squared(x, y, grid.points, other)
        if square_other < square or (square_other == square and other < row):
            row, other, square = other, row, square_other
        moved = math.sqrt(squared(x, y, known.places, i))
        if not (math.sqrt(square) + moved) * SAFELY < known.clear[i]:
            square = min(square, squared(x, y, grid.points, before))
            row, other, square, known.clear[i] = search_around(x, y, grid, reach, square)
            known.rows[i, 0], known.rows[i, 1] = row, other
            known.places[i, 0], known.places[i, 1] = x, y
        before = row
        within = square <= reach * reach
        index[i], distance[i] = (row, math.sqrt(square)) if within else (-1, math.inf)
    return index, distance


@compiled
def squared(x: float, y: float, points: FloatArray, i: int) -> float:
    """The squared distance [m²] from (x, y) to point i."""
    dx, dy = x - points[i, 0], y - points[i, 1]
    return float(dx * dx + dy * dy)


@compiled
def search_around(
    x: float, y: float, grid: Grid, reach: float, square: float
) -> tuple[int, int, float, float]:
    """Rows of the two nearest target points, the squared distance [m²] of the first, the clearance.

    `square` [m²] is that of a target point nearby: the first circle goes there.
    """
    radius = min(SAFELY * math.sqrt(square), reach, 1.0 / grid.per_metre)
    while True:
        a, b, least, second, third = 0, 0, math.inf, math.inf, math.inf
        left, right, low, high, clear = cells_around(x, y, radius, grid)
        for line in range(low, high + 1):
            first = grid.start[line * grid.columns + left]
            for k in range(first, grid.start[line * grid.columns + right + 1]):
                square = squared(x, y, grid.entries, k)
                if square <= third:
                    row = grid.rows[k]
                    if square < least or (square == least and row < a):
                        a, b, least, second, third = row, a, square, least, second
                    elif square < second:
                        b, second, third = row, square, second
                    else:
                        third = square
        if least <= clear * clear or radius >= reach:
            return a, b, least, min(clear, math.sqrt(third))
        radius = min(2.0 * radius, reach, SAFELY * math.sqrt(least))


@compiled
def neighbors_of(
    x: float, y: float, grid: Grid, reach: float, radius: float, rows: IntArray, squares: FloatArray
) -> int:
    """Find the target points nearest to (x, y) within `reach` [m], and return how many.

    As many as `rows` takes, in ascending order; `squares` takes their squared distances [m²].
    The search begins with a circle of this `radius` [m], or of a cell's side where that is more.
    """
    size, radius = len(rows), min(reach, max(radius, 1.0 / grid.per_metre))
    while True:
        found, most = 0, radius * radius
        left, right, low, high, _ = cells_around(x, y, radius, grid)
        for line in range(low, high + 1):
            first = grid.start[line * grid.columns + left]
            for k in range(first, grid.start[line * grid.columns + right + 1]):
                square, row = squared(x, y, grid.entries, k), grid.rows[k]
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
