"""Nearest-neighbour search: box D of the lesson's flow chart (section 4).

Four ways to the same answer. All distances by subtraction are the definition, and the
oracle of the others. A KD-tree asks O(log M) of them a query. One matrix product, with
‖p − q‖² = ‖p‖² − 2 p·q + ‖q‖², does all N·M of them at the speed of the processor, which
up to some hundred points is faster than any tree. Past that, a sweep of beams is cut into
runs, and a product is made of those that lie near each other: on 1,000 beams this takes
half of what the tree takes, which has to be built as well (both: `labkit.products`).
"""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
import scipy  # its parts are loaded when they are used
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, IntArray, as_points, by_column, homogeneous
from labkit.errors import InvalidParameterError
from labkit.products import MatrixSearch, SweepSearch
from labkit.scan import Scan, as_scan

Method = Literal["auto", "tree", "brute", "matrix", "sweep"]
MATRIX_MAX = 450, 700  # target points up to which a product beats runs of beams, and the tree
SWEEP_MAX = 10_000  # and runs of beams beat the tree
FAR_OFF = 1000.0  # [m]: about a centroid so far away, products round by 2e-10 m²
_CANDIDATES = 8  # target points among which a tie is settled; more need all of them
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
    target : Scan or array_like, shape (M, 2)
        Points to search, in metres.
    method : {"auto", "tree", "brute", "matrix", "sweep"}
        A KD-tree and brute force give the same answers, bit for bit, and of equally near
        points both take the first. The products ("matrix", and "sweep" for points in beam
        order) round differently: of two points that are equally near to within rounding they
        may take either. "auto" is the fastest for the size and for beams.

    Examples
    --------
    >>> search = NearestNeighbors([[0.0, 0.0], [2.0, 0.0]])
    >>> index, distance = search.query([[1.5, 0.0]])
    >>> int(index[0]), float(distance[0])
    (1, 0.5)
    """

    def __init__(self, target: Scan | ArrayLike, method: Method = "tree") -> None:
        if method not in get_args(Method):
            raise InvalidParameterError(
                f"must be one of {', '.join(get_args(Method))}, got {method!r}", parameter="method"
            )
        scan = as_scan(target, "target", minimum=1)
        self.target = by_column(scan.points)
        self.center = _middle(self.target.T)
        self.columns = self.target.T - self.center
        self.method = _fastest(len(scan), scan.beams is not None) if method == "auto" else method
        if self.method == "tree":
            # A leaf of 8 is a twelfth faster to ask than one of 16.
            self.tree = scipy.spatial.cKDTree(self.target, leafsize=8)
        elif self.method == "matrix":
            self._product = MatrixSearch(self.columns)
        elif self.method == "sweep":
            self._sweep = SweepSearch(self.columns)

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
        index = self.nearest(points)
        offset = points - self.target[index]
        return index, np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)

    def nearest(self, points: FloatArray) -> IntArray:
        """The indices alone, of points that have been checked already."""
        if self.method == "tree":
            return _nearest_by_tree(points, self.target, self.tree)
        if self.method == "brute":
            return nearest_by_brute_force(points, self.target)
        return self.nearest_to_columns(homogeneous(points - self.center.T))

    def nearest_to_columns(self, columns: FloatArray, before: IntArray | None = None) -> IntArray:
        """The same of points that are `homogeneous` columns about the target's `center`.

        Where the points had partners `before`, a sweep is searched faster.
        """
        if self.method == "matrix":
            return self._product.nearest(columns)
        if self.method == "sweep":
            return self._sweep.nearest(columns, before)
        return self.nearest(columns[:2].T + self.center.T)


def _middle(columns: FloatArray) -> FloatArray:
    """The centroid, shape (2, 1), or the median of each row where some points are far off."""
    center: FloatArray = columns.sum(axis=1, keepdims=True) / columns.shape[1]
    if math.dist(center[:, 0].tolist(), columns[:, 0].tolist()) > FAR_OFF:
        half = columns.shape[1] // 2
        center = np.partition(columns, half, axis=1)[:, half, None]
    return center


def _fastest(count: int, in_order: bool) -> Method:
    """The way that a match of `count` target points takes the least time, as measured."""
    if in_order:
        return "matrix" if count <= MATRIX_MAX[0] else "sweep" if count <= SWEEP_MAX else "tree"
    return "matrix" if count <= MATRIX_MAX[1] else "tree"


def _nearest_by_tree(
    points: FloatArray, target: FloatArray, tree: scipy.spatial.cKDTree
) -> IntArray:
    """What brute force finds, in O(log M) a query."""
    if len(target) == 1:
        return np.zeros(len(points), dtype=np.intp)
    distance, index = tree.query(points, k=2)
    nearest: IntArray = index[:, 0].astype(np.intp)
    # A tree meets ties in the order of its leaves; settle them as brute force does.
    tied = _all_tied(distance)
    if len(tied):
        nearest[tied] = _first_of_nearest(points[tied], target, tree)
    return nearest


def _first_of_nearest(
    points: FloatArray, target: FloatArray, tree: scipy.spatial.cKDTree
) -> IntArray:
    """Of equally near target points the first one, of few candidates where few are tied."""
    if len(target) <= _CANDIDATES:
        return nearest_by_brute_force(points, target)
    distance, index = tree.query(points, k=_CANDIDATES)
    offset = points[:, None] - target[index]
    squares = offset[..., 0] ** 2 + offset[..., 1] ** 2
    least = squares == squares.min(axis=1, keepdims=True)
    first: IntArray = np.where(least, index, len(target)).min(axis=1).astype(np.intp)
    many = _all_tied(distance)
    if len(many):
        first[many] = nearest_by_brute_force(points[many], target)
    return first


def _all_tied(distance: FloatArray) -> IntArray:
    """The rows whose last candidate is as near as the first, to within rounding."""
    return np.flatnonzero(distance[:, -1] <= distance[:, 0] * (1.0 + 1e-14))
