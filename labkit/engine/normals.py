"""Normals of a scan's surface, as `labkit.normals` defines them, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.arrays import EPSILON, FloatArray, IntArray
from labkit.engine.grid import cell_of, outside
from labkit.engine.index import NOT_LESS, SLACK, Index
from labkit.engine.jit import compiled, inlined
from labkit.engine.tree import descend
from labkit.normals import (
    GAP_FLOOR,
    GAP_RATIO,
    HALF_BEAMS,
    HALF_WIDTH,
    LINEARITY,
    MIN_ON_LINE,
    NEIGHBORS,
    REACH,
)


class Moments(NamedTuple):
    """How many points, and their sums of x, y, x², xy and y²."""

    size: int
    x: float
    y: float
    xx: float
    xy: float
    yy: float


@compiled
def normals_along_sweep(points: FloatArray) -> FloatArray:
    """Unit normals from a window of beams around each point, shape (M, 2); NaN for no line."""
    count = len(points)
    normals = np.empty((count, 2))
    sums = running_sums(points)
    begin, end = windows(points)
    whole = between(sums, 0, count)
    rounding = 64.0 * EPSILON * (whole.xx + whole.yy)
    for i in range(count):
        set_normal(normals, points, i, between(sums, begin[i], end[i]), rounding)
    return normals


@compiled
def running_sums(points: FloatArray) -> FloatArray:
    """Running sums of x, y, x², xy, y² about the middle point, shape (M + 1, 5)."""
    count = len(points)
    sums = np.zeros((count + 1, 5))
    for i in range(count):
        x, y = points[i, 0] - points[count // 2, 0], points[i, 1] - points[count // 2, 1]
        sums[i + 1, 0] = sums[i, 0] + x
        sums[i + 1, 1] = sums[i, 1] + y
        sums[i + 1, 2] = sums[i, 2] + x * x
        sums[i + 1, 3] = sums[i, 3] + x * y
        sums[i + 1, 4] = sums[i, 4] + y * y
    return sums


@inlined
def between(sums: FloatArray, begin: int, end: int) -> Moments:
    """The moments of points ``begin`` to ``end - 1``, as differences of running sums."""
    return Moments(
        end - begin,
        sums[end, 0] - sums[begin, 0],
        sums[end, 1] - sums[begin, 1],
        sums[end, 2] - sums[begin, 2],
        sums[end, 3] - sums[begin, 3],
        sums[end, 4] - sums[begin, 4],
    )


@compiled
def windows(points: FloatArray) -> tuple[IntArray, IntArray]:
    """The first point of each window along the sweep and the one after its last."""
    count = len(points)
    begin, end = np.zeros(count, np.intp), np.zeros(count, np.intp)
    if count < MIN_ON_LINE:
        return begin, end
    step = np.empty(count + 1)  # before each point [m]; at both ends that of the neighbour
    for i in range(1, count):
        dx, dy = points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
        step[i] = math.sqrt(dx * dx + dy * dy)
    step[0], step[count] = step[1], step[count - 1]
    edge = 0  # where the surface begins
    for i in range(count):
        if i > 0 and is_gap(step, i):
            edge = i
        half = half_width(step, i)
        begin[i], end[i] = max(i - half, edge), i + half + 1
    edge = count  # where it ends
    for i in range(count - 1, -1, -1):
        end[i] = min(end[i], edge)
        if i > 0 and is_gap(step, i):
            edge = i
    return begin, end


@inlined
def is_gap(step: FloatArray, i: int) -> bool:
    """Whether the step before point i leaves the surface."""
    shorter = min(step[i - 1], step[i + 1])
    return bool(step[i] > min(max(GAP_RATIO * shorter, GAP_FLOOR), REACH))


@inlined
def half_width(step: FloatArray, i: int) -> int:
    """How many beams the window of point i reaches to either side."""
    spacing = max(min(step[i], step[i + 1]), 1e-3 * HALF_WIDTH)
    return int(max(HALF_WIDTH / spacing, HALF_BEAMS))


@compiled
def normals_in_space(points: FloatArray, index: Index) -> FloatArray:
    """Unit normals from the nearest neighbours of each point, shape (M, 2); NaN for no line."""
    normals, reach = np.empty((len(points), 2)), REACH
    near, squares, stack = np.empty(NEIGHBORS, np.intp), np.empty(NEIGHBORS), np.empty((64, 4))
    for i in range(len(points)):
        if index.depth > 0:
            size = neighbors_in_tree(index, points[i, 0], points[i, 1], near, squares, stack)
        else:
            size = neighbors_in_grid(index, points[i, 0], points[i, 1], reach, near, squares)
            reach = math.sqrt(bound(squares, size))  # the next point's are about as near
        set_normal(normals, points, i, moments_about(points, i, near, size), 0.0)
    return normals


@inlined
def moments_about(points: FloatArray, i: int, near: IntArray, size: int) -> Moments:
    """The moments of the points ``near[:size]`` about point i."""
    x, y, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(size):
        u, v = points[near[k], 0] - points[i, 0], points[near[k], 1] - points[i, 1]
        x, y, xx, xy, yy = x + u, y + v, xx + u * u, xy + u * v, yy + v * v
    return Moments(size, x, y, xx, xy, yy)


@inlined
def set_normal(
    normals: FloatArray, points: FloatArray, i: int, m: Moments, rounding: float
) -> None:
    """Write the normal of the line through points with moments m, towards the scanner."""
    normals[i, 0] = normals[i, 1] = math.nan
    if m.size < MIN_ON_LINE:
        return
    x, y = m.x / m.size, m.y / m.size
    xx, xy, yy = m.xx / m.size - x * x, m.xy / m.size - x * y, m.yy / m.size - y * y
    skew, mean = 0.5 * (xx - yy), 0.5 * (xx + yy)
    half = math.sqrt(skew * skew + xy * xy)
    least, most = mean - half, mean + half  # the eigenvalues of [[xx, xy], [xy, yy]]
    if not least < LINEARITY**2 * most or most <= rounding:
        return
    cosine, sine = skew / half, xy / half  # of twice the angle of the line
    if cosine >= 0.0:
        c = math.sqrt(0.5 * (1.0 + cosine))
        s = 0.5 * sine / c
    else:
        s = math.sqrt(0.5 * (1.0 - cosine))
        c = 0.5 * sine / s
    side = 1.0 if c * points[i, 1] - s * points[i, 0] <= 0.0 else -1.0
    normals[i, 0], normals[i, 1] = -side * s, side * c


# ---------------------------------------------------------------- neighbours in space


@compiled
def neighbors_in_grid(
    index: Index, px: float, py: float, reach: float, near: IntArray, squares: FloatArray
) -> int:
    """Fill `near` with the rows nearest to p within `REACH`, the nearest first; return how many.

    Looks at a box around p that reaches `reach` [m], and at a larger one where that is not enough.
    """
    x, y, row, start, columns = index.x, index.y, index.row, index.start, index.columns
    at_x, at_y = (px - index.low_x) * index.per_metre, (py - index.low_y) * index.per_metre
    away = outside(at_x, columns) + outside(at_y, index.rows)
    while True:
        size, box = 0, reach * index.per_metre + SLACK + away
        left, right = cell_of(at_x - box, columns), cell_of(at_x + box, columns)
        for r in range(cell_of(at_y - box, index.rows), cell_of(at_y + box, index.rows) + 1):
            for k in range(start[r * columns + left], start[r * columns + right + 1]):
                size = insert(x, y, row, k, px, py, near, squares, size)
        needed = math.sqrt(bound(squares, size))
        if needed <= reach:
            return size
        reach = needed


@compiled
def neighbors_in_tree(
    index: Index, px: float, py: float, near: IntArray, squares: FloatArray, stack: FloatArray
) -> int:
    """Visit every branch that may hold one of them, as `find_in_tree` does."""
    split, axis, inner = index.split, index.axis, len(index.split)
    stack[0, 0] = stack[0, 1] = stack[0, 2] = stack[0, 3] = 0.0
    size, waiting = 0, 1
    while waiting > 0:
        waiting -= 1
        if stack[waiting, 3] <= bound(squares, size) * NOT_LESS:
            leaf, waiting = descend(split, axis, px, py, stack, waiting)
            for k in range(index.start[leaf - inner], index.start[leaf - inner + 1]):
                size = insert(index.x, index.y, index.row, k, px, py, near, squares, size)
    return size


@inlined
def bound(squares: FloatArray, size: int) -> float:
    """The squared distance [m²] beyond which a point is none of the nearest."""
    return squares[size - 1] if size == len(squares) else REACH * REACH


@inlined
def insert(
    x: FloatArray,
    y: FloatArray,
    row: IntArray,
    k: int,
    px: float,
    py: float,
    near: IntArray,
    squares: FloatArray,
    size: int,
) -> int:
    """Put entry k in its place among the `size` nearest; return how many there are now."""
    dx, dy, new = px - x[k], py - y[k], row[k]
    square = dx * dx + dy * dy
    if square > bound(squares, size):
        return size
    place = min(size, len(near) - 1)
    if size == len(near) and square == squares[place] and new > near[place]:
        return size
    while place > 0 and (
        squares[place - 1] > square or (squares[place - 1] == square and near[place - 1] > new)
    ):
        squares[place], near[place] = squares[place - 1], near[place - 1]
        place -= 1
    squares[place], near[place] = square, new
    return min(size + 1, len(near))
