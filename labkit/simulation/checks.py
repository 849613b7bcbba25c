"""What only a simulation asks of its caller: segments."""

from __future__ import annotations

from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_finite, as_floats
from labkit.errors import InvalidPointsError


def as_segments(segments: ArrayLike, name: str) -> FloatArray:
    """Check line segments: M pairs of end points (x, y) [m], shape (M, 2, 2), finite."""
    checked = as_floats(segments, name, hint="give an (M, 2, 2) array of end points in metres")
    if checked.ndim != 3 or checked.shape[1:] != (2, 2):
        raise InvalidPointsError(f"`{name}` must have shape (M, 2, 2), got {checked.shape}")
    return as_finite(checked, name)
