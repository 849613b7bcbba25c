"""Which target point belongs to which source point, and which pairs to believe (section 4).

The stages of the lesson's flow chart, each one function:

=============  =================================================================
associate      `NearestNeighbors.query`: the nearest target point of each source point
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

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from labkit.arrays import BoolArray, FloatArray, IntArray, as_points, check_range
from labkit.errors import InvalidParameterError

MIN_PAIRS = 3  # the fewest pairs a step is computed from, as in the lesson
_BLOCK = 1 << 20  # brute force holds at most this many distances at once


def nearest_by_brute_force(points: FloatArray, target: FloatArray) -> IntArray:
    """Index of the nearest target point of each row, by all N·M distances: O(N M).

    Of equally near target points the first one is taken.
    """
    index = np.empty(len(points), dtype=np.intp)
    rows = max(1, _BLOCK // len(target))
    for start in range(0, len(points), rows):
        block = points[start : start + rows]
        dx = block[:, 0, None] - target[:, 0]
        dy = block[:, 1, None] - target[:, 1]
        index[start : start + rows] = np.argmin(dx * dx + dy * dy, axis=1)
    return index


class NearestNeighbors:
    """Nearest-neighbour search in a target, built once and asked often.

    Parameters
    ----------
    target : array_like, shape (M, 2)
        Points to search, in metres.
    method : {"tree", "brute"}
        A KD-tree, O(log M) a query, or all distances, O(M): the answers are the same,
        bit for bit, and of equally near points both take the first.

    Examples
    --------
    >>> search = NearestNeighbors([[0.0, 0.0], [2.0, 0.0]])
    >>> index, distance = search.query([[1.5, 0.0]])
    >>> int(index[0]), float(distance[0])
    (1, 0.5)
    """

    def __init__(self, target: ArrayLike, method: Literal["tree", "brute"] = "tree") -> None:
        if method not in ("tree", "brute"):
            raise InvalidParameterError(f'`method` must be "tree" or "brute", got {method!r}')
        self.target = as_points(target, "target")
        self._tree = cKDTree(self.target) if method == "tree" else None

    def query(self, points: ArrayLike) -> tuple[IntArray, FloatArray]:
        """Nearest target point of each row.

        Parameters
        ----------
        points : array_like, shape (N, 2)
            Points in the target's frame, in metres.

        Returns
        -------
        index : ndarray of int, shape (N,)
            Row of the target.
        distance : ndarray, shape (N,)
            In metres.
        """
        points = as_points(points, "points")
        if self._tree is None:
            index = nearest_by_brute_force(points, self.target)
        else:
            index = _nearest_by_tree(points, self.target, self._tree)
        offset = points - self.target[index]
        return index, np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)


def _nearest_by_tree(points: FloatArray, target: FloatArray, tree: cKDTree) -> IntArray:
    """What `nearest_by_brute_force` finds, in O(log M) a query."""
    if len(target) == 1:
        return np.zeros(len(points), dtype=np.intp)
    distance, index = tree.query(points, k=2)
    nearest: IntArray = index[:, 0].astype(np.intp)
    # A tree meets ties in the order of its leaves; settle them as brute force does.
    tied = np.flatnonzero(distance[:, 1] <= distance[:, 0] * (1.0 + 1e-14))
    nearest[tied] = nearest_by_brute_force(points[tied], target)
    return nearest


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
    kept = np.zeros(len(d), dtype=bool)
    kept[np.argsort(d, kind="stable")[: overlap_count(len(d), overlap_ratio)]] = True
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
    weights = np.ones_like(r)
    far = r > huber_delta
    weights[far] = huber_delta / r[far]
    return weights


def huber_loss(residuals: ArrayLike, huber_delta: float) -> FloatArray:
    """Huber's loss [m²] whose weights those are: r² up to δ, 2δr − δ² beyond."""
    check_range(huber_delta, "huber_delta", above=0.0, unit="m")
    r = np.asarray(residuals, dtype=np.float64)
    far = r > huber_delta
    loss = r * r
    loss[far] = huber_delta * (2.0 * r[far] - huber_delta)
    return loss
