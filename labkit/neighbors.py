"""Nearest-neighbour search: box D of the lesson's flow chart (section 4).

Two ways lead to the same answer. All N·M distances are the definition, and every other way
is tested against them. A KD-tree computes O(log M) of them per query.
"""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np
import scipy  # its parts are loaded when they are used
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, IntArray, as_points
from labkit.errors import InvalidParameterError

Method = Literal["tree", "brute"]
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

    Both methods give the same answers, bit for bit, and of equally near points both take
    the first.

    Parameters
    ----------
    target : array_like, shape (M, 2)
        Points to search, in metres.
    method : {"tree", "brute"}
        A KD-tree, or all distances.

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
                f"must be one of {', '.join(get_args(Method))}, got {method!r}", parameter="method"
            )
        self.target = as_points(target, "target")
        self.method = method
        self.tree: Any = scipy.spatial.cKDTree(self.target) if method == "tree" else None

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
        index = self._by_tree(points) if self.tree else nearest_by_brute_force(points, self.target)
        offset = points - self.target[index]
        return index, np.sqrt((offset**2).sum(axis=1))

    def _by_tree(self, points: FloatArray) -> IntArray:
        """What brute force finds, in O(log M) a query."""
        if len(self.target) == 1:
            return np.zeros(len(points), dtype=np.intp)
        distance, index = self.tree.query(points, k=2)
        nearest: IntArray = index[:, 0].astype(np.intp)
        # A tree meets ties in the order of its leaves; brute force settles them.
        tied = distance[:, 1] <= distance[:, 0] * (1.0 + 1e-14)
        nearest[tied] = nearest_by_brute_force(points[tied], self.target)
        return nearest
