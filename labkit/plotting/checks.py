"""What a plotter asks of its caller: scans as points, one point, trajectories as rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_floats, as_points
from labkit.errors import InvalidPointsError
from labkit.scan import Scan


def scan_points(scan: Scan | ArrayLike, name: str) -> FloatArray:
    """The points of a scan, or a checked array of them, shape (N, 2) [m]; not empty."""
    return as_points(scan.points if isinstance(scan, Scan) else scan, name)


def single_point(point: ArrayLike, name: str) -> FloatArray:
    """Check one point (x, y), shape (2,), finite."""
    checked = as_floats(point, name, hint="give two numbers (x, y)")
    if checked.shape != (2,):
        raise InvalidPointsError(
            f"`{name}` must be one point (x, y), shape (2,), got shape {checked.shape}"
        )
    if not np.isfinite(checked).all():
        raise InvalidPointsError(f"`{name}` must be finite, got {checked.tolist()}")
    return checked


def pose_rows(poses: ArrayLike, name: str) -> FloatArray:
    """Check a trajectory: K ≥ 1 finite rows (x [m], y [m], θ [rad]), shape (K, 3)."""
    rows = as_floats(poses, name, hint="give rows (x, y, theta)")
    if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) == 0:
        raise InvalidPointsError(
            f"`{name}` must have shape (K, 3), rows (x, y, theta), K at least 1, got {rows.shape}"
        )
    wrong = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if wrong.size:
        raise InvalidPointsError(
            f"`{name}` must be finite, got {rows[wrong[0]].tolist()} at index {wrong[0]}"
        )
    return rows
