"""The robust ICP loop (section 4 of the lesson), its stages in the flow chart's order."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from labkit.alignment import align
from labkit.arrays import FloatArray, as_points, as_transform
from labkit.correspondences import (
    MIN_PAIRS,
    distance_gate,
    huber_loss,
    huber_weights,
    overlap,
)
from labkit.errors import DegenerateAlignmentError
from labkit.line_alignment import align_to_lines
from labkit.registration import (
    Correspondences,
    IcpParameters,
    IcpResult,
    Iteration,
    Termination,
)
from labkit.scan import Scan, as_scan
from labkit.se2 import apply, from_xytheta, to_xytheta, wrap
from labkit.target import Target, as_target

DEFAULTS = IcpParameters()


def icp(
    source: Scan | ArrayLike,
    target: Target | Scan | ArrayLike,
    T_init: ArrayLike | None = None,
    parameters: IcpParameters = DEFAULTS,
) -> IcpResult:
    """Estimate the transform that maps the newer scan onto the older one.

    Parameters
    ----------
    source : Scan or array_like, shape (N, 2)
        The newer scan, k+1, in metres.
    target : Target, Scan or array_like, shape (M, 2)
        The older scan, k. Prepare a `Target` to match several sources against it.
    T_init : array_like, shape (3, 3), optional
        Initial guess of ``T_target_source`` (wheels, IMU); the identity by default.
    parameters : IcpParameters
        Gate, overlap, Huber delta, budget, tolerances and metric.

    Returns
    -------
    IcpResult
        With ``T_target_source``, how the run ended, and its whole history.

    Raises
    ------
    InvalidPointsError
        For an empty scan, a wrong shape, or points that are not finite.

    Notes
    -----
    The cost is a mean over all N source points, so its denominator never changes:

        J = 1/N Σ ρ_δ(min(r, d_max))  over the ⌊ρN⌋ closest pairs               (4.4)

    with Huber's loss ρ_δ. No stage can raise it under the point-to-point metric: a step
    lowers the loss of the kept pairs, a new association lowers every distance, and a pair
    outside the gate counts as if it stood on it.

    Examples
    --------
    >>> import numpy as np, labkit
    >>> target = np.random.default_rng(0).uniform(0, 5, (100, 2))
    >>> T_target_source = labkit.transform(0.05, -0.02, 0.01)
    >>> source = labkit.apply(labkit.invert(T_target_source), target)
    >>> result = labkit.icp(source, target)
    >>> bool(np.allclose(result.T_target_source, T_target_source)), result.inlier_count
    (True, 85)
    """
    points = as_points(as_scan(source).points, "source")
    target = as_target(target)
    T = np.eye(3) if T_init is None else as_transform(T_init, "T_init")

    pairs, cost = associate(points, target, T, parameters)  # D, E
    history = [_record(T, T, pairs, cost)]
    termination = check_pairs(pairs)
    while termination is None:
        try:
            dT = minimise(points, target, T, pairs, parameters)  # F
        except DegenerateAlignmentError:
            termination = Termination.DEGENERATE
            break
        T, T_before = dT @ T, T  # G: the update composes on the left
        pairs, cost = associate(points, target, T, parameters)  # D, E
        history.append(_record(T, T_before, pairs, cost))
        termination = check_pairs(pairs) or check_convergence(history, parameters)  # H
    return IcpResult(  # I
        T_target_source=np.full((3, 3), np.nan) if termination.failed else T,
        termination=termination,
        correspondences=pairs,
        cost=cost,
        history=tuple(history),
    )


def associate(
    source: FloatArray, target: Target, T: FloatArray, parameters: IcpParameters
) -> tuple[Correspondences, float]:
    """Match, reject and weight at the pose `T`; the cost (4.4) of what remains."""
    moved = apply(T, source)
    index, distances = target.search.query(moved)
    if parameters.metric == "point_to_point":
        residuals = distances
    else:
        offset = moved - target.points[index]
        residuals = np.abs((target.normals[index] * offset).sum(axis=1))
    gate = parameters.max_correspondence_distance
    within_gate = distance_gate(distances, gate)
    within_overlap = overlap(distances, parameters.overlap_ratio)
    usable = within_gate & np.isfinite(residuals)
    kept = usable & within_overlap
    weights = np.where(kept, huber_weights(residuals, parameters.huber_delta), 0.0)
    charged = np.where(usable, residuals, np.minimum(distances, gate))[within_overlap]
    cost = huber_loss(charged, parameters.huber_delta).sum() / len(source)
    pairs = Correspondences(
        target_index=index,
        distances=distances,
        residuals=residuals,
        within_gate=within_gate,
        within_overlap=within_overlap,
        kept=kept,
        weights=weights,
    )
    return pairs, float(cost)


def minimise(
    source: FloatArray,
    target: Target,
    T: FloatArray,
    pairs: Correspondences,
    parameters: IcpParameters,
) -> FloatArray:
    """The step dT that best moves the kept pairs together under the metric."""
    kept = pairs.kept
    index = pairs.target_index[kept]
    p, q, w = apply(T, source[kept]), target.points[index], pairs.weights[kept]
    if parameters.metric == "point_to_point":
        dT = align(p, q, w)
    else:
        dT = align_to_lines(p, q, target.normals[index], w)
    if parameters.step_fraction < 1.0:
        dT = from_xytheta(parameters.step_fraction * to_xytheta(dT))
    return dT


def check_pairs(pairs: Correspondences) -> Termination | None:
    """Why no step can come from `pairs`; None where one can."""
    if pairs.inlier_count >= MIN_PAIRS:
        return None
    if (pairs.within_gate & pairs.within_overlap).sum() >= MIN_PAIRS:
        return Termination.DEGENERATE  # matched, but to points that lie on no surface
    return Termination.TOO_FEW_CORRESPONDENCES


def check_convergence(history: list[Iteration], parameters: IcpParameters) -> Termination | None:
    """Whether to stop after ``history[-1]``, and why; None to go on.

    The two pose tests hold together: a scan that turns about its own centre has Δt ≈ 0
    from the first step on, and under "any of them" it would stop there.
    """
    before, now = history[-2:]
    if (
        now.translation_step < parameters.translation_tolerance
        and now.rotation_step < parameters.rotation_tolerance
    ):
        return Termination.CONVERGED_POSE
    if abs(now.cost - before.cost) < parameters.cost_tolerance:
        return Termination.CONVERGED_COST
    if len(history) > parameters.max_iterations:
        return Termination.BUDGET_SPENT
    return None


def _record(T: FloatArray, T_before: FloatArray, pairs: Correspondences, cost: float) -> Iteration:
    first = T is T_before
    turned = math.atan2(T[1, 0], T[0, 0]) - math.atan2(T_before[1, 0], T_before[0, 0])
    return Iteration(
        T_target_source=T,
        translation_step=math.nan if first else math.hypot(*(T - T_before)[:2, 2]),
        rotation_step=math.nan if first else abs(float(wrap(turned))),
        cost=cost,
        inlier_count=pairs.inlier_count,
        inlier_rmse=pairs.inlier_rmse,
    )
