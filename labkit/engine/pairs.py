"""Boxes D and E of the flow chart: the stages of `labkit.correspondences`, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.approach import CLOSE_GATE, POINT_SHARE, WIDTH
from labkit.arrays import BoolArray, FloatArray, IntArray
from labkit.correspondences import MIN_PAIRS
from labkit.engine.grid import smallest_in_place
from labkit.engine.index import NOT_LESS, Index, Queries
from labkit.engine.jit import compiled
from labkit.engine.nearest import Partners, find_nearest


class Pairs(NamedTuple):
    """One association of N points, like `labkit.correspondences.Correspondences`."""

    x: FloatArray  # the source points in the target's frame [m]
    y: FloatArray
    row: IntArray  # of the partner in the target
    distance: FloatArray  # [m]
    residual: FloatArray  # [m]; NaN where the partner has no normal
    closest: BoolArray  # whether it is one of the ⌊ρN⌋ closest
    weight: FloatArray  # 0 for a rejected pair


class Settings(NamedTuple):
    """The settings of one iteration, like `labkit.approach.Settings`."""

    on_lines: bool
    far: bool
    gate: float
    overlap_ratio: float
    huber_delta: float


@compiled
def empty_pairs(count: int) -> Pairs:
    """Room for `count` pairs."""
    return Pairs(
        np.empty(count),
        np.empty(count),
        np.empty(count, np.intp),
        np.empty(count),
        np.empty(count),
        np.empty(count, np.bool_),
        np.empty(count),
    )


@compiled
def associate(
    source: FloatArray,
    every: int,
    T: FloatArray,
    target: FloatArray,
    index: Index,
    gate: float,
    found: Partners,
    pairs: Pairs,
) -> None:
    """(D) The nearest target point of every `every`-th source point, moved by T, and how far.

    Only what lies within the gate is looked for, since every pair beyond it is one like another.
    `found` holds what was found for each source point before, and takes what is found now. A
    point that has not moved far enough to meet another keeps its partner.
    """
    x, y, row, distance = pairs.x, pairs.y, pairs.row, pairs.distance
    order, old_row, old_x, old_y, old_clear = found
    a, b, c, d, shift_x, shift_y = T[0, 0], T[0, 1], T[1, 0], T[1, 1], T[0, 2], T[1, 2]
    asked, unsure, count = np.empty(len(x), np.intp), np.empty(len(x), np.bool_), 0
    for i in range(len(x)):
        k = i * every
        px, py = source[k, 0], source[k, 1]
        x[i], y[i] = a * px + b * py + shift_x, c * px + d * py + shift_y
        row[i] = old_row[k]
        dx, dy = x[i] - target[row[i], 0], y[i] - target[row[i], 1]
        u, v = x[i] - old_x[k], y[i] - old_y[k]
        distance[i] = math.sqrt(dx * dx + dy * dy) if row[i] >= 0 else math.inf
        moved = math.sqrt(u * u + v * v)
        unsure[i] = not (min(distance[i], gate) + moved) * NOT_LESS < old_clear[k]
    for n in range(len(x)):
        i = order[n] if every == 1 else n
        asked[count] = i
        count += unsure[i]
    clear = np.empty(len(x))
    find_nearest(index, target, Queries(x, y, gate, asked[:count], row, distance, clear))
    for i in asked[:count]:
        k = i * every
        distance[i] = math.sqrt(distance[i])
        old_row[k], old_x[k], old_y[k], old_clear[k] = row[i], x[i], y[i], math.sqrt(clear[i])
        for between in range(k + 1, min(k + every, len(source))):
            old_row[between] = row[i]


@compiled
def measure(target: FloatArray, normals: FloatArray, on_lines: bool, pairs: Pairs) -> None:
    """What the metric minimises: the distance, or |n·(p − q)|, NaN without a normal."""
    x, y, row, distance, residual = pairs.x, pairs.y, pairs.row, pairs.distance, pairs.residual
    for i in range(len(x)):
        if on_lines:
            k = row[i]
            along_x = normals[k, 0] * (x[i] - target[k, 0])
            residual[i] = abs(along_x + normals[k, 1] * (y[i] - target[k, 1]))
        else:
            residual[i] = distance[i]


@compiled
def reject(pairs: Pairs, settings: Settings, room: FloatArray) -> int:
    """(E) Weight 1 for the pairs within gate (A) and overlap (B) that have a residual, else 0.

    Returns how many there are. `room` is space for N numbers.
    """
    distance, residual, closest, weight = (
        pairs.distance,
        pairs.residual,
        pairs.closest,
        pairs.weight,
    )
    limit, ties = overlap_limit(distance, settings.overlap_ratio, room)
    kept, gate = 0, settings.gate
    for i in range(len(distance)):
        d = distance[i]
        closest[i] = d < limit
        if d == limit and ties > 0:  # of equal distances the first ones
            closest[i], ties = True, ties - 1
        inside = closest[i] and d <= gate and residual[i] >= 0.0  # NaN is not
        weight[i] = 1.0 if inside else 0.0
        kept += inside
    return kept


@compiled
def overlap_limit(
    distance: FloatArray, overlap_ratio: float, room: FloatArray
) -> tuple[float, int]:
    """The largest of the ⌊ρN⌋ closest distances, and how many pairs at it belong to them."""
    count = len(distance)
    keep = min(count, max(MIN_PAIRS, int(overlap_ratio * count)))
    if keep == count:
        return math.inf, count
    limit, closer = smallest(distance, keep - 1, room), 0
    for d in distance:
        closer += d < limit
    return limit, keep - closer


@compiled
def weigh(pairs: Pairs, settings: Settings, kept: int, room: FloatArray) -> tuple[float, float]:
    """(E) Huber's weights (C) of the kept pairs; returns δ [m] and the share of point-to-point."""
    delta, share = settings.huber_delta, 0.0
    if settings.far:
        delta = wide_delta(pairs, delta, kept, room)
        share = point_share(delta, settings.huber_delta)
    weight, residual = pairs.weight, pairs.residual
    for i in range(len(weight)):
        if weight[i] > 0.0 and residual[i] > delta:
            weight[i] = delta / residual[i]
    return delta, share


@compiled
def wide_delta(pairs: Pairs, huber_delta: float, kept: int, room: FloatArray) -> float:
    """δ [m] far from the answer; see `labkit.approach.wide_delta`."""
    if kept == 0:
        return huber_delta
    weight, residual, size = pairs.weight, pairs.residual, 0
    for i in range(len(weight)):
        if weight[i] > 0.0:
            room[size] = residual[i]
            size += 1
    return max(huber_delta, WIDTH * smallest_in_place(room[:size], size // 2))


@compiled
def point_share(wide: float, huber_delta: float) -> float:
    """The share of point-to-point; see `labkit.approach.point_share`."""
    if math.isinf(huber_delta):
        return 0.0
    ratio = wide / huber_delta
    return min(1.0, POINT_SHARE * (ratio * ratio))


@compiled
def near_gate(gate: float, huber_delta: float) -> float:
    """The gate [m] near the answer; see `labkit.approach.close_gate`."""
    return min(gate, CLOSE_GATE * huber_delta)


@compiled
def cost(pairs: Pairs, gate: float, delta: float) -> float:
    """The truncated Huber cost J [m²] of the ⌊ρN⌋ closest pairs, over N (4.1)."""
    distance, residual, closest, total = pairs.distance, pairs.residual, pairs.closest, 0.0
    for i in range(len(distance)):
        if closest[i]:
            d = distance[i]
            r = residual[i] if d <= gate and residual[i] >= 0.0 else min(d, gate)
            capped = min(r, delta)
            total += capped * (2.0 * r - capped)
    return total / len(distance)


@compiled
def inliers(pairs: Pairs) -> tuple[int, float]:
    """How many pairs are kept, and their root mean square distance [m]; NaN for none."""
    distance, weight, count, total = pairs.distance, pairs.weight, 0, 0.0
    for i in range(len(weight)):
        if weight[i] > 0.0:
            count += 1
            total += distance[i] * distance[i]
    return count, math.sqrt(total / count) if count else math.nan


@compiled
def smallest(values: FloatArray, k: int, room: FloatArray) -> float:
    """The k-th smallest of `values`, counted from 0."""
    for i in range(len(values)):
        room[i] = values[i]
    return smallest_in_place(room[: len(values)], k)
