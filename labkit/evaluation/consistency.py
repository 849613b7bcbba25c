"""Checks of a motion that need no reference: against itself, the prior, and the way back.

None of them proves an estimate right: the notes name the mistakes to which each is blind.
"""

from __future__ import annotations

from numpy.typing import ArrayLike

from labkit.evaluation.pose_errors import (
    PoseErrors,
    as_increments,
    check_lengths,
    pose_differences,
)
from labkit.se2 import compose, invert, matrices_of
from labkit.support.arrays import as_pose


def forward_backward(forward: ArrayLike, backward: ArrayLike) -> PoseErrors:
    """Length [m] and angle [rad] of ``T_forward @ T_backward``, one per row.

    Parameters
    ----------
    forward, backward : array_like, shape (K, 3)
        Rows (Δx [m], Δy [m], Δψ [rad]): the newer scan matched with the older one, and the
        older with the newer, without those that failed.

    Notes
    -----
    Blind to mistakes that both directions share: a corridor, a repeated pattern, a crowd.

    Examples
    --------
    >>> errors = forward_backward([[0.5, 0.0, 0.0]], [[-0.4, 0.0, 0.1]])
    >>> round(errors.translation.max, 3), round(errors.rotation.max, 3)
    (0.1, 0.1)
    """
    there = as_increments(forward, "forward")
    back = as_increments(backward, "backward")
    check_lengths(there, back, "forward", "backward")
    return PoseErrors(*pose_differences(invert(matrices_of(there)), matrices_of(back)))


def disagreement(increments: ArrayLike, prior: ArrayLike) -> PoseErrors:
    """Length [m] and angle [rad] of ``invert(T_prior) @ T``, for a prior or any other source.

    Parameters
    ----------
    increments, prior : array_like, shape (K, 3)
        Rows (Δx [m], Δy [m], Δψ [rad]).

    Notes
    -----
    Blind where the estimate was taken from the prior, as it is along a free direction.

    Examples
    --------
    >>> disagreement([[0.5, 0.0, 0.1]], [[0.5, 0.1, 0.0]]).translation.max
    0.1
    """
    estimated = as_increments(increments, "increments")
    expected = as_increments(prior, "prior")
    check_lengths(estimated, expected, "increments", "prior")
    return PoseErrors(*pose_differences(matrices_of(expected), matrices_of(estimated)))


def loop_closure(increments: ArrayLike, closing: ArrayLike = (0.0, 0.0, 0.0)) -> PoseErrors:
    """Distance by which a path misses its known end.

    Parameters
    ----------
    increments : array_like, shape (K, 3)
        The steps of the path, rows (Δx [m], Δy [m], Δψ [rad]).
    closing : array_like, shape (3,)
        Pose of the last scan in the frame of the first, e.g. by matching the two.

    Notes
    -----
    Blind to errors that cancel on the way back, such as a length that is always 3 % too long.

    Examples
    --------
    >>> round(loop_closure([[1.0, 0.0, 1.5708]] * 4).translation.max, 4)  # a square
    0.0
    """
    T_first_last = compose(*matrices_of(as_increments(increments, "increments")))
    T_expected = matrices_of(as_pose(closing, "closing"))
    return PoseErrors(*pose_differences(T_expected[None], T_first_last[None]))
