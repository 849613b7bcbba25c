"""Nearest neighbours, exact: of equally near points the first, as by brute force.

A scan's points lie along walls, so that a grid of cells answers in a few comparisons. A grid
is no index where points crowd into few of its cells, nor where they are very many; then a
k-d tree is asked. Both begin from a guess, mostly the partner of the iteration before or its
neighbour on the wall: what is farther than that, or than the gate, need not be looked at.
Both also say how far all other points are at least, so that nobody asks again before the
point has moved as far.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.arrays import FloatArray, IntArray
from labkit.engine.jit import compiled, inlined

CELLS = 8  # of the grid for each point: walls fill few of them
GRID_MAX = 30_000  # points from which on a tree is safer, whatever lies where
CROWDED = 24.0  # points in a point's own cell, on average, beyond which a tree is faster
SAMPLE = 32  # points by which the grid's borders are chosen
LEAF = 8  # points in a leaf of the tree, about
SLACK = 1e-3  # of a cell, by which a box is widened against rounding
NOT_LESS = 1.0 + 1e-9  # against rounding in lower bounds


Entries = tuple[FloatArray, FloatArray, IntArray, IntArray]  # x, y, row, start of an index


class Index(NamedTuple):
    """Points in the order of a grid's cells, or of a tree's leaves where `depth` > 0.

    Entries ``start[k]`` to ``start[k + 1]`` are those of cell k, row by row, or of leaf k.
    """

    x: FloatArray
    y: FloatArray
    row: IntArray  # of each in the target
    start: IntArray
    low_x: float  # the grid's corner [m]
    low_y: float
    per_metre: float  # cells
    columns: int
    rows: int
    depth: int  # of the tree
    split: FloatArray  # [m], of each inner node; its children are 2 k + 1 and 2 k + 2
    axis: IntArray


@compiled
def build(points: FloatArray) -> Index:
    """The index that suits `points`, shape (M, 2)."""
    if len(points) <= GRID_MAX:
        index, crowd = build_grid(points)
        if crowd <= CROWDED:
            return index
    return build_tree(points)


class Partners(NamedTuple):
    """The nearest target point of each of N points, as it was found last."""

    row: IntArray  # in the target; −1 for none
    x: FloatArray  # where the point was then [m]
    y: FloatArray
    clear: FloatArray  # how far from there all other target points were at least [m]


@compiled
def no_partners(count: int) -> Partners:
    """Room for the partners of `count` points, which nobody has looked for."""
    row, clear = np.empty(count, np.intp), np.empty(count)
    for i in range(count):
        row[i], clear[i] = -1, 0.0
    return Partners(row, np.empty(count), np.empty(count), clear)


@compiled
def find_nearest(
    index: Index,
    target: FloatArray,
    x: FloatArray,
    y: FloatArray,
    gate: float,
    asked: IntArray,
    row: IntArray,
    square: FloatArray,
    clear: FloatArray,
) -> None:
    """The nearest target point of the points (x, y) that are `asked` for, up to the gate [m].

    `row` holds a row of the target for each to begin from, or −1 to begin from the partner of
    the one before. `row` takes the partner, `square` its squared distance [m²], and `clear`
    the square of how far all others are at least; −1 and inf where none is within the gate.
    """
    if index.depth > 0:
        find_in_tree(index, target, x, y, gate, asked, row, square, clear)
    else:
        find_in_grid(index, target, x, y, gate, asked, row, square, clear)


# ---------------------------------------------------------------- the grid


@compiled
def build_grid(points: FloatArray) -> tuple[Index, float]:
    """Points sorted into the cells of a grid around most of them; others at its border.

    Also returns how many points lie in a point's own cell, on average.
    """
    count, crowd = len(points), 0
    low_x, high_x = bulk(points, 0)
    low_y, high_y = bulk(points, 1)
    width, height = high_x - low_x, high_y - low_y
    size = max(math.sqrt(width * height / (CELLS * count)), (width + height) / (CELLS * count))
    per_metre = 1.0 / size if size > 0.0 else 1.0
    if not math.isfinite(per_metre):
        per_metre = 1.0
    columns, rows = int(width * per_metre) + 1, int(height * per_metre) + 1
    start = np.zeros(columns * rows + 1, np.intp)
    cell = np.empty(count, np.intp)
    for i in range(count):
        at_x = cell_of((points[i, 0] - low_x) * per_metre, columns)
        at_y = cell_of((points[i, 1] - low_y) * per_metre, rows)
        cell[i] = at_y * columns + at_x
        start[cell[i] + 1] += 1
        crowd += 2 * start[cell[i] + 1] - 1  # the sum of odd numbers is a square
    for k in range(columns * rows):
        start[k + 1] += start[k]
    x, y, row, fill = np.empty(count), np.empty(count), np.empty(count, np.intp), start.copy()
    for i in range(count):
        k = fill[cell[i]]
        fill[cell[i]] += 1
        x[k], y[k], row[k] = points[i, 0], points[i, 1], i
    split, axis = np.empty(0), np.empty(0, np.intp)
    index = Index(x, y, row, start, low_x, low_y, per_metre, columns, rows, 0, split, axis)
    return index, crowd / count


@compiled
def bulk(points: FloatArray, axis: int) -> tuple[float, float]:
    """An interval that holds the points but for a few far off, from a sample of them."""
    count = len(points)
    size = min(count, SAMPLE)
    sample = np.empty(size)
    for k in range(size):
        sample[k] = points[k * count // size, axis]
    low = smallest_in_place(sample, size // 10)
    high = smallest_in_place(sample, size - 1 - size // 10)
    margin = 0.5 * (high - low)
    least, most = math.inf, -math.inf
    for i in range(count):
        least, most = min(least, points[i, axis]), max(most, points[i, axis])
    if margin == 0.0:
        return least, most
    return max(least, low - margin), min(most, high + margin)


@inlined
def cell_of(place: float, count: int) -> int:
    """The cell of a place, counted in cells; the border's for one outside."""
    return int(min(max(place, 0.0), count - 1.0))


@compiled
def find_in_grid(
    index: Index,
    target: FloatArray,
    x: FloatArray,
    y: FloatArray,
    gate: float,
    asked: IntArray,
    row: IntArray,
    square: FloatArray,
    clear: FloatArray,
) -> None:
    """`find_nearest` by boxes around each point, larger until one reaches as far as the nearest."""
    low_x, low_y, per_metre = index.low_x, index.low_y, index.per_metre
    columns, rows = index.columns, index.rows
    entries, found, area = (index.x, index.y, index.row, index.start), -1, 1.0 / per_metre**2
    most = gate * gate * NOT_LESS
    for i in asked:
        guess = row[i] if row[i] >= 0 else found
        best, least = guess_near(target, guess, x[i], y[i], most)
        at_x, at_y = (x[i] - low_x) * per_metre, (y[i] - low_y) * per_metre
        reach = 1.0 + outside(at_x, columns) + outside(at_y, rows)
        while True:
            far = math.sqrt(least) * per_metre + SLACK  # in cells; what it covers is enough
            box = far if far <= reach or reach > columns + rows else reach
            left, right = cell_of(at_x - box, columns), cell_of(at_x + box, columns)
            low, high = cell_of(at_y - box, rows), cell_of(at_y + box, rows)
            second = math.inf
            for r in range(low, high + 1):
                first, last = r * columns + left, r * columns + right
                best, least, second = scan_cells(
                    entries, first, last, x[i], y[i], best, least, second
                )
            if box == far:
                break
            reach *= 2.0
        edge = min(to_edge(at_x, left, right, columns), to_edge(at_y, low, high, rows))
        row[i], clear[i] = best, min(second, edge * edge * area)
        square[i], found = (least, best) if best >= 0 else (math.inf, found)


@inlined
def guess_near(
    target: FloatArray, guess: int, px: float, py: float, most: float
) -> tuple[int, float]:
    """A row to begin from, of a guess and its neighbours, and its squared distance.

    −1 and `most` where none is nearer than that.
    """
    best, least = -1, most
    if guess >= 0:
        best, least = nearer(target, guess, px, py, best, least)
        if guess > 0:
            best, least = nearer(target, guess - 1, px, py, best, least)
        if guess + 1 < len(target):
            best, least = nearer(target, guess + 1, px, py, best, least)
    return best, least


@inlined
def nearer(
    target: FloatArray, row: int, px: float, py: float, best: int, least: float
) -> tuple[int, float]:
    """The nearer one of `best` and `row`, and its squared distance."""
    dx, dy = px - target[row, 0], py - target[row, 1]
    square = dx * dx + dy * dy
    return (row, square) if square < least else (best, least)


@inlined
def scan_cells(
    entries: Entries,
    first: int,
    last: int,
    px: float,
    py: float,
    best: int,
    least: float,
    second: float,
) -> tuple[int, float, float]:
    """The nearest among `best` and the entries of cells `first` to `last`.

    With it goes the least squared distance of all others, if it is below `second`.
    """
    x, y, row, start = entries
    for k in range(start[first], start[last + 1]):
        dx, dy = px - x[k], py - y[k]
        square = dx * dx + dy * dy
        if square <= second and row[k] != best:
            if square < least or (square == least and row[k] < best):
                second = least if best >= 0 else second
                best, least = row[k], square
            else:
                second = square
    return best, least, second


@inlined
def to_edge(place: float, first: int, last: int, count: int) -> float:
    """How far it is at least from a place to what lies beyond cells `first` to `last`."""
    before = place - first - SLACK if first > 0 else math.inf
    behind = last + 1.0 - place - SLACK if last < count - 1 else math.inf
    return max(0.0, min(before, behind))


@inlined
def outside(place: float, count: int) -> float:
    """How many cells a place lies outside the grid."""
    return max(0.0, -place, place - count)


# ---------------------------------------------------------------- the tree


@compiled
def build_tree(points: FloatArray) -> Index:
    """Points in the leaves of a balanced tree, cut across its longer extent at each node."""
    count, depth = len(points), 1
    while count >> depth > LEAF:
        depth += 1
    row = np.empty(count, np.intp)
    for i in range(count):
        row[i] = i
    split, axis = np.empty((1 << depth) - 1), np.empty((1 << depth) - 1, np.intp)
    for level in range(depth):
        for k in range(1 << level):
            begin, end = (count * k) >> level, (count * (k + 1)) >> level
            middle = (count * (2 * k + 1)) >> (level + 1)
            node = (1 << level) - 1 + k
            axis[node] = longer_extent(points, row, begin, end)
            select(points, axis[node], row, begin, end, middle)
            split[node] = points[row[middle], axis[node]]
    start = np.empty((1 << depth) + 1, np.intp)
    for k in range((1 << depth) + 1):
        start[k] = (count * k) >> depth
    x, y = np.empty(count), np.empty(count)
    for k in range(count):
        x[k], y[k] = points[row[k], 0], points[row[k], 1]
    return Index(x, y, row, start, 0.0, 0.0, 0.0, 0, 0, depth, split, axis)


@compiled
def longer_extent(points: FloatArray, row: IntArray, begin: int, end: int) -> int:
    """The axis along which the points of a node reach farther."""
    low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
    for k in range(begin, end):
        x, y = points[row[k], 0], points[row[k], 1]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
    return 0 if high_x - low_x >= high_y - low_y else 1


@compiled
def select(points: FloatArray, axis: int, row: IntArray, begin: int, end: int, middle: int) -> None:
    """Reorder ``row[begin:end]`` by a coordinate, so that the one at `middle` has its rank."""
    low, high = begin, end - 1
    while low < high:
        pivot = points[row[(low + high) >> 1], axis]
        i, j = low, high
        while i <= j:
            while points[row[i], axis] < pivot:
                i += 1
            while points[row[j], axis] > pivot:
                j -= 1
            if i <= j:
                row[i], row[j] = row[j], row[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@compiled
def smallest_in_place(values: FloatArray, k: int) -> float:
    """The k-th smallest of `values`, counted from 0; reorders them (Hoare's selection)."""
    low, high = 0, len(values) - 1
    while low < high:
        pivot = values[(low + high) >> 1]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if k <= j:
            high = j
        elif k >= i:
            low = i
        else:
            break
    return float(values[k])


@compiled
def find_in_tree(
    index: Index,
    target: FloatArray,
    x: FloatArray,
    y: FloatArray,
    gate: float,
    asked: IntArray,
    row: IntArray,
    square: FloatArray,
    clear: FloatArray,
) -> None:
    """`find_nearest` by descending to each point's leaf, and then what else may be nearer.

    A row of the stack is a branch still to be visited: its node, how far the point lies
    outside it along x and y [m], and the square of that distance.
    """
    split, axis, inner = index.split, index.axis, len(index.split)
    entries, found, stack = (index.x, index.y, index.row, index.start), -1, np.zeros((64, 4))
    most = gate * gate * NOT_LESS
    for i in asked:
        guess = row[i] if row[i] >= 0 else found
        best, least = guess_near(target, guess, x[i], y[i], most)
        second, passed_by = math.inf, math.inf
        stack[0, 0] = stack[0, 1] = stack[0, 2] = stack[0, 3] = 0.0
        waiting = 1
        while waiting > 0:
            waiting -= 1
            if stack[waiting, 3] <= least * NOT_LESS:
                leaf, waiting = descend(split, axis, x[i], y[i], stack, waiting)
                leaf -= inner
                best, least, second = scan_cells(
                    entries, leaf, leaf, x[i], y[i], best, least, second
                )
            else:
                passed_by = min(passed_by, stack[waiting, 3])
        row[i], clear[i] = best, min(second, passed_by)
        square[i], found = (least, best) if best >= 0 else (math.inf, found)


@inlined
def descend(
    split: FloatArray, axis: IntArray, px: float, py: float, stack: FloatArray, waiting: int
) -> tuple[int, int]:
    """The leaf on p's side below branch ``stack[waiting]``; the other sides wait in its place."""
    node, out_x, out_y = int(stack[waiting, 0]), stack[waiting, 1], stack[waiting, 2]
    while node < len(split):
        along_x = axis[node] == 0
        across = (px if along_x else py) - split[node]
        near, far = 2 * node + 1, 2 * node + 2
        if across > 0.0:
            near, far = far, near
        far_x, far_y = (across, out_y) if along_x else (out_x, across)
        stack[waiting, 0], stack[waiting, 1], stack[waiting, 2] = far, far_x, far_y
        stack[waiting, 3] = far_x * far_x + far_y * far_y
        waiting += 1
        node = near
    return node, waiting
