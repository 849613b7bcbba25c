"""Errors of a trajectory against a reference: absolute, and relative over a stretch of the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from labkit import alignment
from labkit.evaluation.pose_errors import PoseErrors, as_trajectories, pose_differences
from labkit.se2 import invert, matrices_of, relative
from labkit.support.arrays import (
    MAX_DISTANCE,
    FloatArray,
    IntArray,
    check_choice,
    check_count,
    check_kind,
    check_range,
)
from labkit.support.errors import DegenerateAlignmentError

MAX_STEPS = 1_000_000_000  # in a stretch


def ate(
    estimate: ArrayLike, reference: ArrayLike, align: Literal["rigid", "origin"] | None = "rigid"
) -> PoseErrors:
    """Absolute trajectory error [1]_, one per pose.

    The start of an odometry is arbitrary, so the estimate is first moved onto the reference,
    as one rigid body. One wrong turn early on spoils every pose after it; `rpe` measures drift.

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
    check_choice(align, "align", "rigid", "origin", None)
    rows, rows_reference = as_trajectories(estimate, reference)
    T_estimate = matrices_of(rows)
    T_reference = matrices_of(rows_reference)
    T_reference_estimate = np.eye(3)
    if align == "rigid":
        try:
            T_reference_estimate = alignment.align(rows[:, :2], rows_reference[:, :2])
        except DegenerateAlignmentError as error:
            raise DegenerateAlignmentError(
                f"the {len(rows)} positions leave the rotation undetermined (a trajectory that "
                f'stays in its place?); use align="origin"'
            ) from error
    elif align == "origin":
        T_reference_estimate = T_reference[0] @ invert(T_estimate[0])
    return PoseErrors(*pose_differences(T_reference, T_reference_estimate @ T_estimate))


def rpe(
    estimate: ArrayLike,
    reference: ArrayLike,
    delta: float = 1,
    unit: Literal["steps", "metres"] = "steps",
) -> PoseErrors:
    """Relative pose error (Sturm et al., IROS 2012), one per stretch of a given length.

    The error of the stretch from i to j is that of the estimate's ``T_i_j`` against the
    reference's, without alignment: a mistake is counted where it is made.

    Parameters
    ----------
    estimate, reference : array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]); row k of one belongs to row k of the other.
    delta : float
        Length of a stretch: a whole number of steps, or metres of the reference's path.
    unit : {"steps", "metres"}
        With "steps", every i is paired with i + delta. With "metres", every i is paired
        with the later pose whose distance along the path is nearest to delta, within a tenth.

    Returns
    -------
    PoseErrors
        With the `pairs` of poses that bound each stretch; of a trajectory that is too short, none.

    Notes
    -----
    Stretches overlap, and the reference's path measures them; `evo` selects the same pairs with
    ``all_pairs=True, pairs_from_reference=True``.

    Examples
    --------
    >>> reference = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    >>> estimate = [[0, 0, 0], [1, 0, 0], [2.5, 0, 0]]
    >>> rpe(estimate, reference)
    PoseErrors(2 errors: RMSE 0.354 m, 0 rad)
    >>> rpe(estimate, reference).translation_errors.tolist()
    [0.0, 0.5]
    """
    check_choice(unit, "unit", "steps", "metres")
    rows, rows_reference = as_trajectories(estimate, reference)
    if unit == "steps":
        check_count(delta, "delta", at_least=1, at_most=MAX_STEPS)
        start = np.arange(len(rows) - int(delta))
        pairs = np.column_stack([start, start + int(delta)])
    else:
        check_range(delta, "delta", above=0.0, at_most=MAX_DISTANCE, unit="m")
        pairs = _pairs_by_path(rows_reference, float(delta))
    T_estimate = matrices_of(rows)
    T_reference = matrices_of(rows_reference)
    i, j = pairs.T
    true_motions = relative(T_reference[i], T_reference[j])
    estimated_motions = relative(T_estimate[i], T_estimate[j])
    return PoseErrors(*pose_differences(true_motions, estimated_motions), pairs)


def compare(
    trajectories: Mapping[str, ArrayLike], reference: ArrayLike, stretch: float = 10.0
) -> dict[str, PoseErrors]:
    """Errors of trajectories against a reference: per step, over a stretch, and absolute.

    Parameters
    ----------
    trajectories : mapping of str to array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]) by the name of the method that estimated them.
    reference : array_like, shape (K, 3)
        The same instants.
    stretch : float
        Metres of the errors over a stretch.

    Examples
    --------
    >>> wheels, truth = [[0, 0, 0], [0.9, 0, 0]], [[0, 0, 0], [1, 0, 0]]
    >>> errors = compare({"wheels": wheels}, truth)
    >>> list(errors), round(errors["wheels, RPE a step"].translation.max, 3)
    (['wheels, RPE a step', 'wheels, RPE over 10 m', 'wheels, ATE'], 0.1)
    """
    check_kind(trajectories, "trajectories", Mapping)
    check_range(stretch, "stretch", above=0.0, at_most=MAX_DISTANCE, unit="m")
    over_steps, over_stretches, absolute = {}, {}, {}
    for name, poses in trajectories.items():
        over_steps[f"{name}, RPE a step"] = rpe(poses, reference)
        over_stretches[f"{name}, RPE over {stretch:g} m"] = rpe(poses, reference, stretch, "metres")
        try:
            absolute[f"{name}, ATE"] = ate(poses, reference)
        except DegenerateAlignmentError:  # the robot never moved
            absolute[f"{name}, ATE, first poses aligned"] = ate(poses, reference, align="origin")
    return over_steps | over_stretches | absolute


def _pairs_by_path(poses: FloatArray, delta: float) -> IntArray:
    """Pairs (i, j), `delta` metres of path apart within a tenth: for each i the nearest j > i."""
    steps = np.diff(poses[:, :2], axis=0)
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
    pairs = []
    for i in range(len(poses) - 1):
        difference = np.abs(travelled[i + 1 :] - travelled[i] - delta)
        nearest = int(np.argmin(difference))
        if difference[nearest] <= 0.1 * delta:
            pairs.append((i, i + 1 + nearest))
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)
