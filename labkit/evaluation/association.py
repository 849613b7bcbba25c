"""Pairs of poses of two trajectories, the nearest in time."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from labkit.support.arrays import IntArray, as_stamps, check_range


def associate(stamps_a: ArrayLike, stamps_b: ArrayLike, tolerance: float) -> IntArray:
    """Pair two sets of stamps one to one.

    Two stamps make a pair if each is the other's nearest and they lie no further apart
    than the tolerance.

    Parameters
    ----------
    stamps_a, stamps_b : array_like, shape (A,) and (B,)
        Seconds, in any order.
    tolerance : float
        The greatest difference in seconds.

    Returns
    -------
    ndarray of int, shape (M, 2)
        Indices into `stamps_a` and `stamps_b`, in the order of `stamps_a`.

    Examples
    --------
    >>> associate([0.0, 1.0, 2.0], [1.02, 1.9, 2.01], tolerance=0.05).tolist()
    [[1, 0], [2, 2]]
    """
    a, b = as_stamps(stamps_a, "stamps_a"), as_stamps(stamps_b, "stamps_b")
    check_range(tolerance, "tolerance", at_least=0.0, unit="s")
    if a.size == 0 or b.size == 0:
        return np.empty((0, 2), dtype=np.intp)
    gap, b_of_a = scipy.spatial.cKDTree(b[:, None]).query(a[:, None])
    _, a_of_b = scipy.spatial.cKDTree(a[:, None]).query(b[:, None])
    index = np.arange(len(a))
    paired = (a_of_b[b_of_a] == index) & (gap <= tolerance)
    return np.asarray(np.column_stack([index, b_of_a])[paired], dtype=np.intp)
