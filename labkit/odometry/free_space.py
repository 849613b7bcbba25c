"""What a scan's beams look through: places that a map says are walls (section 5).

A wrong match may lay half of a scan on walls, and the residuals do not show it, since they
know only pairs. But a beam that ended at 5 m has seen that nothing stands at 3 m. If a match
puts a wall of the map there, either the wall is gone or the match is wrong.
"""

from __future__ import annotations

import math

import numpy as np

from labkit.arrays import FloatArray
from labkit.correspondences import MIN_PAIRS
from labkit.scan import Scan
from labkit.se2 import apply, invert

CLEARANCE = 0.3  # [m]: a beam must end this far behind a point to have looked through it
GAP = math.radians(5.0)  # between two beams farther apart nobody knows what stands


def seen_through(source: Scan, target_points: FloatArray, T_target_source: FloatArray) -> float:
    """The share of the target's points in view that the source's beams look through.

    Parameters
    ----------
    source : Scan
        The newer scan, N points.
    target_points : ndarray, shape (M, 2)
        Points of the older scan or of the map, in its frame [m].
    T_target_source : ndarray, shape (3, 3)
        The pose to judge.

    Returns
    -------
    float
        0 where all beams that pass near a point end there, 1 where all pass it. Points
        that lie hidden behind the beams' ends are not in view. NaN with nothing in view.

    Examples
    --------
    >>> wall = Scan.from_points([[2.0, -0.1], [2.0, 0.0], [2.0, 0.1]])
    >>> curtain = np.array([[1.0, 0.0], [2.0, 0.05], [4.0, 0.0]])
    >>> seen_through(wall, curtain, np.eye(3))
    0.5
    """
    if len(source) < MIN_PAIRS:
        return math.nan
    bearing, end = _polar(source.points)
    order = np.argsort(bearing, kind="stable")
    bearing, end = bearing[order], end[order]
    angle, distance = _polar(apply(invert(T_target_source), target_points))
    right = np.searchsorted(bearing, angle)
    inside = (right > 0) & (right < len(bearing))
    right, angle, distance = right[inside], angle[inside], distance[inside]
    between = bearing[right] - bearing[right - 1] < GAP
    nearer_end = np.minimum(end[right], end[right - 1])
    farther_end = np.maximum(end[right], end[right - 1])
    through = between & (distance < nearer_end - CLEARANCE)
    hit = between & ~through & (distance < farther_end + CLEARANCE)
    seen = np.count_nonzero(through) + np.count_nonzero(hit)
    return float(np.count_nonzero(through) / seen) if seen else math.nan


def _polar(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bearings [rad] and distances [m] of points (N, 2)."""
    return np.arctan2(points[:, 1], points[:, 0]), np.hypot(points[:, 0], points[:, 1])
