"""Which target point belongs to which source point, and which pairs to believe (section 4).

The stages of the lesson's flow chart, each one function, and `Correspondences`, what
they leave:

=============  =================================================================
associate      `labkit.neighbors`: the nearest target point of each source point
reject         `distance_gate` (A) and `overlap` (B); `keep`: their intersection
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

from labkit.arrays import BoolArray, FloatArray, IntArray, check_range, take_rows

MIN_PAIRS = 3  # the fewest pairs a step is computed from, as in the lesson
ORIGIN = np.zeros((2, 1))
# What a step is summed from, a column for each pair: the source point p as (x, y, 1) and its
# offset p − q from its partner. Under the point-to-line metric also the partner's normal n,
# zero where it has none, n·p⊥, and n·(p − q); see `labkit.line_alignment`.
MOVED, OFFSET, NORMAL, TURNING, FROM_LINE = slice(0, 3), slice(3, 5), slice(5, 7), 7, 8


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


def keep(
    distances: FloatArray, max_correspondence_distance: float, overlap_ratio: float
) -> BoolArray:
    """Which pairs pass (A) and (B); with a ratio of 1 there is no (B) to compute."""
    within_gate = distance_gate(distances, max_correspondence_distance)
    return within_gate if overlap_ratio == 1.0 else within_gate & overlap(distances, overlap_ratio)


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


def point_rows(moved: FloatArray, nearest: FloatArray) -> FloatArray:
    """`MOVED` and `OFFSET` of points (x, y, 1) and their partners, shape (5, N)."""
    return np.concatenate((moved, moved[:2] - nearest))


@dataclass(frozen=True, eq=False, kw_only=True)
class Correspondences:
    """The pairs of one association and what became of each.

    Entry i is source point i; from afar, that of ``source[::every]`` (see `labkit.approach`).
    It keeps what the loop works with; what people ask for is derived from that when they do.

    Attributes
    ----------
    rows : ndarray, shape (5, N) or (9, N)
        What a step is summed from, in metres about `center`: `MOVED` to `FROM_LINE`, under
        the point-to-point metric the first two.
    every : int
        Of how many source points one was looked at; N counts those.
    center : ndarray, shape (2, 1)
        Where the rows have their origin [m]: amid the target under point-to-line, for sums
        about it round little, else at that of the target's frame.
    target_points : ndarray, shape (M, 2)
        All points of the target [m].
    target_index : ndarray of int, shape (N,)
        The partner's row there.
    distances : ndarray, shape (N,)
        How far the pair is apart [m].
    kept : ndarray of bool, shape (N,)
        Which passed the gate, are among the ⌊ρN⌋ closest, and have a residual.
    weights : ndarray, shape (N,)
        Huber's weight of a kept pair, 0 for a rejected one.
    gate, overlap_ratio, huber_delta : float
        d_max [m], ρ and δ [m] that they were judged by.
    point_share : float
        Share of the point-to-point metric in the step of line pairs; see `labkit.approach`.
    """

    rows: FloatArray
    every: int = 1
    center: FloatArray
    target_points: FloatArray
    target_index: IntArray
    distances: FloatArray
    kept: BoolArray
    weights: FloatArray
    gate: float
    overlap_ratio: float
    huber_delta: float
    point_share: float = 0.0

    @property
    def source(self) -> FloatArray:
        """The source points in the target's frame [m], shape (N, 2)."""
        return (self.rows[:2] + self.center).T

    @property
    def target(self) -> FloatArray:
        """The nearest target point of each [m], shape (N, 2)."""
        return take_rows(self.target_points, self.target_index)

    @property
    def on_lines(self) -> bool:
        """Whether they were matched under the point-to-line metric."""
        return len(self.rows) > FROM_LINE

    @property
    def normals(self) -> FloatArray | None:
        """Its normal, shape (N, 2), zero where it has none; None under point-to-point."""
        return self.rows[NORMAL].T if self.on_lines else None

    @cached_property
    def residuals(self) -> FloatArray:
        """What the metric minimises [m], shape (N,): the distance, or that from the line.

        NaN where the target has no normal.
        """
        if not self.on_lines:
            return self.distances
        return np.where(self.rows[NORMAL].any(axis=0), np.abs(self.rows[FROM_LINE]), np.nan)

    @cached_property
    def within_gate(self) -> BoolArray:
        """Which pairs passed the gate, shape (N,)."""
        return distance_gate(self.distances, self.gate)

    @cached_property
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
        d = self.distances[self.kept]
        return math.sqrt(float(d @ d) / len(d)) if len(d) else math.nan

    @cached_property
    def cost(self) -> float:
        """The truncated Huber cost J [m²] of the ⌊ρN⌋ closest pairs, over N; see `labkit.icp`."""
        charged = np.minimum(self.distances, self.gate)
        if self.on_lines:
            usable = self.within_gate & np.isfinite(self.residuals)
            charged = np.where(usable, self.residuals, charged)
        loss = huber_loss(charged[self.within_overlap], self.huber_delta)
        return float(loss.sum() / len(charged))
