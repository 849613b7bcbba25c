"""Errors of poses, and the statistics of many of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.se2 import relative, to_xytheta
from labkit.support.arrays import (
    FloatArray,
    IntArray,
    as_finite,
    as_floats,
    as_poses,
    check_range,
)
from labkit.support.errors import InvalidPointsError

MAX_ERROR = 1e100  # its square is finite
MAX_TURN = 2.0  # [rad]: a robot turns less from one scan to the next
USE_RADIANS = "are these degrees? use `np.radians`"


@dataclass(frozen=True)
class ErrorSummary:
    """Statistics of errors, in their unit; NaN if there are none, since 0.0 would look perfect.

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
        e = as_finite(as_floats(errors, "errors", "give a list of errors", ("N",)), "errors")
        if e.size == 0:
            nan = math.nan
            return cls(count=0, mean=nan, std=nan, median=nan, p95=nan, max=nan, rmse=nan)
        check_range(float(e.max()), "errors", at_most=MAX_ERROR)
        return cls(
            count=e.size,
            mean=float(e.mean()),
            std=float(e.std()),
            median=float(np.median(e)),
            p95=float(np.percentile(e, 95.0)),
            max=float(e.max()),
            rmse=float(np.sqrt(np.mean(e**2))),
        )


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """N translation errors [m] ≥ 0 and N rotation errors [rad] in [0, π], by pose or pair.

    `pairs`, (N, 2), are the poses at which the stretches of `rpe` begin and end.
    """

    translation_errors: FloatArray
    rotation_errors: FloatArray
    pairs: IntArray | None = None

    def __post_init__(self) -> None:
        count = len(as_floats(self.translation_errors, "translation_errors", shape=("N",)))
        as_floats(self.rotation_errors, "rotation_errors", shape=(count,))
        if self.pairs is not None:
            as_floats(self.pairs, "pairs", shape=(count, 2))

    @property
    def translation(self) -> ErrorSummary:
        """Statistics of the translation errors [m]."""
        return ErrorSummary.of(self.translation_errors)

    @property
    def rotation(self) -> ErrorSummary:
        """Statistics of the rotation errors [rad]."""
        return ErrorSummary.of(self.rotation_errors)

    def __repr__(self) -> str:
        metres, radians = self.translation.rmse, self.rotation.rmse
        count = len(self.rotation_errors)
        return f"PoseErrors({count} errors: RMSE {metres:.3g} m, {radians:.3g} rad)"


def pose_differences(T_true: FloatArray, T_estimated: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lengths [m] and angles [rad], (N,), of ``invert(T_true) @ T_estimated``, (N, 3, 3)."""
    difference = to_xytheta(relative(T_true, T_estimated))
    return np.hypot(difference[:, 0], difference[:, 1]), np.abs(difference[:, 2])


def as_trajectories(estimate: ArrayLike, reference: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Check two trajectories whose rows k belong to one instant; their headings are radians."""
    rows = as_poses(estimate, "estimate")
    rows_reference = as_poses(reference, "reference")
    check_lengths(rows, rows_reference, "estimate", "reference")
    check_headings(rows, "estimate")
    check_headings(rows_reference, "reference")
    return rows, rows_reference


def as_increments(increments: ArrayLike, name: str) -> FloatArray:
    """Check motions, rows (Δx [m], Δy [m], Δψ [rad]), none of which turns by more than 2π."""
    rows = as_poses(increments, name)
    turns = np.abs(rows[:, 2])
    if turns.max() > 2.0 * math.pi:
        row = int(turns.argmax())
        raise InvalidPointsError(
            f"`{name}` must turn by at most 2π [rad], got {rows[row, 2]:g} at index {row}; "
            f"{USE_RADIANS}"
        )
    return rows


def check_lengths(a: FloatArray, b: FloatArray, name_a: str, name_b: str) -> None:
    """Raise `InvalidPointsError` unless both have as many rows."""
    if len(a) != len(b):
        raise InvalidPointsError(
            f"`{name_a}` and `{name_b}` must have the same length, got {len(a)} and {len(b)} rows"
        )


def check_headings(rows: FloatArray, name: str) -> None:
    """Raise `InvalidPointsError` where headings beyond 2π jump as degrees do.

    Headings in radians that count full turns go beyond 2π as well, and jump by nearly a full
    turn where they are counted anew. Degrees jump by anything.
    """
    theta = rows[:, 2]
    jumps = np.abs(np.diff(theta))
    turns = np.where(jumps > math.pi, np.abs(jumps - 2.0 * math.pi), 0.0)  # beside a full turn
    if np.abs(theta).max() > 2.0 * math.pi and turns.max(initial=0.0) > MAX_TURN:
        row = int(turns.argmax())
        raise InvalidPointsError(
            f"`{name}` must have headings in radians, got {theta[row]:g} and {theta[row + 1]:g} "
            f"one after the other, at index {row}; {USE_RADIANS}"
        )
