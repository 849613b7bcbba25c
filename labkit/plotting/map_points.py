"""A map out of scans: every point where the trajectory puts it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, check_range
from labkit.errors import InvalidPointsError
from labkit.plotting.checks import pose_rows
from labkit.scan import Scan
from labkit.se2 import rotation


def map_points(
    poses: ArrayLike, scans: Sequence[Scan], *, range_max: float = math.inf
) -> FloatArray:
    """The points of all scans in the world's frame.

    Parameters
    ----------
    poses : array_like, shape (K, 3)
        Where each scan was taken, rows (x [m], y [m], θ [rad]).
    scans : sequence of Scan, length K
        The scans; one without points adds none.
    range_max : float
        Points farther than this from their scanner [m] are left out: a small error of
        the heading throws them far.

    Returns
    -------
    ndarray, shape (P, 2)
        World points [m], in the order of the scans.

    Raises
    ------
    InvalidPointsError
        For poses of a wrong shape, or not one for each scan.

    Examples
    --------
    >>> scan = Scan.from_points([[1.0, 0.0]])
    >>> np.round(map_points([[0, 0, 0], [5, 0, np.pi / 2]], [scan, scan]), 12).tolist()
    [[1.0, 0.0], [5.0, 1.0]]
    """
    rows = pose_rows(poses, "poses")
    check_range(range_max, "range_max", above=0.0, unit="m")
    if len(scans) != len(rows):
        raise InvalidPointsError(
            f"`scans` and `poses` must be one to one, got {len(scans)} scans and {len(rows)} poses"
        )
    # One long array instead of a loop over scans: p_w = R(θ_k) p + t_k, k by the point.
    points = np.vstack([scan.points.reshape(-1, 2) for scan in scans])
    k = np.repeat(np.arange(len(rows)), [len(scan) for scan in scans])
    near = np.hypot(*points.T) <= range_max
    points, k = points[near], k[near]
    R = rotation(rows[:, 2])
    world: FloatArray = np.einsum("nij,nj->ni", R[k], points) + rows[k, :2]
    return world
