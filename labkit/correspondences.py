"""Correspondences: pairs of source and target points, and which of them to believe (section 4).

Each stage of the lesson's flow chart is one function. Their result is `Correspondences`:

=============  =================================================================
D  associate   the nearest target point of each source point
E  reject      `distance_gate` (A) and `overlap` (B)
E  weigh       `huber_weights` (C)
=============  =================================================================

Residuals, gate and delta are distances in metres, never squares.

References
----------
.. [1] Chetverikov, Svirko, Stepanov, Krsek, "The trimmed iterative closest point
       algorithm", ICPR 2002.
.. [2] Huber, "Robust estimation of a location parameter", Ann. Math. Stat. 35(1), 1964.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from labkit.neighbors import SAFELY, Grid, Known, nearest, nothing_known, select
from labkit.parameters import IcpParameters
from labkit.schedule import Stage, stage_of, widened
from labkit.support.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    as_floats,
    as_points,
    as_transform,
    check_range,
    read_only,
)
from labkit.support.compiled import compiled
from labkit.support.errors import InvalidPointsError
from labkit.target import Target

Metres = TypeVar("Metres", float, FloatArray)  # one length, or an array of them
MIN_PAIRS = 3  # the fewest pairs a step is computed from, as in the lesson


class Correspondences(NamedTuple):
    """The pairs of one association, and what each stage decided about them.

    Entry i is source point i; from afar, that of ``source[::stride]`` (see `labkit.schedule`).
    """

    source: FloatArray  #: The source points in the target's frame [m], shape (N, 2).
    target: FloatArray  #: The nearest target point of each [m], shape (N, 2).
    normals: FloatArray  #: The target's normal there or NaN; (0, 2) under point-to-point.
    target_index: IntArray  #: Row of the nearest point in the target, shape (N,).
    distances: FloatArray  #: Distance between the two points of each pair [m], shape (N,).
    residuals: FloatArray  #: The distance [m], or that from the line; NaN without a normal.
    within_overlap: BoolArray  #: Which are among the ⌊ρN⌋ closest pairs, shape (N,).
    weights: FloatArray  #: Huber's weight of a kept pair, 0 for a rejected one, shape (N,).
    inlier_count: int  #: Number of kept pairs.
    max_correspondence_distance: float  #: The gate d_max [m] of this iteration.
    huber_delta: float  #: δ [m] of this iteration.
    point_share: float  #: Share of the point-to-point metric in the step of line pairs.
    stride: int  #: Only the points ``source[::stride]`` were matched.

    @property
    def kept(self) -> BoolArray:
        """Mask of the pairs that passed the gate, are among the ⌊ρN⌋ closest, have a residual."""
        return self.weights > 0.0

    @property
    def within_gate(self) -> BoolArray:
        """Mask of the pairs that passed the gate, shape (N,)."""
        return self.distances <= self.max_correspondence_distance

    @property
    def cost(self) -> float:
        """The truncated Huber cost J [m²]; see `labkit.icp`."""
        return cost(self)

    @property
    def fitness(self) -> float:
        """Kept pairs over source points, in [0, 1]."""
        return self.inlier_count / len(self.kept)

    @property
    def inlier_rmse(self) -> float:
        """Root mean square distance [m] of the kept pairs; NaN where none was kept."""
        return math.sqrt(np.mean(self.distances[self.kept] ** 2)) if self.kept.any() else math.nan


@compiled
def associate(
    source: FloatArray, target: Grid, T: FloatArray, reach: float, known: Known
) -> tuple[FloatArray, IntArray, FloatArray]:
    """(D) Move source points (N, 2) by T and find the nearest target point of each.

    Returns the moved points, and row and distance [m] of their partners; −1 and inf where none
    lies within `reach` [m].
    """
    moved = np.empty(source.shape)
    for i in range(len(source)):
        x, y = source[i, 0], source[i, 1]
        moved[i, 0] = T[0, 0] * x + T[0, 1] * y + T[0, 2]
        moved[i, 1] = T[1, 0] * x + T[1, 1] * y + T[1, 2]
    index, distances = nearest(moved, target, SAFELY * reach, known)
    return moved, index, distances


@compiled
def reject_and_weigh(
    source: FloatArray,
    index: IntArray,
    distances: FloatArray,
    target: Grid,
    normals: FloatArray,
    stage: Stage,
) -> Correspondences:
    """(E) Weigh the pairs: 0 beyond the gate or the overlap, else Huber's weight."""
    partners, residuals = np.empty(source.shape), distances.copy()
    on_surface = np.empty((len(source) if len(normals) > 0 else 0, 2))
    for i in range(len(source)):
        partners[i, 0], partners[i, 1] = target.points[index[i], 0], target.points[index[i], 1]
    for i in range(len(on_surface)):
        nx, ny = normals[index[i], 0], normals[index[i], 1]
        dx, dy = source[i, 0] - partners[i, 0], source[i, 1] - partners[i, 1]
        on_surface[i, 0], on_surface[i, 1] = nx, ny
        residuals[i] = abs(nx * dx + ny * dy)  # |n·(p − q)|
    within_gate = distance_gate(distances, stage.max_correspondence_distance)  # (A)
    within_overlap = overlap(distances, stage.overlap_ratio)  # (B)
    kept = within_gate & within_overlap & np.isfinite(residuals)
    delta, share = widened(residuals, kept, stage)
    weights = kept * huber_weights(residuals, delta)  # (C)
    found = (source, partners, on_surface, index, distances, residuals, within_overlap, weights)
    gate = stage.max_correspondence_distance
    return Correspondences(*found, kept.sum(), gate, delta, share, stage.stride)


@compiled
def cost(pairs: Correspondences) -> float:
    """The truncated Huber cost J [m²] of the ⌊ρN⌋ closest pairs, over N (4.1).

    A pair outside the gate counts as if it lay at the gate; one without a normal, by its
    distance.
    """
    count, total = len(pairs.distances), 0.0
    for i in range(count):
        if pairs.within_overlap[i]:
            r = min(pairs.distances[i], pairs.max_correspondence_distance)
            if r == pairs.distances[i] and math.isfinite(pairs.residuals[i]):
                r = pairs.residuals[i]
            total += huber_loss(r, pairs.huber_delta)
    return total / count


def _gated(distances: ArrayLike, max_correspondence_distance: float) -> tuple[Any, ...]:
    check_range(max_correspondence_distance, "max_correspondence_distance", above=0.0, unit="m")
    return _as_distances(distances, "distances"), float(max_correspondence_distance)


def _trimmed(distances: ArrayLike, overlap_ratio: float) -> tuple[Any, ...]:
    check_range(overlap_ratio, "overlap_ratio", above=0.0, at_most=1.0)
    return _as_distances(distances, "distances").ravel(), float(overlap_ratio)


def _weighed(residuals: ArrayLike, huber_delta: float) -> tuple[Any, ...]:
    check_range(huber_delta, "huber_delta", above=0.0, unit="m")
    return _as_distances(residuals, "residuals"), float(huber_delta)


@partial(compiled, check=_gated)
def distance_gate(distances: FloatArray, max_correspondence_distance: float) -> BoolArray:
    """(A) Mask of the pairs within the gate: ``d <= max_correspondence_distance`` [m]."""
    return distances <= max_correspondence_distance


@partial(compiled, check=_trimmed)
def overlap(distances: FloatArray, overlap_ratio: float) -> BoolArray:
    """(B) Mask of the ⌊ρN⌋ closest pairs, at least 3; of equally close ones the first.

    The distances [m], shape (N,), are those of *all* N source points, gated or not. So the order
    of gate and overlap does not matter, and ρ in (0, 1] stays a share of the source.
    """
    count = overlap_count(len(distances), overlap_ratio)
    kept = np.ones(len(distances), np.bool_)
    if count == len(distances):
        return kept
    largest, left = select(distances, count - 1), count
    for i in range(len(distances)):
        kept[i] = distances[i] < largest
        left -= kept[i]
    for i in range(len(distances)):
        if left > 0 and distances[i] == largest:
            kept[i] = True
            left -= 1
    return kept


@compiled
def overlap_count(source_points: int, overlap_ratio: float) -> int:
    """Number of pairs that the overlap keeps: ⌊ρN⌋, the product a double; at least 3 if it can."""
    return min(source_points, max(MIN_PAIRS, int(overlap_ratio * source_points)))


@partial(compiled, check=_weighed)
def huber_weights(residuals: FloatArray, huber_delta: float) -> FloatArray:
    """(C) Huber's weights of residuals [m]: 1 up to δ, δ/r beyond; all 1 where δ is inf."""
    weights = np.ones_like(residuals)
    for i, r in np.ndenumerate(residuals):
        if r > huber_delta:
            weights[i] = huber_delta / r
    return weights


@partial(compiled, check=_weighed)
def huber_loss(residuals: Metres, huber_delta: float) -> Metres:
    """Huber's loss [m²] whose weights those are: r² up to δ, 2δr − δ² beyond."""
    capped: Metres = np.minimum(residuals, huber_delta)
    return capped * (2.0 * residuals - capped)


def _as_distances(values: ArrayLike, name: str) -> FloatArray:
    """Check distances [m]: none is negative or NaN."""
    checked = as_floats(values, name, hint="give distances in metres")
    wrong = np.argwhere(~(checked >= 0.0))
    if wrong.size:
        where = tuple(wrong[0].tolist())
        raise InvalidPointsError(
            f"`{name}` must be distances, not negative, got {checked[where]} at index "
            f"{', '.join(map(str, where)) or 0}"
        )
    return checked


def pairs_at(
    source: ArrayLike,
    target: Target,
    T_target_source: ArrayLike,
    parameters: IcpParameters,
    *,
    far: bool = False,
) -> Correspondences:
    """Boxes D and E together, at a pose that is `far` from the answer or near it.

    All partners are looked for, however far; the arrays are read-only.
    """
    points = read_only(as_points(source, "source"))
    T, normals = as_transform(T_target_source, "T_target_source"), target.normals_for(parameters)
    grid, numbers = target.search.grid, parameters.for_loop
    pairs = Correspondences(*_pairs_at(points, grid, normals, T, numbers, far))
    for each in pairs[:8]:
        read_only(each)
    return pairs


@compiled
def _pairs_at(
    source: FloatArray,
    target: Grid,
    normals: FloatArray,
    T: FloatArray,
    parameters: IcpParameters,
    far: bool,
) -> tuple[Any, ...]:
    stage = stage_of(parameters, len(source), far, True)
    known = nothing_known(len(source))
    moved, index, distances = associate(source[:: stage.stride], target, T, math.inf, known)
    pairs = reject_and_weigh(moved, index, distances, target, normals, stage)
    return pairs[:]  # as a plain tuple, for Python
