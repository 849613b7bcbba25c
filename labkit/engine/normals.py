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
    """Unit normals from the nearest neighbours of each point, shape (M, 2); NaN for no line.

    The points come in the index's order. The neighbours of the point before are neighbours of
    the next one, too, if not the nearest: none of those is farther than they are.
    """
    normals, stack = np.empty((len(points), 2)), np.zeros((64, 4))
    near = Near(np.empty(NEIGHBORS, np.intp), np.empty(NEIGHBORS))
    px, py, reach = 0.0, 0.0, REACH
    for k in range(len(points)):
        dx, dy = index.x[k] - px, index.y[k] - py
        px, py = index.x[k], index.y[k]
        reach = min(REACH, (reach + math.sqrt(dx * dx + dy * dy)) * NOT_LESS)
        if index.depth > 0:
            size, square = neighbors_in_tree(index, px, py, reach, near, stack)
        else:
            size, square = neighbors_in_grid(index, px, py, reach, near)
        reach = math.sqrt(square) if size == NEIGHBORS else REACH
        set_normal(normals, points, index.row[k], moments_about(index, px, py, near, size), 0.0)
    return normals


@inlined
def moments_about(index: Index, px: float, py: float, near: Near, size: int) -> Moments:
    """The moments of the first `size` neighbours about the point p."""
    x, y, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in near.entry[:size]:
        u, v = index.x[k] - px, index.y[k] - py
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
    index: Index, px: float, py: float, reach: float, near: Near
) -> tuple[int, float]:
    """Fill `near` with the entries nearest to p, of those within `reach` [m].

    Returns how many there are, and the squared distance of the farthest.
    """
    start, columns = index.start, index.columns
    at_x, at_y = (px - index.low_x) * index.per_metre, (py - index.low_y) * index.per_metre
    box = reach * index.per_metre + SLACK + outside(at_x, columns) + outside(at_y, index.rows)
    left, right = cell_of(at_x - box, columns), cell_of(at_x + box, columns)
    size, most = 0, reach * reach
    for r in range(cell_of(at_y - box, index.rows), cell_of(at_y + box, index.rows) + 1):
        first, last = start[r * columns + left], start[r * columns + right + 1]
        size, most = gather(index, first, last, px, py, near, size, most)
    return size, most


@compiled
def neighbors_in_tree(
    index: Index, px: float, py: float, reach: float, near: Near, stack: FloatArray
) -> tuple[int, float]:
    """The same from every branch that may hold one of them, as `find_in_tree` visits it."""
    start, split, axis, inner = index.start, index.split, index.axis, len(index.split)
    stack[0, 0] = stack[0, 1] = stack[0, 2] = stack[0, 3] = 0.0
    size, most, waiting = 0, reach * reach, 1
    while waiting > 0:
        waiting -= 1
        if stack[waiting, 3] <= most * NOT_LESS:
            leaf, waiting = descend(split, axis, px, py, stack, waiting)
            leaf -= inner
            first, last = start[leaf], start[leaf + 1]
            size, most = gather(index, first, last, px, py, near, size, most)
    return size, most


class Near(NamedTuple):
    """The nearest entries of an index so far, in no order, and their squared distances [m²]."""

    entry: IntArray
    square: FloatArray


@inlined
def gather(
    index: Index,
    first: int,
    last: int,
    px: float,
    py: float,
    near: Near,
    size: int,
    most: float,
) -> tuple[int, float]:
    """Let entries ``first`` to ``last - 1`` take the place of farther ones among the nearest.

    Returns how many there are now, and the square that a nearer one lies within.
    """
    entry, square = near
    worst = farthest(index, near) if size == len(entry) else 0
    for k in range(first, last):
        dx, dy = px - index.x[k], py - index.y[k]
        new = dx * dx + dy * dy
        if new > most:
            continue
        if size < len(entry):
            entry[size], square[size] = k, new
            size += 1
        elif new < most or index.row[k] < index.row[entry[worst]]:
            entry[worst], square[worst] = k, new
        if size == len(entry):
            worst = farthest(index, near)
            most = square[worst]
    return size, most


@inlined
def farthest(index: Index, near: Near) -> int:
    """Which of the neighbours is the farthest, and of equally far ones that whose row is last."""
    entry, square = near
    worst = 0
    for j in range(1, len(entry)):
        if square[j] > square[worst] or (
            square[j] == square[worst] and index.row[entry[j]] > index.row[entry[worst]]
        ):
            worst = j
    return worst
