"""Absolute trajectory error: the distance of every pose from its place."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from labkit import alignment
from labkit.evaluation.pose_errors import PoseErrors, as_trajectories, pose_differences
from labkit.se2 import from_xytheta, invert
from labkit.support.errors import DegenerateAlignmentError, InvalidParameterError


def ate(
    estimate: ArrayLike,
    reference: ArrayLike,
    align: Literal["rigid", "origin"] | None = "rigid",
) -> PoseErrors:
    """Absolute trajectory error [1]_, one per pose.

    The start of an odometry is arbitrary, so the estimate is first moved onto the reference,
    as one rigid body. The result says little about drift, since one wrong turn early on
    spoils every pose after it. `rpe` measures drift.

    Parameters
    ----------
    estimate, reference : array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]); row k of one belongs to row k of the other.
    align : {"rigid", "origin", None}
        "rigid": least squares over all positions, headings left aside. "origin": the
        first poses coincide. None: the two share a world frame already.

    Raises
    ------
    DegenerateAlignmentError
        If "rigid" has no unique answer, as for a robot that never left its place.

    References
    ----------
    .. [1] Sturm, Engelhard, Endres, Burgard, Cremers, "A benchmark for the evaluation
           of RGB-D SLAM systems", IROS 2012.

    Examples
    --------
    >>> errors = ate([[5, 5, 0], [5, 6, 0]], [[0, 0, 0], [1, 0, 0]])
    >>> bool(errors.translation.max < 1e-12), round(errors.rotation.mean, 4)
    (True, 1.5708)
    """
    x, x_reference = as_trajectories(estimate=estimate, reference=reference)
    T, T_true = from_xytheta(x), from_xytheta(x_reference)
    if align == "rigid":
        try:
            T_reference_estimate = alignment.align(x[:, :2], x_reference[:, :2])
        except DegenerateAlignmentError as error:
            raise DegenerateAlignmentError(
                f"the {len(x)} positions leave the rotation undetermined (a trajectory that "
                f'stays in its place?); use align="origin"'
            ) from error
    elif align == "origin":
        T_reference_estimate = T_true[0] @ invert(T[0])
    elif align is None:
        T_reference_estimate = np.eye(3)
    else:
        raise InvalidParameterError(
            f'must be "rigid", "origin" or None, got {align!r}', parameter="align"
        )
    return PoseErrors(*pose_differences(T_true, T_reference_estimate @ T))


def absolute_errors(estimate: ArrayLike, reference: ArrayLike) -> tuple[str, PoseErrors]:
    """Absolute trajectory error, and its name: first poses aligned if the robot never moved."""
    try:
        return "ATE", ate(estimate, reference)
    except DegenerateAlignmentError:
        return "ATE, first poses aligned", ate(estimate, reference, align="origin")
