"""Correspondences: pairs of source and target points, and which of them to believe (section 4).

Each stage of the lesson's flow chart is one function. Their result is `Correspondences`:

=============  =================================================================
D  associate   the nearest target point of each source point
E  reject      the gate (A) and `closest` (B), the overlap
E  weigh       `huber` (C)
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
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from labkit.neighbors import nearest, select
from labkit.parameters import IcpParameters
from labkit.schedule import Stage, stage_of
from labkit.support.arrays import BoolArray, FloatArray, IntArray, as_floats, check_range, read_only
from labkit.support.compiled import compiled
from labkit.support.errors import InvalidPointsError
from labkit.target import Target, TargetArrays

MIN_PAIRS = 3  # the fewest pairs a step is computed from, as in the lesson


class Pairs(NamedTuple):
    """One association, as the loop passes it on; entry i is the i-th source point matched."""

    source: FloatArray  # (N, 2) in the target's frame [m]
    target: FloatArray  # (N, 2), the partner of each [m]
    normals: FloatArray  # (N, 2), of the target there, NaN for none; without rows for points
    rows: IntArray  # (N,), of the partner in the target; −1 for none
    distances: FloatArray  # (N,) [m]; inf where the search ended before a partner
    residuals: FloatArray  # (N,) [m], what the metric minimises; NaN without a normal
    within_overlap: BoolArray  # (N,), which are among the ⌊ρN⌋ closest; empty until judged
    weights: FloatArray  # (N,), 0 for a rejected pair; empty until judged
    huber_delta: float  # δ [m] of these weights
    point_share: float  # share of the point-to-point metric in a step to lines


@compiled
def associate(
    source: FloatArray,
    target: TargetArrays,
    T: FloatArray,
    stage: Stage,
    reach: float,
    partners: IntArray,
) -> Pairs:
    """(D) Pair each source point (N, 2), moved by T, with its nearest target point.

    The search begins at the row that `partners`, (N,), names for each point, and writes what it
    finds there: −1 for a point without a partner within `reach` [m].
    """
    count = (len(source) - 1) // stage.stride + 1
    moved, target_points, normals = np.empty((count, 2)), np.empty((count, 2)), np.empty((0, 2))
    for i in range(count):
        x, y = source[i * stage.stride, 0], source[i * stage.stride, 1]
        moved[i, 0] = T[0, 0] * x + T[0, 1] * y + T[0, 2]
        moved[i, 1] = T[1, 0] * x + T[1, 1] * y + T[1, 2]
    guess = partners[:: stage.stride]
    index, distances = nearest(moved, target.points, target.grid, reach * (1.0 + 1e-9), guess)
    for i in range(count):
        guess[i] = index[i]
        target_points[i, 0] = target.points[index[i], 0]
        target_points[i, 1] = target.points[index[i], 1]
    residuals = distances.copy()
    if stage.on_lines:
        normals = np.empty((count, 2))
        for i in range(count):
            nx, ny = target.normals[index[i], 0], target.normals[index[i], 1]
            dx, dy = moved[i, 0] - target_points[i, 0], moved[i, 1] - target_points[i, 1]
            normals[i, 0], normals[i, 1] = nx, ny
            residuals[i] = abs(nx * dx + ny * dy)  # |n·(p − q)|
    near, weights = np.empty(0, np.bool_), np.empty(0)
    return Pairs(
        moved,
        target_points,
        normals,
        index,
        distances,
        residuals,
        near,
        weights,
        stage.huber_delta,
        0.0,
    )


@compiled
def reject_and_weigh(pairs: Pairs, stage: Stage) -> Pairs:
    """(E) The same pairs, weighted: 0 beyond the gate or the overlap, else Huber's weight."""
    near = closest(pairs.distances, stage.overlap_ratio)  # (B)
    kept = near.copy()
    for i in range(len(kept)):
        within_gate = pairs.distances[i] <= stage.gate  # (A)
        kept[i] = kept[i] and within_gate and math.isfinite(pairs.residuals[i])
    delta = widened(pairs.residuals, kept, stage)
    share = 0.0
    if stage.point_share > 0.0:
        share = min(1.0, stage.point_share * (delta / stage.huber_delta) ** 2)
    weights = huber(pairs.residuals, delta)  # (C)
    for i in range(len(kept)):
        if not kept[i]:
            weights[i] = 0.0
    moved, partners, normals, rows, distances, residuals, _, _, _, _ = pairs
    return Pairs(moved, partners, normals, rows, distances, residuals, near, weights, delta, share)


@compiled
def closest(distances: FloatArray, overlap_ratio: float) -> BoolArray:
    """(B) Mask of the ⌊ρN⌋ closest pairs, at least 3; of equally close ones the first."""
    count = overlap_count(len(distances), overlap_ratio)
    kept = np.ones(len(distances), np.bool_)
    if count == len(distances):
        return kept
    largest, room = select(distances, count - 1), count
    for i in range(len(distances)):
        kept[i] = distances[i] < largest
        room -= kept[i]
    for i in range(len(distances)):
        if room > 0 and distances[i] == largest:
            kept[i] = True
            room -= 1
    return kept


@compiled
def overlap_count(source_points: int, overlap_ratio: float) -> int:
    """Number of pairs that the overlap keeps: ⌊ρN⌋, but at least 3 where there are as many.

    The product ρN is a double, so that ⌊0.29 · 100⌋ is 28.
    """
    return min(source_points, max(MIN_PAIRS, int(overlap_ratio * source_points)))


@compiled
def huber(residuals: FloatArray, huber_delta: float) -> FloatArray:
    """(C) Huber's weight of each residual [m]: 1 up to δ, δ/r beyond."""
    weights = np.ones(len(residuals))
    for i in range(len(residuals)):
        if residuals[i] > huber_delta:
            weights[i] = huber_delta / residuals[i]
    return weights


@compiled
def widened(residuals: FloatArray, kept: BoolArray, stage: Stage) -> float:
    """δ [m] of this iteration: from afar as wide as the median of the kept residuals asks."""
    if stage.widening == 0.0 or not kept.any():
        return stage.huber_delta
    some = residuals[kept]
    return max(stage.huber_delta, stage.widening * select(some, len(some) // 2))


@compiled
def cost(pairs: Pairs, stage: Stage) -> float:
    """The truncated Huber cost J [m²] of the ⌊ρN⌋ closest pairs, over N (4.1).

    A pair outside the gate counts as if it lay at the gate; one without a normal, by its
    distance.
    """
    count, total = len(pairs.distances), 0.0
    for i in range(count):
        if pairs.within_overlap[i]:
            r = min(pairs.distances[i], stage.gate)
            if pairs.distances[i] <= stage.gate and math.isfinite(pairs.residuals[i]):
                r = pairs.residuals[i]
            total += loss(r, pairs.huber_delta)
    return total / count


@compiled
def loss(residual: float, huber_delta: float) -> float:
    """Huber's loss [m²] of a residual [m]: r² up to δ, 2δr − δ² beyond."""
    capped = min(residual, huber_delta)
    return capped * (2.0 * residual - capped)


def distance_gate(distances: ArrayLike, max_correspondence_distance: float) -> BoolArray:
    """(A) Mask of the pairs within the gate: ``d <= max_correspondence_distance`` [m]."""
    check_range(max_correspondence_distance, "max_correspondence_distance", above=0.0, unit="m")
    return _as_residuals(distances, "distances") <= max_correspondence_distance


def overlap(distances: ArrayLike, overlap_ratio: float) -> BoolArray:
    """(B) Mask of the ⌊ρN⌋ closest pairs, at least 3: the trimming step.

    Parameters
    ----------
    distances : array_like, shape (N,)
        Distances of *all* N source points, gated or not, in metres.
    overlap_ratio : float
        The fraction ρ in (0, 1] that is kept.

    Returns
    -------
    ndarray of bool, shape (N,)
        True for the pairs kept; of equal distances the first ones.

    Notes
    -----
    Because it looks at all N distances, the result does not depend on whether the gate
    came first, and ρ keeps its meaning (the share of the source that has a partner).
    """
    check_range(overlap_ratio, "overlap_ratio", above=0.0, at_most=1.0)
    return closest(_as_residuals(distances, "distances"), float(overlap_ratio))


def huber_weights(residuals: ArrayLike, huber_delta: float) -> FloatArray:
    """(C) Huber's weights: 1 up to δ, δ/r beyond.

    Parameters
    ----------
    residuals : array_like, shape (N,)
        Residual magnitudes in metres (not squared).
    huber_delta : float
        δ > 0 in metres; ``inf`` weighs all pairs alike.

    Returns
    -------
    ndarray, shape (N,), in (0, 1]
    """
    check_range(huber_delta, "huber_delta", above=0.0, unit="m")
    r = _as_residuals(residuals, "residuals")
    return huber(r.ravel(), float(huber_delta)).reshape(r.shape)


def huber_loss(residuals: ArrayLike, huber_delta: float) -> FloatArray:
    """Huber's loss [m²] whose weights those are: r² up to δ, 2δr − δ² beyond."""
    check_range(huber_delta, "huber_delta", above=0.0, unit="m")
    r = _as_residuals(residuals, "residuals")
    return np.reshape([loss(each, float(huber_delta)) for each in r.ravel()], r.shape)


def _as_residuals(values: ArrayLike, name: str) -> FloatArray:
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Correspondences:
    """The pairs of one association, and what each stage decided about them.

    Entry i is source point i; from afar, that of ``source[::stride]`` (see `labkit.schedule`).

    Attributes
    ----------
    source : ndarray, shape (N, 2)
        The source points in the target's frame [m].
    target : ndarray, shape (N, 2)
        The nearest target point of each [m].
    target_index : ndarray of int, shape (N,)
        Its row in the target.
    distances : ndarray, shape (N,)
        Distance between the two points of each pair [m].
    normals : ndarray, shape (N, 2), or None
        The target's normal there, NaN where it has none; None under point-to-point.
    residuals : ndarray, shape (N,)
        What the metric minimises [m]: the distance, or the distance from the line through
        the partner's surface, NaN where it has no normal.
    kept : ndarray of bool, shape (N,)
        Which pairs passed the gate, are among the ⌊ρN⌋ closest, and have a residual.
    weights : ndarray, shape (N,)
        Huber's weight of a kept pair, 0 for a rejected one.
    gate, overlap_ratio, huber_delta : float
        The d_max [m], ρ and δ [m] that were used.
    cost : float
        The truncated Huber cost J [m²]; see `labkit.icp`.
    stride : int
        Only the points ``source[::stride]`` were matched.
    point_share : float
        Share of the point-to-point metric in the step of line pairs; see `labkit.schedule`.
    """

    source: FloatArray
    target: FloatArray
    target_index: IntArray
    distances: FloatArray
    normals: FloatArray | None
    residuals: FloatArray
    kept: BoolArray
    weights: FloatArray
    gate: float = math.inf
    overlap_ratio: float = 1.0
    huber_delta: float = math.inf
    cost: float = math.nan
    stride: int = 1
    point_share: float = 0.0

    @property
    def within_gate(self) -> BoolArray:
        """Mask of the pairs that passed the gate, shape (N,)."""
        return distance_gate(self.distances, self.gate)

    @property
    def within_overlap(self) -> BoolArray:
        """Mask of the ⌊ρN⌋ closest pairs, shape (N,)."""
        return overlap(self.distances, self.overlap_ratio)

    @property
    def inlier_count(self) -> int:
        """Number of kept pairs."""
        return int(np.count_nonzero(self.kept))

    @property
    def fitness(self) -> float:
        """Kept pairs over source points, in [0, 1]."""
        return self.inlier_count / len(self.kept)

    @property
    def inlier_rmse(self) -> float:
        """Root mean square distance [m] of the kept pairs; NaN where none was kept."""
        if not self.kept.any():
            return math.nan
        return math.sqrt(np.mean(self.distances[self.kept] ** 2))

    @cached_property
    def for_loop(self) -> Pairs:
        """The same, as the loop's stages read it."""
        return Pairs(
            np.array(self.source),
            np.array(self.target),
            np.empty((0, 2)) if self.normals is None else np.array(self.normals),
            np.array(self.target_index),
            np.array(self.distances),
            np.array(self.residuals),
            self.within_overlap,
            np.array(self.weights),
            self.huber_delta,
            self.point_share,
        )


def pairs_at(
    source: FloatArray,
    target: Target,
    T_target_source: ArrayLike,
    parameters: IcpParameters,
    *,
    far: bool = False,
) -> Correspondences:
    """Boxes D and E together, at a pose that is `far` from the answer or near it.

    All partners are looked for, however far; the arrays are read-only.
    """
    stage = stage_of(parameters.for_loop, len(source), far, True)
    arrays = target.arrays(on_lines=stage.on_lines)
    points, T = read_only(np.array(source)), np.array(T_target_source, dtype=np.float64)
    pairs = associate(points, arrays, T, stage, math.inf, np.full(len(points), -1))
    pairs = reject_and_weigh(pairs, stage)
    J = cost(pairs, stage)
    return Correspondences(
        source=read_only(pairs.source),
        target=read_only(pairs.target),
        target_index=read_only(pairs.rows),
        distances=read_only(pairs.distances),
        normals=read_only(pairs.normals) if stage.on_lines else None,
        residuals=read_only(pairs.residuals),
        kept=read_only(pairs.weights > 0.0),
        weights=read_only(pairs.weights),
        gate=stage.gate,
        overlap_ratio=stage.overlap_ratio,
        huber_delta=pairs.huber_delta,
        cost=J,
        stride=stage.stride,
        point_share=pairs.point_share,
    )
