"""The robust ICP loop (section 4 of the lesson), its stages in the flow chart's order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from labkit.alignment import centroid, closed_form, product, turn_about
from labkit.correspondences import MIN_PAIRS, Correspondences, associate, cost, reject_and_weigh
from labkit.line_alignment import line_step
from labkit.neighbors import Grid, start_search
from labkit.parameters import IcpParameters, adjust
from labkit.result import IcpResult, Termination, step_length
from labkit.scan import Scan, as_scan
from labkit.schedule import Stage, schedule, stage_of
from labkit.se2 import check_headings, transform
from labkit.support.arrays import (
    FloatArray,
    as_floats,
    as_numbers,
    as_transform,
    check_kind,
    check_range,
)
from labkit.support.compiled import compiled
from labkit.target import Target, as_target

DEFAULTS = IcpParameters()


def icp(
    source: Scan | ArrayLike,
    target: Target | Scan | ArrayLike,
    T_init: ArrayLike | None = None,
    parameters: IcpParameters = DEFAULTS,
    **settings: Any,
) -> IcpResult:
    """Estimate the transform that maps the newer scan onto the older one.

    The defaults are the lesson's: point to point, easy to follow, and as exact as the beams are
    close. For your own scans of walls take ``parameters=labkit.ACCURATE``, which is the odometry's
    matcher: a tenth of the error at 180 beams.

    Parameters
    ----------
    source : Scan or array_like, shape (N, 2)
        The newer scan, k+1, in metres.
    target : Target, Scan or array_like, shape (M, 2)
        The older scan, k. Prepare a `Target` to match several sources against it.
    T_init : array_like, shape (3, 3) or (3,), optional
        Initial guess of ``T_target_source`` (wheels, IMU), a transform or x [m], y [m], θ [rad];
        the identity by default.
    parameters : IcpParameters
        Gate, overlap, Huber delta, budget, tolerances and metric.
    **settings
        Single parameters by their names, such as ``metric="point_to_line"``; the others are those
        of `parameters`.

    Returns
    -------
    IcpResult
        With ``T_target_source``, how the run ended, and its whole history.

    Raises
    ------
    InvalidPointsError
        For an empty scan, a wrong shape, or points that are not finite.
    InvalidParameterError
        For parameters of another type or out of range.

    Notes
    -----
    The cost is a mean over all N source points, so its denominator never changes:

        J = 1/N Σ h_δ(min(r, d_max))  over the ⌊ρN⌋ closest pairs               (4.1)

    with Huber's loss h_δ. No stage can raise it under the point-to-point metric: a step
    lowers the loss of the kept pairs, a new association lowers every distance, and a pair
    outside the gate counts as if it lay at the gate. With ``approach=True``, δ, d_max and N
    change between iterations, so the costs of coarse and fine iterations do not compare.

    Examples
    --------
    >>> import numpy as np, labkit
    >>> target = np.random.default_rng(0).uniform(0, 5, (100, 2))
    >>> T_target_source = labkit.transform(0.05, -0.02, 0.01)
    >>> source = labkit.apply(labkit.invert(T_target_source), target)
    >>> result = labkit.icp(source, target)
    >>> bool(np.allclose(result.T_target_source, T_target_source)), result.inlier_count
    (True, 85)
    >>> labkit.icp(source, target, (0.05, -0.02, 0.01), overlap_ratio=1.0).inlier_count
    100
    """
    parameters = adjust(parameters, settings)
    source = as_scan(source, "source", minimum=1)
    target = as_target(target)
    T = np.eye(3) if T_init is None else _as_guess(T_init)
    normals = target.normals_for(parameters)
    poses, coarse_poses, termination = run(
        source.points, target.search.grid, normals, T, parameters
    )
    return IcpResult(
        poses=poses,
        coarse_poses=coarse_poses,
        termination=termination,
        source=source,
        target=target,
        parameters=parameters,
    )


def _as_guess(T_init: ArrayLike) -> FloatArray:
    """Check a guess, a transform or (x, y, θ): the transform (3, 3)."""
    hint = "give a transform (3, 3), or x [m], y [m], theta [rad]"
    guess = as_floats(T_init, "T_init", hint)
    if guess.shape != (3,):
        return as_transform(guess, "T_init")
    check_headings(as_numbers(guess, "T_init")[2:], "T_init")
    return transform(*guess)


@compiled
def run(
    source: FloatArray,
    target: Grid,
    normals: FloatArray,
    T_init: FloatArray,
    parameters: IcpParameters,
) -> tuple[FloatArray, int, Termination]:
    """The loop: its poses, how many of them are coarse, its ending. The letters name boxes."""
    search = start_search(target, len(source))
    stage = stage_of(parameters, len(source), parameters.approach, 0)
    poses = [T_init]
    costs = [math.inf]
    while True:
        gate = stage.max_correspondence_distance
        nearest = associate(source[:: stage.stride], search, poses[-1], gate)  # D
        pairs = reject_and_weigh(*nearest, target.points, normals, stage)  # E
        costs.append(cost(pairs))
        termination = check(poses, costs, pairs, stage, parameters)  # H
        if termination is None:
            dT, termination = compute_step(pairs, parameters.step_fraction)  # F
        if termination is not None:
            return as_array(poses), stage.coarse_poses, termination  # I
        poses.append(product(dT, poses[-1]))  # G: dT @ T, the update composes on the left
        stage = schedule(stage, poses, source, parameters)


@compiled
def compute_step(
    pairs: Correspondences, step_fraction: float
) -> tuple[FloatArray, Termination | None]:
    """(F) The step dT, (3, 3), that best moves the kept pairs together; an ending if none does."""
    if len(pairs.normals) > 0:
        dT = line_step(pairs.source, pairs.target, pairs.normals, pairs.weights, pairs.point_share)
    else:
        dT = closed_form(pairs.source, pairs.target, pairs.weights)
    if step_fraction < 1.0:
        dT = shorten(dT, pairs, step_fraction)
    return dT, Termination.DEGENERATE if math.isnan(dT[0, 0]) else None


def minimise(
    pairs: Correspondences, step_fraction: float = 1.0
) -> tuple[FloatArray, Termination | None]:
    """(F) The step dT, (3, 3), that best moves the kept pairs together; an ending if none does.

    `pairs` are those of an iteration or of `labkit.correspondences.pairs_at`; a `step_fraction`
    below 1 shortens the step.
    """
    check_kind(pairs, "pairs", Correspondences)
    fraction = check_range(step_fraction, "step_fraction", above=0.0, at_most=1.0)
    return compute_step(pairs, fraction)


@compiled
def shorten(dT: FloatArray, pairs: Correspondences, fraction: float) -> FloatArray:
    """A `fraction` of the step: of its turn, and of the way of the kept points' centroid."""
    x, y = centroid(pairs.source, np.sign(pairs.weights))  # kept points count alike
    dx = dT[0, 0] * x + dT[0, 1] * y + dT[0, 2] - x
    dy = dT[1, 0] * x + dT[1, 1] * y + dT[1, 2] - y
    theta = math.atan2(dT[1, 0], dT[0, 0])
    return turn_about((x, y), fraction * theta, fraction * dx, fraction * dy)


@compiled
def check(
    poses: list[FloatArray],
    costs: list[float],
    pairs: Correspondences,
    stage: Stage,
    parameters: IcpParameters,
) -> Termination | None:
    """(H) The ending, by the last step, the pairs, the cost and the budget; None to go on."""
    fine_step = len(poses) > stage.coarse_poses + 1  # the last step began in a fine iteration
    if fine_step:
        moved, turned = step_length(poses[-2], poses[-1])
        # A scan that turns about its own centre has Δt ≈ 0, so both parts must be small.
        if moved < parameters.translation_tolerance and turned < parameters.rotation_tolerance:
            return Termination.CONVERGED_POSE
    if pairs.inlier_count < MIN_PAIRS:
        near = pairs.within_overlap & (pairs.distances <= pairs.max_correspondence_distance)
        if near.sum() < MIN_PAIRS:
            return Termination.TOO_FEW_CORRESPONDENCES
        return Termination.DEGENERATE  # enough pairs are near, but on no surface: no normals
    if fine_step and abs(costs[-1] - costs[-2]) < parameters.cost_tolerance:
        return Termination.CONVERGED_COST
    if len(poses) > parameters.max_iterations:
        return Termination.BUDGET_SPENT
    return None


@compiled
def as_array(poses: list[FloatArray]) -> FloatArray:
    """The poses as one array, shape (K, 3, 3)."""
    stack = np.empty((len(poses), 3, 3))
    for k, row, column in np.ndindex(stack.shape):
        stack[k, row, column] = poses[k][row, column]
    return stack
