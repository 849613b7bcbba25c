"""The errors of trajectories under the names that a table gives them."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import ArrayLike

from labkit.errors import DegenerateAlignmentError
from labkit.evaluation.absolute import ate
from labkit.evaluation.pose_errors import PoseErrors
from labkit.evaluation.relative import rpe


def compare(
    trajectories: Mapping[str, ArrayLike], reference: ArrayLike, stretch: float = 10.0
) -> dict[str, PoseErrors]:
    """Errors of trajectories against a reference: per step, over a stretch, and absolute.

    Parameters
    ----------
    trajectories : mapping of str to array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]) by the name of what estimated them.
    reference : array_like, shape (K, 3)
        The same instants.
    stretch : float
        Metres of the errors over a stretch.

    Returns
    -------
    dict of str to PoseErrors
        Each by its name and the trajectory's; one kind of error after the other.

    Examples
    --------
    >>> wheels, truth = [[0, 0, 0], [0.9, 0, 0]], [[0, 0, 0], [1, 0, 0]]
    >>> errors = compare({"wheels": wheels}, truth)
    >>> list(errors), round(errors["wheels, RPE a step"].translation.max, 3)
    (['wheels, RPE a step', 'wheels, RPE over 10 m', 'wheels, ATE'], 0.1)
    """
    steps, stretches, absolute = {}, {}, {}
    for name, poses in trajectories.items():
        steps[f"{name}, RPE a step"] = rpe(poses, reference)
        over = rpe(poses, reference, stretch, "metres")
        stretches[f"{name}, RPE over {stretch:g} m"] = over
        kind, errors = absolute_errors(poses, reference)
        absolute[f"{name}, {kind}"] = errors
    return steps | stretches | absolute


def absolute_errors(estimate: ArrayLike, reference: ArrayLike) -> tuple[str, PoseErrors]:
    """The ATE, under a name that says so if there is no best rigid alignment.

    Parameters
    ----------
    estimate, reference : array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]); row k of one belongs to row k of the other.

    Returns
    -------
    str, PoseErrors
        "ATE" after rigid alignment; "ATE, first poses aligned" for a robot that stays in
        its place.

    Examples
    --------
    >>> name, errors = absolute_errors([[0, 0, 0], [0, 0, 0.1]], [[5, 5, 0], [5, 5, 0.2]])
    >>> name, round(errors.rotation.max, 3)
    ('ATE, first poses aligned', 0.1)
    """
    try:
        return "ATE", ate(estimate, reference)
    except DegenerateAlignmentError:
        return "ATE, first poses aligned", ate(estimate, reference, align="origin")
