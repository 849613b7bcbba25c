"""What only a simulation asks of its caller: poses, segments, counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_floats
from labkit.errors import InvalidParameterError, InvalidPointsError


def as_poses(poses: ArrayLike, name: str, minimum: int = 1) -> FloatArray:
    """Check a trajectory: rows (x [m], y [m], θ [rad]), shape (K, 3), finite."""
    checked = as_floats(poses, name, hint="give rows (x, y, theta)")
    if checked.ndim != 2 or checked.shape[1] != 3:
        raise InvalidPointsError(
            f"`{name}` must have shape (K, 3), rows (x, y, theta), got {checked.shape}"
        )
    if len(checked) < minimum:
        plural = "s" if minimum > 1 else ""
        raise InvalidPointsError(
            f"`{name}` needs at least {minimum} pose{plural}, got {len(checked)}"
        )
    return _finite_rows(checked, name)


def as_segments(segments: ArrayLike, name: str) -> FloatArray:
    """Check line segments: M pairs of end points (x, y) [m], shape (M, 2, 2), finite."""
    checked = as_floats(segments, name, hint="give an (M, 2, 2) array of end points in metres")
    if checked.ndim != 3 or checked.shape[1:] != (2, 2):
        raise InvalidPointsError(f"`{name}` must have shape (M, 2, 2), got {checked.shape}")
    return _finite_rows(checked, name)


def check_count(value: int, name: str, at_least: int) -> None:
    """Raise `InvalidParameterError` unless `value` is a whole number ≥ `at_least`."""
    if not isinstance(value, (int, np.integer)) or value < at_least:
        raise InvalidParameterError(
            f"`{name}` must be a whole number of at least {at_least}, got {value!r}"
        )


def _finite_rows(rows: FloatArray, name: str) -> FloatArray:
    wrong = np.argwhere(~np.isfinite(rows))
    if wrong.size:
        index = int(wrong[0, 0])
        raise InvalidPointsError(
            f"`{name}` must be finite, got {rows[index].tolist()} at index {index}"
        )
    return rows
