"""What only an evaluation asks of its caller: pairs of trajectories, stamps."""

from __future__ import annotations

from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_finite, as_floats, as_poses
from labkit.errors import InvalidPointsError


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
    return as_finite(checked, name)
