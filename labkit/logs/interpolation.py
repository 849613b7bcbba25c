"""Odometry at the times of the scans."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_finite, as_floats, as_poses
from labkit.errors import InvalidPointsError
from labkit.se2 import wrap

MAX_EXTRAPOLATION = 0.1  # [s] for which the first and the last pose are held


def interpolate_poses(stamps: ArrayLike, times: ArrayLike, poses: ArrayLike) -> FloatArray:
    """Interpolate a trajectory: x and y linearly, θ along the shorter arc.

    Parameters
    ----------
    stamps : array_like, shape (K,)
        Times of the scans [s].
    times : array_like, shape (M,)
        Times of the poses [s], in any order.
    poses : array_like, shape (M, 3)
        Rows (x [m], y [m], θ [rad]).

    Returns
    -------
    ndarray, shape (K, 3)
        A pose for each scan, θ in (−π, π].

    Raises
    ------
    InvalidPointsError
        If the shapes do not fit together, a number is not finite, or a stamp lies more than
        0.1 s before the first or after the last pose.

    Examples
    --------
    >>> odometry = interpolate_poses([0.25, 1.0], [0.0, 1.0], [[0, 0, 3.0], [1, 2, -3.0]])
    >>> odometry.round(3).tolist()
    [[0.25, 0.5, 3.071], [1.0, 2.0, -3.0]]
    """
    rows, t = as_poses(poses, "poses"), as_finite(as_floats(stamps, "stamps"), "stamps")
    known = as_finite(as_floats(times, "times"), "times")
    if t.ndim != 1 or known.shape != (len(rows),):
        raise InvalidPointsError(
            f"`stamps` must have shape (K,) and `times` ({len(rows)},), one per pose, "
            f"got {t.shape} and {known.shape}"
        )
    order = np.argsort(known, kind="stable")
    known, rows = known[order], rows[order]
    outside = seconds_outside(t, known)
    if (outside > MAX_EXTRAPOLATION).any():
        k = int(np.argmax(outside))
        raise InvalidPointsError(
            f"`stamps` must lie within `times`, from {known[0]:.10g} to {known[-1]:.10g} s, got "
            f"{t[k]:.10g} s at index {k}; drop such scans, or bring both to one clock"
        )
    theta = np.interp(t, known, np.unwrap(rows[:, 2]))
    x, y = (np.interp(t, known, rows[:, axis]) for axis in (0, 1))
    return np.column_stack([x, y, wrap(theta)])


def seconds_outside(stamps: FloatArray, times: FloatArray) -> FloatArray:
    """Time [s] from each stamp to the span of the sorted times; 0 or less inside it."""
    outside: FloatArray = np.maximum(times[0] - stamps, stamps - times[-1])
    return outside
