"""Absolute trajectory error: how far every pose is from where it should be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from labkit.alignment import align
from labkit.arrays import FloatArray
from labkit.errors import DegenerateAlignmentError, InvalidParameterError
from labkit.evaluation.pose_errors import PoseErrors, as_trajectories, pose_differences
from labkit.se2 import from_xytheta, invert


@dataclass(frozen=True, eq=False, kw_only=True)
class AbsoluteErrors(PoseErrors):
    """The errors of every pose, and the alignment that came before.

    Attributes
    ----------
    translation_errors, rotation_errors : ndarray, shape (K,)
        Metres and radians, one per pose.
    T_reference_estimate : ndarray, shape (3, 3)
        Moved the estimate's world frame onto the reference's.
    """

    T_reference_estimate: FloatArray


def ate(
    estimate: ArrayLike,
    reference: ArrayLike,
    align: Literal["rigid", "origin"] | None = "rigid",
) -> AbsoluteErrors:
    """The absolute trajectory error [1]_.

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

    Returns
    -------
    AbsoluteErrors

    Raises
    ------
    InvalidPointsError
        For rows that are not three finite numbers, or unequal lengths.
    InvalidParameterError
        For another `align`.
    DegenerateAlignmentError
        Where "rigid" has no unique answer, as for a robot that never left its place.

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
    x, x_reference = as_trajectories(estimate, reference)
    T, T_true = from_xytheta(x), from_xytheta(x_reference)
    if align == "rigid":
        T_reference_estimate = _fit(x[:, :2], x_reference[:, :2])
    elif align == "origin":
        T_reference_estimate = T_true[0] @ invert(T[0])
    elif align is None:
        T_reference_estimate = np.eye(3)
    else:
        raise InvalidParameterError(
            f'must be "rigid", "origin" or None, got {align!r}', parameter="align"
        )
    translation, angle = pose_differences(T_true, T_reference_estimate @ T)
    return AbsoluteErrors(
        translation_errors=translation,
        rotation_errors=angle,
        T_reference_estimate=T_reference_estimate,
    )


def _fit(p: FloatArray, q: FloatArray) -> FloatArray:
    """The rigid transform that moves positions p onto q, by least squares (section 3)."""
    try:
        return align(p, q)
    except DegenerateAlignmentError as error:
        raise DegenerateAlignmentError(
            f"the {len(p)} positions leave the rotation undetermined (a trajectory that stays "
            f'in its place?); use align="origin"'
        ) from error
