"""Nearest-neighbour search: box D of the lesson's flow chart (section 4).

Three ways to the same answer. All distances by subtraction are the definition, and the
oracle of the other two. A KD-tree asks O(log M) of them a query. One matrix product, with
‖p − q‖² = ‖p‖² − 2 p·q + ‖q‖², does all N·M of them at the speed of the processor, which
up to some hundred points is faster than any tree.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
import scipy  # its parts are loaded when they are used
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, IntArray, as_points, by_column, dots, take_rows
from labkit.errors import InvalidParameterError

Method = Literal["auto", "tree", "brute", "matrix"]
MATRIX_MAX = 450  # target points up to which the matrix product beats the tree
EPSILON = float(np.finfo(float).eps)
_BLOCK = 1 << 20  # brute force holds at most this many distances at once
_CACHED = 45_000  # and one matrix product so many: a third of a megabyte


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
    method : {"auto", "tree", "brute", "matrix"}
        A KD-tree and brute force give the same answers, bit for bit, and of equally near
        points both take the first. The matrix product rounds differently: of two points
        that are equally near to within rounding it may take either. "auto" is the matrix
        product up to 450 target points and the tree beyond.

    Examples
    --------
    >>> search = NearestNeighbors([[0.0, 0.0], [2.0, 0.0]])
    >>> index, distance = search.query([[1.5, 0.0]])
    >>> int(index[0]), float(distance[0])
    (1, 0.5)
    """

    def __init__(self, target: ArrayLike, method: Method = "tree") -> None:
        if method not in get_args(Method):
            raise InvalidParameterError(
                f"`method` must be one of {', '.join(get_args(Method))}, got {method!r}"
            )
        self.target = by_column(as_points(target, "target"))
        if method == "auto":
            method = "matrix" if len(self.target) <= MATRIX_MAX else "tree"
        self.method = method
        if method == "tree":
            # A leaf of 8 is a twelfth faster to ask than one of 16.
            self.tree = scipy.spatial.cKDTree(self.target, leafsize=8)
            self.rounding = 64.0 * EPSILON * float(np.abs(self.target).max())
        elif method == "matrix":
            self._product = _MatrixSearch(self.target)

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
        if self.method == "matrix":
            return self._product.nearest(points)
        if self.method == "tree":
            return _nearest_by_tree(points, self.target, self.tree)[0]
        return nearest_by_brute_force(points, self.target)


def _nearest_by_tree(
    points: FloatArray, target: FloatArray, tree: scipy.spatial.cKDTree
) -> tuple[IntArray, FloatArray]:
    """What brute force finds, in O(log M) a query, and how much farther the next point is."""
    if len(target) == 1:
        return np.zeros(len(points), dtype=np.intp), np.full(len(points), np.inf)
    distance, index = tree.query(points, k=2)
    nearest: IntArray = index[:, 0].astype(np.intp)
    slack: FloatArray = distance[:, 1] - distance[:, 0] * (1.0 + 1e-14)
    # A tree meets ties in the order of its leaves; settle them as brute force does.
    tied = np.flatnonzero(slack <= 0.0)
    if len(tied):
        nearest[tied] = nearest_by_brute_force(points[tied], target)
    return nearest, slack


class Follower:
    """Nearest neighbours of points that move a little from one query to the next.

    A point keeps its neighbour as long as it has moved by less than half of what the next
    one was farther away: the triangle inequality leaves no other answer. Only the rest is
    asked of the tree, which on 1,000 beams halves the time of a match.

    Examples
    --------
    >>> follower = Follower(NearestNeighbors([[0.0, 0.0], [2.0, 0.0]]))
    >>> [int(follower.nearest(np.array([[x, 0.0]]))[0]) for x in (0.5, 0.6, 1.5)]
    [0, 0, 1]
    """

    def __init__(self, search: NearestNeighbors) -> None:
        self._search = search
        self._at, self._slack = np.empty((0, 2)), np.empty(0)
        self._index: IntArray = np.empty(0, dtype=np.intp)

    def nearest(self, points: FloatArray) -> IntArray:
        """What the search would answer; `points` has the same rows in every call."""
        search = self._search
        if search.method != "tree":
            return search.nearest(points)
        if len(self._at) == 0:
            self._at = points.copy("F")
            self._index, self._slack = _nearest_by_tree(points, search.target, search.tree)
            return self._index
        motion = points - self._at
        # A share of 1e-9, and no less than what distances round by, is left to rounding.
        moved = 2.0 * np.sqrt(dots(motion, motion))
        stale = np.flatnonzero(moved * (1.0 + 1e-9) + search.rounding >= self._slack)
        index = self._index.copy()  # the answer before belongs to whoever asked
        if len(stale):
            asked = take_rows(points, stale)
            index[stale], self._slack[stale] = _nearest_by_tree(asked, search.target, search.tree)
            self._at.T[:, stale] = asked.T
        self._index = index
        return index


class _MatrixSearch:
    """argmin over j of ‖qⱼ‖² − 2 p·qⱼ, about the target's centroid against rounding.

    All N·M numbers of 360 beams fill a processor's second cache and drive out the rest of
    the match. By blocks that leave room, the match takes 1 to 4 % less.
    """

    def __init__(self, target: FloatArray) -> None:
        self.center = (target.sum(axis=0) / len(target))[:, None]
        centered = target.T - self.center
        self.columns = np.empty((3, len(target)))
        np.multiply(centered, -2.0, out=self.columns[:2])
        x, y = np.multiply(centered, centered, out=centered)
        np.add(x, y, out=self.columns[2])
        self.block = max(1, _CACHED // len(target))

    def nearest(self, points: FloatArray) -> IntArray:
        rows = np.empty((3, len(points)))
        np.subtract(points.T, self.center, out=rows[:2])
        rows[2] = 1.0
        starts = range(0, len(points), self.block)
        found = [(rows[:, at : at + self.block].T @ self.columns).argmin(axis=1) for at in starts]
        return found[0] if len(found) == 1 else np.concatenate(found)
