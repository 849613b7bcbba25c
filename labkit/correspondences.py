"""Which target point belongs to which source point, and which pairs to believe (section 4).

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
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from labkit.approach import Settings, point_share, settings_of, wide_delta
from labkit.arrays import BoolArray, FloatArray, IntArray, check_range
from labkit.parameters import IcpParameters
from labkit.se2 import apply
from labkit.target import Target

MIN_PAIRS = 3  # the fewest pairs a step is computed from, as in the lesson


def distance_gate(distances: ArrayLike, max_correspondence_distance: float) -> BoolArray:
    """(A) Which pairs lie within the gate: ``d <= max_correspondence_distance`` [m]."""
    check_range(max_correspondence_distance, "max_correspondence_distance", above=0.0, unit="m")
    return np.asarray(distances, dtype=np.float64) <= max_correspondence_distance


def overlap(distances: ArrayLike, overlap_ratio: float) -> BoolArray:
    """(B) Which pairs are among the ⌊ρN⌋ closest, at least 3: the trimming step.

    Parameters
    ----------
    distances : array_like, shape (N,)
        Residuals of *all* N source points, gated or not, in metres.
    overlap_ratio : float
        The fraction ρ in (0, 1] that is kept.

    Returns
    -------
    ndarray of bool, shape (N,)
        True for the pairs kept; of equal residuals the first ones.

    Notes
    -----
    Because it looks at all N residuals, the result does not depend on whether the gate
    came first, and ρ keeps its meaning (the share of the source that has a partner).
    """
    check_range(overlap_ratio, "overlap_ratio", above=0.0, at_most=1.0)
    d = np.asarray(distances, dtype=np.float64)
    count = overlap_count(len(d), overlap_ratio)
    if count == len(d):
        return np.ones(count, dtype=bool)
    largest = np.partition(d, count - 1)[count - 1]
    kept: BoolArray = d <= largest
    surplus = np.count_nonzero(kept) - count
    if surplus:  # residuals equal to the largest one: the last of them go
        kept[np.flatnonzero(d == largest)[-surplus:]] = False
    return kept


def overlap_count(source_points: int, overlap_ratio: float) -> int:
    """How many pairs `overlap` keeps: ⌊ρN⌋, but at least 3 where there are as many.

    The product ρN is a double, so that ⌊0.29 · 100⌋ is 28.
    """
    return min(source_points, max(MIN_PAIRS, int(overlap_ratio * source_points)))


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
    r = np.asarray(residuals, dtype=np.float64)
    if huber_delta == math.inf:
        return np.ones_like(r)
    weights: FloatArray = huber_delta / np.maximum(r, huber_delta)
    return weights


def huber_loss(residuals: ArrayLike, huber_delta: float) -> FloatArray:
    """Huber's loss [m²] whose weights those are: r² up to δ, 2δr − δ² beyond."""
    check_range(huber_delta, "huber_delta", above=0.0, unit="m")
    r = np.asarray(residuals, dtype=np.float64)
    capped = np.minimum(r, huber_delta)
    loss: FloatArray = capped * (2.0 * r - capped)
    return loss


@dataclass(frozen=True, eq=False, kw_only=True)
class Correspondences:
    """The pairs of one association, and what each stage decided about them.

    Entry i is source point i; from afar, that of ``source[::every]`` (see `labkit.approach`).

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
    every : int
        The stride: only the points ``source[::every]`` were matched.
    point_share : float
        Share of the point-to-point metric in the step of line pairs; see `labkit.approach`.
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
    every: int = 1
    point_share: float = 0.0

    @property
    def within_gate(self) -> BoolArray:
        """Which pairs passed the gate, shape (N,)."""
        return distance_gate(self.distances, self.gate)

    @property
    def within_overlap(self) -> BoolArray:
        """Which pairs are among the ⌊ρN⌋ closest, shape (N,)."""
        return overlap(self.distances, self.overlap_ratio)

    @property
    def inlier_count(self) -> int:
        """How many pairs were kept."""
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
    def cost(self) -> float:
        """The truncated Huber cost J [m²] of the ⌊ρN⌋ closest pairs, over N; see `labkit.icp`.

        A pair outside the gate counts as if it lay at the gate. One without a normal counts by
        its distance.
        """
        charged = np.minimum(self.distances, self.gate)
        usable = self.within_gate & np.isfinite(self.residuals)
        charged[usable] = self.residuals[usable]
        loss = huber_loss(charged[self.within_overlap], self.huber_delta)
        return float(loss.sum() / len(charged))


def associate(
    source: FloatArray, target: Target, T_target_source: FloatArray, settings: Settings
) -> Correspondences:
    """Pair each source point with its nearest target point: box D.

    Parameters
    ----------
    source : ndarray, shape (N, 2)
        The newer scan's points [m].
    target : Target
        The older scan.
    T_target_source : ndarray, shape (3, 3)
        The pose.
    settings : Settings
        Metric and stride of this iteration.

    Returns
    -------
    Correspondences
        Every pair that has a residual is kept, with weight 1.
    """
    moved = apply(T_target_source, source[:: settings.every])
    index, distances = target.search.query(moved)
    nearest, normals, residuals = target.points[index], None, distances
    if settings.metric == "point_to_line":
        normals = target.normals[index]
        residuals = np.abs((normals * (moved - nearest)).sum(axis=1))  # |n·(p − q)|
    kept = np.isfinite(residuals)
    return Correspondences(
        source=moved,
        target=nearest,
        target_index=index,
        distances=distances,
        normals=normals,
        residuals=residuals,
        kept=kept,
        weights=kept.astype(np.float64),
        every=settings.every,
    )


def reject_and_weigh(pairs: Correspondences, settings: Settings) -> Correspondences:
    """The same pairs with gate (A), overlap (B) and Huber's weights (C) applied: box E."""
    within_gate = distance_gate(pairs.distances, settings.gate)  # (A)
    within_overlap = overlap(pairs.distances, settings.overlap_ratio)  # (B)
    kept = pairs.kept & within_gate & within_overlap
    delta, share = settings.huber_delta, 0.0
    if settings.far:
        delta = wide_delta(pairs.residuals[kept], settings.huber_delta)
        share = point_share(delta, settings.huber_delta)
    weights = np.zeros(len(kept))
    weights[kept] = huber_weights(pairs.residuals[kept], delta)  # (C)
    return replace(
        pairs,
        kept=kept,
        weights=weights,
        gate=settings.gate,
        overlap_ratio=settings.overlap_ratio,
        huber_delta=delta,
        point_share=share,
    )


def pairs_at(
    source: FloatArray,
    target: Target,
    T_target_source: FloatArray,
    parameters: IcpParameters,
    *,
    far: bool = False,
) -> Correspondences:
    """Boxes D and E together, at a pose that is `far` from the answer or near it."""
    settings = settings_of(parameters, len(source), far=far)
    return reject_and_weigh(associate(source, target, T_target_source, settings), settings)
