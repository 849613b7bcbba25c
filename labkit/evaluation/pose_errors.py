"""Errors of poses, and the statistics of many of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.se2 import relative, to_xytheta
from labkit.support.arrays import FloatArray, IntArray, as_poses
from labkit.support.errors import InvalidPointsError


@dataclass(frozen=True)
class ErrorSummary:
    """Statistics of errors, in their unit; NaN if there are none, for 0.0 would look perfect.

    `std` is divided by `count`; `p95` is the 95th percentile, linear between two errors.
    """

    count: int
    mean: float
    std: float
    median: float
    p95: float
    max: float
    rmse: float

    @classmethod
    def of(cls, errors: ArrayLike) -> ErrorSummary:
        """Summarise errors of shape (N,); N may be 0.

        Examples
        --------
        >>> ErrorSummary.of([3.0, 4.0, 5.0]).median
        4.0
        >>> ErrorSummary.of([]).rmse
        nan
        """
        e = np.asarray(errors, dtype=np.float64)
        if e.size == 0:
            return cls(0, *[math.nan] * 6)
        p95, rmse = np.percentile(e, 95.0), np.sqrt(np.mean(e**2))
        return cls(e.size, *map(float, (e.mean(), e.std(), np.median(e), p95, e.max(), rmse)))


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """N translation errors [m] ≥ 0 and N rotation errors [rad] in [0, π], by pose or pair.

    `pairs`, (N, 2), are the poses at which the stretches of `rpe` begin and end.
    """

    translation_errors: FloatArray
    rotation_errors: FloatArray
    pairs: IntArray | None = None

    @property
    def translation(self) -> ErrorSummary:
        """Statistics of the translation errors [m]."""
        return ErrorSummary.of(self.translation_errors)

    @property
    def rotation(self) -> ErrorSummary:
        """Statistics of the rotation errors [rad]."""
        return ErrorSummary.of(self.rotation_errors)

    def __repr__(self) -> str:
        count, moved, turned = len(self.rotation_errors), self.translation.rmse, self.rotation.rmse
        return f"PoseErrors({count} errors: RMSE {moved:.3g} m, {turned:.3g} rad)"


def pose_differences(T_true: FloatArray, T_estimated: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lengths [m] and angles [rad], (N,), of ``invert(T_true) @ T_estimated``, (N, 3, 3)."""
    difference = to_xytheta(relative(T_true, T_estimated))
    return np.hypot(difference[:, 0], difference[:, 1]), np.abs(difference[:, 2])


def as_trajectories(**named: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Check two trajectories, or lists of increments, whose rows k belong to one instant."""
    a, b = (as_poses(poses, name) for name, poses in named.items())
    if len(a) != len(b):
        raise InvalidPointsError(
            f"`{'` and `'.join(named)}` must have the same length, got {len(a)} and {len(b)} rows"
        )
    return a, b
