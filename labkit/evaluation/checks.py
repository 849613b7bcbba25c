"""What only an evaluation asks of its caller: poses, pairs of trajectories, stamps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_floats
from labkit.errors import InvalidPointsError


def as_poses(poses: ArrayLike, name: str) -> FloatArray:
    """Check a trajectory: rows (x [m], y [m], θ [rad]), shape (K, 3), K ≥ 1, finite."""
    checked = as_floats(poses, name, hint="give rows (x, y, theta)")
    if checked.ndim != 2 or checked.shape[1] != 3:
        raise InvalidPointsError(
            f"`{name}` must have shape (K, 3), rows (x, y, theta), got {checked.shape}"
        )
    if len(checked) == 0:
        raise InvalidPointsError(f"`{name}` is empty, got shape {checked.shape}")
    wrong = np.flatnonzero(~np.isfinite(checked).all(axis=1))
    if wrong.size:
        raise InvalidPointsError(
            f"`{name}` must be finite, got {checked[wrong[0]].tolist()} at index {wrong[0]}"
        )
    return checked


def as_trajectories(estimate: ArrayLike, reference: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Check two trajectories whose rows k belong to the same instant."""
    x, x_reference = as_poses(estimate, "estimate"), as_poses(reference, "reference")
    if len(x) != len(x_reference):
        raise InvalidPointsError(
            f"`estimate` and `reference` must have the same length, got {len(x)} and "
            f"{len(x_reference)} poses; pair them by `associate` first"
        )
    return x, x_reference


def as_stamps(stamps: ArrayLike, name: str) -> FloatArray:
    """Check times: shape (K,), seconds, finite, in any order."""
    checked = as_floats(stamps, name, hint="give seconds")
    if checked.ndim != 1:
        raise InvalidPointsError(f"`{name}` must have shape (K,), got {checked.shape}")
    wrong = np.flatnonzero(~np.isfinite(checked))
    if wrong.size:
        raise InvalidPointsError(
            f"`{name}` must be finite, got {checked[wrong[0]]} at index {wrong[0]}"
        )
    return checked
