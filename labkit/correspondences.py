"""Which target point belongs to which source point, and which pairs to believe (section 4).

The stages of the lesson's flow chart, each one function, and `Correspondences`, what
they leave:

=============  =================================================================
associate      `labkit.neighbors`: the nearest target point of each source point
reject         `distance_gate` (A) and `overlap` (B); their intersection is kept
weight         `huber_weights` (C)
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

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import BoolArray, FloatArray, IntArray, check_range

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
    """How many pairs `overlap` keeps: ⌊ρN⌋, but at least 3 where there are as many."""
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
    """The pairs of one association and what became of each; entry i is source point i.

    It keeps what the loop works with, points as columns; what people ask for is derived
    from that when they do.

    Attributes
    ----------
    moved : ndarray, shape (3, N)
        The source points at the pose of the association, in the target's frame, as columns
        (x, y, 1) [m].
    nearest : ndarray, shape (2, N) or (4, N)
        The nearest target point of each [m], and under the point-to-line metric its normal,
        zero where it has none.
    center : ndarray, shape (3, 1)
        The target's centroid (x, y, 0) [m], which sums are taken about.
    target_index : ndarray of int, shape (N,)
        The target point's row in the target.
    distances : ndarray, shape (N,)
        How far the pair is apart [m].
    from_line : ndarray, shape (N,), or None
        n·(p − q), how far the source point is in front of the line through the target's
        surface [m]; None under the point-to-point metric.
    within_overlap : ndarray of bool, shape (N,)
        Which pairs are among the ⌊ρN⌋ closest.
    kept : ndarray of bool, shape (N,)
        Which of these passed the gate, too, and have a residual.
    weights : ndarray, shape (N,)
        Huber's weight of a kept pair, 0 for a rejected one.
    gate, huber_delta : float
        d_max and δ [m] that they were judged by.
    point_share : float
        Share of the point-to-point metric in the step of line pairs; see `labkit.approach`.
    """

    moved: FloatArray
    nearest: FloatArray
    center: FloatArray
    target_index: IntArray
    distances: FloatArray
    from_line: FloatArray | None
    within_overlap: BoolArray
    kept: BoolArray
    weights: FloatArray
    gate: float
    huber_delta: float
    point_share: float = 0.0

    @property
    def source(self) -> FloatArray:
        """The source points in the target's frame [m], shape (N, 2)."""
        return self.moved[:2].T

    @property
    def target(self) -> FloatArray:
        """The nearest target point of each [m], shape (N, 2)."""
        return self.nearest[:2].T

    @property
    def normals(self) -> FloatArray | None:
        """Its normal, shape (N, 2), zero where it has none; None under point-to-point."""
        return None if self.from_line is None else self.nearest[2:].T

    @cached_property
    def residuals(self) -> FloatArray:
        """What the metric minimises [m], shape (N,): the distance, or that from the line.

        NaN where the target has no normal.
        """
        if self.from_line is None:
            return self.distances
        return np.where(self.nearest[2:].any(axis=0), np.abs(self.from_line), np.nan)

    @cached_property
    def within_gate(self) -> BoolArray:
        """Which pairs passed the gate, shape (N,)."""
        return distance_gate(self.distances, self.gate)

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
        d = self.distances[self.kept]
        return math.sqrt(float(d @ d) / len(d)) if len(d) else math.nan

    @cached_property
    def cost(self) -> float:
        """The truncated Huber cost J [m²] over all source points, (4.4) of `labkit.icp`."""
        charged = np.minimum(self.distances, self.gate)
        if self.from_line is not None:
            usable = self.within_gate & np.isfinite(self.residuals)
            charged = np.where(usable, self.residuals, charged)
        loss = huber_loss(charged[self.within_overlap], self.huber_delta)
        return float(loss.sum() / len(charged))
