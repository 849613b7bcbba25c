"""A grid of cells: the index of a scan, whose points lie along walls (`labkit.engine.nearest`)."""

from __future__ import annotations

import math

import numpy as np

from labkit.arrays import FloatArray
from labkit.engine.index import (
    NOT_LESS,
    SLACK,
    Index,
    Queries,
    look_at,
    no_farther,
    nothing_yet,
    settle,
)
from labkit.engine.jit import compiled, inlined

CELLS = 8  # of the grid for each point: walls fill few of them
SAMPLE = 32  # points by which the grid's borders are chosen


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
def find_in_grid(index: Index, target: FloatArray, queries: Queries) -> None:
    """`find_nearest` by boxes around each point, larger until one reaches as far as the nearest."""
    x, y, gate, asked, row = queries.x, queries.y, queries.gate, queries.asked, queries.row
    low_x, low_y, per_metre = index.low_x, index.low_y, index.per_metre
    columns, rows = index.columns, index.rows
    start, found, area, most = index.start, -1, 1.0 / per_metre**2, gate * gate * NOT_LESS
    for i in asked:
        bound = no_farther(target, row[i] if row[i] >= 0 else found, x[i], y[i], most)
        at_x, at_y = (x[i] - low_x) * per_metre, (y[i] - low_y) * per_metre
        reach = 1.0 + outside(at_x, columns) + outside(at_y, rows)
        far = math.sqrt(bound) * per_metre + SLACK  # in cells; what it covers is enough
        while True:
            box = far if far <= reach or reach > columns + rows else reach
            left, right = cell_of(at_x - box, columns), cell_of(at_x + box, columns)
            low, high = cell_of(at_y - box, rows), cell_of(at_y + box, rows)
            seen = nothing_yet()
            for r in range(low, high + 1):
                first, last = start[r * columns + left], start[r * columns + right + 1]
                seen = look_at(index, first, last, x[i], y[i], seen)
            far = math.sqrt(min(bound, seen.least)) * per_metre + SLACK
            if far <= box:
                break
            reach *= 2.0
        edge = min(to_edge(at_x, left, right, columns), to_edge(at_y, low, high, rows))
        found = settle(index, queries, i, seen, edge * edge * area, most, found)


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
