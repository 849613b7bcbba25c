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
    """The pairs of one association and what became of each; row i is source point i.

    Attributes
    ----------
    source : ndarray, shape (N, 2)
        The source points in the target's frame, at the pose of the association [m].
    target : ndarray, shape (N, 2)
        The nearest target point of each [m].
    target_index : ndarray of int, shape (N,)
        Its row in the target.
    normals : ndarray, shape (N, 2), or None
        Its normal, zero where it has none; None under the point-to-point metric.
    distances : ndarray, shape (N,)
        How far the pair is apart [m].
    residuals : ndarray, shape (N,)
        What the metric minimises [m]: the distance, or the distance from the line (NaN
        where the target has no normal).
    within_gate, within_overlap, kept : ndarray of bool, shape (N,)
        `kept` passed both, and has a residual.
    weights : ndarray, shape (N,)
        Huber's weight of a kept pair, 0 for a rejected one.
    gate, huber_delta : float
        d_max and δ [m] that they were judged by.
    point_share : float
        Share of the point-to-point metric in the step of line pairs; see `labkit.approach`.
    """

    source: FloatArray
    target: FloatArray
    target_index: IntArray
    normals: FloatArray | None
    distances: FloatArray
    residuals: FloatArray
    within_gate: BoolArray
    within_overlap: BoolArray
    kept: BoolArray
    weights: FloatArray
    gate: float
    huber_delta: float
    point_share: float = 0.0

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
        usable = self.within_gate & np.isfinite(self.residuals)
        charged = np.where(usable, self.residuals, np.minimum(self.distances, self.gate))
        loss = huber_loss(charged[self.within_overlap], self.huber_delta)
        return float(loss.sum() / len(charged))
