"""What the odometry asks of a pose beside ICP: how well it scores, and whether it is believed."""

from __future__ import annotations

import math

import numpy as np

from labkit.arrays import FloatArray, IntArray
from labkit.engine.jit import compiled, entry


@entry
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


@entry
def judge_stretch(
    points: FloatArray,
    begin: IntArray,
    pairs: IntArray,
    poses: FloatArray,
    clearance: float,
    gap: float,
    judged: FloatArray,
) -> None:
    """`judge` the match of scan ``pairs[k, 0]`` against scan ``pairs[k, 1]`` for each k.

    Scan j is ``points[begin[j] : begin[j + 1]]``, and the motion is that of the scanner.
    """
    for k in range(len(pairs)):
        newer, older = pairs[k]
        T = poses[k]
        x = T[0, 0] * T[0, 2] + T[1, 0] * T[1, 2]
        y = T[0, 1] * T[0, 2] + T[1, 1] * T[1, 2]
        source = points[begin[newer] : begin[newer + 1]]
        target = points[begin[older] : begin[older + 1]]
        judged[k, 0], judged[k, 1] = judge(source, target, T, x, y, clearance, gap)


@entry
def judge(
    source: FloatArray,
    target: FloatArray,
    T: FloatArray,
    x: float,
    y: float,
    clearance: float,
    gap: float,
) -> tuple[float, float]:
    """What beams look through at pose T, and the spread ratio for the motion (x, y)."""
    return seen_through(source, target, T, clearance, gap), spread_ratio(source, x, y)


@compiled
def seen_through(
    source: FloatArray, target: FloatArray, T: FloatArray, clearance: float, gap: float
) -> float:
    """The share of the points in view that beams look through; see `labkit.odometry.free_space`."""
    bearing, end = np.empty(len(source)), np.empty(len(source))
    for i in range(len(source)):
        bearing[i] = math.atan2(source[i, 1], source[i, 0])
        end[i] = math.hypot(source[i, 0], source[i, 1])
    order = np.argsort(bearing, kind="mergesort")
    bearing, end = bearing[order], end[order]
    through, hit = 0, 0
    for i in range(len(target)):
        dx, dy = target[i, 0] - T[0, 2], target[i, 1] - T[1, 2]
        x, y = T[0, 0] * dx + T[1, 0] * dy, T[0, 1] * dx + T[1, 1] * dy
        distance, right = math.hypot(x, y), first_from(bearing, math.atan2(y, x))
        if right == 0 or right == len(bearing) or bearing[right] - bearing[right - 1] >= gap:
            continue
        if distance < min(end[right], end[right - 1]) - clearance:
            through += 1
        elif distance < max(end[right], end[right - 1]) + clearance:
            hit += 1
    return through / (through + hit) if through + hit > 0 else math.nan


@compiled
def first_from(ascending: FloatArray, value: float) -> int:
    """The first place whose entry is at least `value`."""
    low, high = 0, len(ascending)
    while low < high:
        middle = (low + high) // 2
        if ascending[middle] < value:
            low = middle + 1
        else:
            high = middle
    return low


@compiled
def spread_ratio(points: FloatArray, x: float, y: float) -> float:
    """Spread across the direction (x, y) over spread along it; see `labkit.degeneracy`."""
    length, count = math.hypot(x, y), len(points)
    if not (length > 0.0 and count):
        return math.nan
    x, y, along, across = x / length, y / length, 0.0, 0.0
    for i in range(count):
        along += x * points[i, 0] + y * points[i, 1]
        across += x * points[i, 1] - y * points[i, 0]
    along, across, spread_along, spread_across = along / count, across / count, 0.0, 0.0
    for i in range(count):
        spread_along += (x * points[i, 0] + y * points[i, 1] - along) ** 2
        spread_across += (x * points[i, 1] - y * points[i, 0] - across) ** 2
    return math.sqrt(spread_across / spread_along) if spread_along > 0.0 else math.nan
