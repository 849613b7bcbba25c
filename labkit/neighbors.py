"""Nearest-neighbour search: box D of the lesson's flow chart (section 4).

All N·M distances are the definition: `nearest_by_brute_force`. The loop asks a grid instead.
It sorts the target into square cells once, and then looks only into the cells around a point.
Both give the same answers, bit for bit; of equally near points both take the first.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from labkit.scan import Scan, as_scan
from labkit.selection import kth_smallest
from labkit.support.arrays import FloatArray, IntArray, as_points
from labkit.support.compiled import compiled

CELLS_PER_POINT = 8  # walls fill few of the cells
BORDER_SAMPLE = 32  # points by which the grid's borders are chosen
ROUNDING_MARGIN = 1.0 + 1e-9  # factor on a distance, so that rounding loses no point
CELL_TOLERANCE = 1e-6  # of a cell's side: rounding may place a point this far beyond its cell
MIN_SIDE = 1e-150  # [m]: narrower cells mean that all points coincide


def nearest_by_brute_force(points: ArrayLike, target: ArrayLike) -> IntArray:
    """Index of the nearest target point of each row, by all N·M distances: O(N M)."""
    p = as_points(points, "points", minimum=0)
    q = as_points(target, "target")
    dx = p[:, :1] - q[:, 0]
    dy = p[:, 1:] - q[:, 1]
    return np.asarray(np.argmin(dx * dx + dy * dy, axis=1))


# Cell of each point; how many each cell holds, and a 0; lower left [m]; 1 / side; columns, lines.
Cells = tuple[IntArray, IntArray, float, float, float, int, int]


class NearestNeighbors:
    """Nearest-neighbour search in a target, points (M, 2) [m], built once and asked often.

    Examples
    --------
    >>> search = NearestNeighbors([[0.0, 0.0], [2.0, 0.0]])
    >>> index, distance = search.query([[1.5, 0.0]])
    >>> int(index[0]), float(distance[0])
    (1, 0.5)
    """

    def __init__(self, target: Scan | ArrayLike) -> None:
        self.target = as_scan(target, "target", minimum=1).points
        self.grid = Grid(self.target, *sort_into_cells(self.target))

    def __reduce__(self) -> tuple[Any, ...]:
        """Build the grid anew where it is unpickled: its arrays are read-only there, too."""
        return NearestNeighbors, (self.target,)

    def query(self, points: ArrayLike) -> tuple[IntArray, FloatArray]:
        """Row and distance [m] of the target point nearest to each of the points (N, 2) [m]."""
        return nearest_in_grid(as_points(points, "points"), self.grid)


class Grid(NamedTuple):
    """Points sorted into square cells; those of cell k are entries start[k] to start[k + 1] − 1.

    Of points that coincide, the first one is an entry.
    """

    points: FloatArray  # (M, 2), in their own order [m]
    entries: FloatArray  # (K, 2), cell by cell
    rows: IntArray  # (K,), the row of each entry in `points`
    start: IntArray  # (lines · columns + 1,)
    x: float  # the lower left corner [m]
    y: float
    per_metre: float  # cells along one metre
    columns: int
    lines: int


@compiled
def sort_into_cells(
    points: FloatArray,
) -> tuple[FloatArray, IntArray, IntArray, float, float, float, int, int]:
    """Sort points (M, 2) into the cells of a `Grid`; outliers go to border cells.

    Of points that coincide, the first one is an entry.
    """
    cell, start, left, low, per_metre, columns, lines = choose_cells(points)
    for c in range(columns * lines):  # `start` holds counts, of which it makes the cells' ends
        start[c + 1] += start[c]
    entries = np.empty((len(points), 2))
    rows = np.empty(len(points), np.intp)
    for i in range(len(points) - 1, -1, -1):  # from the end of each cell to its start
        start[cell[i]] -= 1
        k = start[cell[i]]
        entries[k, 0] = points[i, 0]
        entries[k, 1] = points[i, 1]
        rows[k] = i

    count = 0  # entries that are kept
    for c in range(columns * lines):
        begin = count
        for k in range(start[c], start[c + 1]):
            if not has_point(entries, begin, count, entries[k, 0], entries[k, 1]):
                entries[count, 0] = entries[k, 0]
                entries[count, 1] = entries[k, 1]
                rows[count] = rows[k]
                count += 1
        start[c] = begin
    start[columns * lines] = count
    return entries[:count], rows[:count], start, left, low, per_metre, columns, lines


@compiled
def has_point(entries: FloatArray, begin: int, end: int, x: float, y: float) -> bool:
    """True if one of the entries from `begin` to `end` lies at (x, y)."""
    k = begin
    while k < end and not (entries[k, 0] == x and entries[k, 1] == y):
        k += 1
    return k < end


@compiled
def choose_cells(points: FloatArray) -> Cells:
    """Cells that the points fill evenly: those around the fullest one, while it holds the most."""
    left, right = trimmed_range(points[:, 0])
    low, high = trimmed_range(points[:, 1])
    cells, fullest, crowding = count_in_cells(points, left, right, low, high)
    while fullest > len(points) // 2:
        cell, counts = cells[0], cells[1]
        crowd = points[cell == np.argmax(counts)]
        left, right = crowd[:, 0].min(), crowd[:, 0].max()
        low, high = crowd[:, 1].min(), crowd[:, 1].max()
        closer, fullest, closer_crowding = count_in_cells(points, left, right, low, high)
        if not 2.0 * closer_crowding < crowding:
            break
        cells, crowding = closer, closer_crowding
    return cells


@compiled
def count_in_cells(
    points: FloatArray, left: float, right: float, low: float, high: float
) -> tuple[Cells, int, float]:
    """Count the points in square cells of a rectangle [m].

    Returns the cells, how many points lie in the fullest one, and the sum of their squares.
    """
    width, height = right - left, high - low
    cells = CELLS_PER_POINT * len(points)
    side = max(math.sqrt(width * height / cells), (width + height) / cells)
    per_metre = 1.0 / side if side > MIN_SIDE else 1.0
    columns = int(width * per_metre) + 1
    lines = int(height * per_metre) + 1

    cell = np.empty(len(points), np.intp)
    counts = np.zeros(columns * lines + 1, np.intp)
    for i in range(len(points)):
        column = cell_index((points[i, 0] - left) * per_metre, columns)
        line = cell_index((points[i, 1] - low) * per_metre, lines)
        cell[i] = line * columns + column
        counts[cell[i]] += 1
    crowding = 0.0
    for count in counts:
        crowding += float(count) * count
    return (cell, counts, left, low, per_metre, columns, lines), counts.max(), crowding


@compiled
def trimmed_range(values: FloatArray) -> tuple[float, float]:
    """Lowest and highest value without outliers.

    The middle four fifths of a sample, made wider by half their width on either side.
    """
    sample = values[:: max(1, len(values) // BORDER_SAMPLE)].copy()
    tenth = len(sample) // 10
    low = kth_smallest(sample, tenth)
    high = kth_smallest(sample, len(sample) - 1 - tenth)
    smallest = values[0]
    largest = values[0]
    for value in values:
        smallest = min(smallest, value)
        largest = max(largest, value)
    if low == high:
        return smallest, largest
    return max(smallest, 1.5 * low - 0.5 * high), min(largest, 1.5 * high - 0.5 * low)


@compiled
def cell_index(offset: float, count: int) -> int:
    """Column (or line) at this offset from the edge [cells]; the border's for one outside."""
    return int(min(max(offset, 0.0), count - 1.0))


@compiled
def cells_around(x: float, y: float, radius: float, grid: Grid) -> tuple[int, int, int, int]:
    """The block of cells that a circle [m] touches: first and last column, first and last line."""
    column = (x - grid.x) * grid.per_metre  # where the centre lies among the cells
    line = (y - grid.y) * grid.per_metre
    reach = radius * grid.per_metre + CELL_TOLERANCE  # [cells]
    left = cell_index(column - reach, grid.columns)
    right = cell_index(column + reach, grid.columns)
    low = cell_index(line - reach, grid.lines)
    high = cell_index(line + reach, grid.lines)
    return left, right, low, high


@compiled
def radius_within(x: float, y: float, block: tuple[int, int, int, int], grid: Grid) -> float:
    """Radius [m] of the largest circle about (x, y) all of whose points lie in a block of cells.

    On a side where the block ends with the grid, its cells hold all points beyond, too.
    """
    column = (x - grid.x) * grid.per_metre
    line = (y - grid.y) * grid.per_metre
    left, right, low, high = block
    radius = math.inf  # [cells]
    if left > 0:
        radius = min(radius, column - left)
    if right < grid.columns - 1:
        radius = min(radius, right + 1.0 - column)
    if low > 0:
        radius = min(radius, line - low)
    if high < grid.lines - 1:
        radius = min(radius, high + 1.0 - line)
    return (radius - CELL_TOLERANCE) / grid.per_metre


class Search(NamedTuple):
    """A search in a grid that remembers, per source point, the two nearest of the last search."""

    grid: Grid
    candidates: IntArray  # (N, 2), rows of the two target points nearest at the last search
    places: FloatArray  # (N, 2), where the source point lay at that search [m]
    clearance: FloatArray  # (N,), distance from that place within which lies no third point [m]


@compiled
def start_search(grid: Grid, count: int) -> Search:
    """A search for `count` source points that remembers nothing yet."""
    return Search(grid, np.zeros((count, 2), np.intp), np.zeros((count, 2)), np.zeros(count))


@compiled
def nearest(points: FloatArray, search: Search, reach: float) -> tuple[IntArray, FloatArray]:
    """Row and distance [m] of the nearest target point within `reach` [m]; −1 and inf for none.

    A point that has moved so little that no third target point can be the nearest takes the
    nearer of its two candidates [1]_. Any other point searches the cells around it, out to the
    nearest target point known so far.

    .. [1] Greenspan, Godin, "A nearest neighbor method for efficient ICP", 3DIM 2001.
    """
    grid = search.grid
    index = np.empty(len(points), np.intp)
    distance = np.empty(len(points))
    previous = 0  # the partner of the point before
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        row, second = search.candidates[i, 0], search.candidates[i, 1]
        square = squared(x, y, grid.points, row)
        second_square = squared(x, y, grid.points, second)
        if comes_before(second_square, second, square, row):
            row = second
            square = second_square
        moved = math.sqrt(squared(x, y, search.places, i))
        if not (math.sqrt(square) + moved) * ROUNDING_MARGIN < search.clearance[i]:
            known = min(square, squared(x, y, grid.points, previous))
            row, second, square, clearance = search_around(x, y, grid, reach, known)
            search.candidates[i, 0] = row
            search.candidates[i, 1] = second
            search.places[i, 0] = x
            search.places[i, 1] = y
            search.clearance[i] = clearance
        previous = row
        if square <= reach * reach:
            index[i] = row
            distance[i] = math.sqrt(square)
        else:
            index[i] = -1
            distance[i] = math.inf
    return index, distance


@compiled
def nearest_in_grid(points: FloatArray, grid: Grid) -> tuple[IntArray, FloatArray]:
    """Row and distance [m] of the target point nearest to each of the points (N, 2)."""
    return nearest(points, start_search(grid, len(points)), math.inf)


@compiled
def squared(x: float, y: float, points: FloatArray, i: int) -> float:
    """The squared distance [m²] from (x, y) to point i."""
    dx, dy = x - points[i, 0], y - points[i, 1]
    return float(dx * dx + dy * dy)


@compiled
def search_around(
    x: float, y: float, grid: Grid, reach: float, known: float
) -> tuple[int, int, float, float]:
    """The two target points nearest to (x, y), and how far the search can rule out a third.

    Returns the rows of both, the squared distance [m²] of the nearest, and the clearance [m]: no
    third point lies nearer than that. `known` [m²] is the squared distance of some target point,
    which the first circle reaches.

    The search looks at all cells that a circle touches. If a point beyond them could still be the
    nearest, it starts again with a wider circle.
    """
    radius = min(ROUNDING_MARGIN * math.sqrt(known), reach, 1.0 / grid.per_metre)
    while True:
        nearest_row, second_row = 0, 0
        nearest_square, second_square, third_square = math.inf, math.inf, math.inf  # [m²]
        block = cells_around(x, y, radius, grid)
        left, right, low, high = block
        for line in range(low, high + 1):
            begin = grid.start[line * grid.columns + left]
            end = grid.start[line * grid.columns + right + 1]
            for k in range(begin, end):
                square = squared(x, y, grid.entries, k)
                if square > third_square:
                    continue
                row = grid.rows[k]
                if comes_before(square, row, nearest_square, nearest_row):
                    third_square = second_square
                    second_square, second_row = nearest_square, nearest_row
                    nearest_square, nearest_row = square, row
                elif square < second_square:
                    third_square = second_square
                    second_square, second_row = square, row
                else:
                    third_square = square
        seen = radius_within(x, y, block, grid)  # [m]: every point nearer than that was looked at
        if nearest_square <= seen * seen or radius >= reach:
            return nearest_row, second_row, nearest_square, min(seen, math.sqrt(third_square))
        radius = min(2.0 * radius, reach, ROUNDING_MARGIN * math.sqrt(nearest_square))


@compiled
def comes_before(square: float, row: int, other_square: float, other_row: int) -> bool:
    """True if a point is nearer than another one, or as near and of a smaller row."""
    return square < other_square or (square == other_square and row < other_row)


@compiled
def neighbors_of(
    x: float, y: float, grid: Grid, reach: float, radius: float, rows: IntArray, squares: FloatArray
) -> int:
    """Find the target points nearest to (x, y) within `reach` [m]; return their number.

    Fills `rows` with as many as it has place for, the nearest first, and `squares` with their
    squared distances [m²]. The first circle has this `radius` [m], or a cell's side if that is
    more; the circle grows until it holds enough points.
    """
    size = len(rows)
    radius = min(reach, max(radius, 1.0 / grid.per_metre))
    while True:
        count = 0
        limit = radius * radius  # [m²]: points farther away are passed over
        left, right, low, high = cells_around(x, y, radius, grid)
        for line in range(low, high + 1):
            begin = grid.start[line * grid.columns + left]
            end = grid.start[line * grid.columns + right + 1]
            for k in range(begin, end):
                square = squared(x, y, grid.entries, k)
                if square <= limit:
                    count = insert_neighbor(square, grid.rows[k], rows, squares, count)
                    if count == size:
                        limit = squares[-1]
        if count == size or radius >= reach:
            return count
        radius = min(2.0 * radius, reach)


@compiled
def insert_neighbor(
    square: float, row: int, rows: IntArray, squares: FloatArray, count: int
) -> int:
    """Insert a point among the `count` nearest so far, in their order; return how many they are.

    Where all places are taken, the last point drops out, or the new one if it comes behind.
    """
    if count < len(rows):
        count += 1
    elif not comes_before(square, row, squares[-1], rows[-1]):
        return count
    j = count - 1
    while j > 0 and comes_before(square, row, squares[j - 1], rows[j - 1]):
        squares[j] = squares[j - 1]
        rows[j] = rows[j - 1]
        j -= 1
    squares[j] = square
    rows[j] = row
    return count
