"""The robust ICP loop (section 4 of the lesson), its stages in the flow chart's order."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from labkit.alignment import align
from labkit.approach import close_gate, extent, is_far, motion_of, point_share, thinning, wide_delta
from labkit.arrays import (
    FloatArray,
    IntArray,
    as_transform,
    check_kind,
    homogeneous,
    lengths,
    take_rows,
)
from labkit.correspondences import (
    FROM_LINE,
    MIN_PAIRS,
    OFFSET,
    ORIGIN,
    Correspondences,
    huber_weights,
    keep,
    point_rows,
)
from labkit.errors import DegenerateAlignmentError
from labkit.line_alignment import line_rows, line_step, normal_equations
from labkit.registration import IcpParameters, IcpResult, Iteration, Termination
from labkit.scan import Scan, as_scan
from labkit.se2 import compose, from_xytheta, to_xytheta, transform
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
    InvalidParameterError
        For `parameters` of another class.

    Notes
    -----
    The cost is a mean over all N source points, so its denominator never changes:

        J = 1/N Σ ρ_δ(min(r, d_max))  over the ⌊ρN⌋ closest pairs               (4.4)

    with Huber's loss ρ_δ. No stage can raise it under the point-to-point metric: a step
    lowers the loss of the kept pairs, a new association lowers every distance, and a pair
    outside the gate counts as if it stood on it. With ``approach=True``, δ, d_max
    and N are those of the iteration: costs far from the answer and near it are of two kinds.

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
    check_kind(parameters, "parameters", IcpParameters)
    columns = homogeneous(as_scan(source, "source", minimum=1).points)
    target = as_target(target)
    T = np.eye(3) if T_init is None else as_transform(T_init, "T_init")

    far, size, motion = parameters.approach, extent(columns), 0.0
    match = partial(_associate, columns, target, parameters)
    now = Iteration(T_target_source=T, associate=partial(match, T, far=far), far=far)  # D, E
    history = [now]
    termination = check_pairs(now.correspondences)
    while termination is None:
        try:
            dT = minimise(now.correspondences, parameters)  # F
        except DegenerateAlignmentError:
            termination = Termination.DEGENERATE
            break
        T, T_before = dT @ T, T  # G: the update composes on the left
        if far:
            motion, motion_before = motion_of(size, T_before, T), motion
            far = is_far(motion, motion_before, parameters.huber_delta)
        moved, turned = step_length(T_before, T)
        now = Iteration(
            T_target_source=T,
            # D, E, when somebody asks
            associate=partial(match, T, far=far, before=now.correspondences.target_index),
            translation_step=moved,
            rotation_step=turned,
            far=far,
        )
        history.append(now)
        termination = check_convergence(history, parameters)  # H
        if termination is not Termination.CONVERGED_POSE:
            termination = check_pairs(now.correspondences) or termination
    return IcpResult(  # I
        T_target_source=np.full((3, 3), np.nan) if termination.failed else T,
        termination=termination,
        history=tuple(history),
        target=target,
    )


def associate(
    source: FloatArray,
    target: Target,
    T: FloatArray,
    parameters: IcpParameters,
    *,
    far: bool = False,
) -> Correspondences:
    """Match, reject and weight at the pose `T`, `far` from the answer or near it."""
    return _associate(homogeneous(source), target, parameters, T, far=far)


def _associate(
    source: FloatArray,
    target: Target,
    parameters: IcpParameters,
    T: FloatArray,
    *,
    far: bool,
    before: IntArray | None = None,
) -> Correspondences:
    """Match, reject and weight `homogeneous` columns, which may have had partners `before`."""
    gate, delta, share = parameters.max_correspondence_distance, parameters.huber_delta, 0.0
    every = thinning(source.shape[1]) if far else 1
    if parameters.approach and not far:
        gate = close_gate(gate, delta)
    source = source[:, ::every]
    moved = (T - target.to_center) @ source
    index = target.search.nearest_to_columns(moved, before)
    on_lines = parameters.metric == "point_to_line"
    if on_lines:
        rows, center = line_rows(moved, target.surface.take(index, axis=1)), target.center
    else:  # where they are, so that points which coincide are 0 m apart
        rows, center = point_rows(T @ source, target.points.T.take(index, axis=1)), ORIGIN
    distances = lengths(rows[OFFSET])
    kept = keep(distances, gate, parameters.overlap_ratio)
    residuals = distances
    if on_lines:
        kept &= target.on_line.take(index)
        residuals = np.abs(rows[FROM_LINE])
    if far:
        delta = wide_delta(residuals[kept], delta)
        share = point_share(delta, parameters.huber_delta)
    return Correspondences(
        rows=rows,
        every=every,
        center=center,
        target_points=target.points,
        target_index=index,
        distances=distances,
        kept=kept,
        weights=huber_weights(residuals, delta) * kept,
        gate=gate,
        overlap_ratio=parameters.overlap_ratio,
        huber_delta=delta,
        point_share=share,
    )


def minimise(pairs: Correspondences, parameters: IcpParameters) -> FloatArray:
    """The step dT that best moves the kept pairs together under the metric."""
    if not pairs.on_lines:
        kept = np.flatnonzero(pairs.kept)
        p, q = take_rows(pairs.source, kept), take_rows(pairs.target, kept)
        dT = align(p, q, pairs.weights[kept])
    else:  # a pair that was rejected has no weight
        dT = line_step(normal_equations(pairs.rows, pairs.weights, pairs.center, pairs.point_share))
    if parameters.step_fraction < 1.0:
        dT = _shorten(dT, pairs.source[pairs.kept], parameters.step_fraction)
    return dT


def _shorten(dT: FloatArray, points: FloatArray, fraction: float) -> FloatArray:
    """The same motion, seen from the points' centroid, but less far."""
    x, y = points.mean(axis=0).tolist()
    to_center, back = transform(-x, -y, 0.0), transform(x, y, 0.0)
    return compose(back, from_xytheta(fraction * to_xytheta(to_center @ dT @ back)), to_center)


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
    from the first step on, and under "any of them" it would stop there. A step that set
    out far from the answer is none to stop after, however short.
    """
    before, now = history[-2:]
    if before.far:
        return Termination.BUDGET_SPENT if len(history) > parameters.max_iterations else None
    if (
        now.translation_step < parameters.translation_tolerance
        and now.rotation_step < parameters.rotation_tolerance
    ):
        return Termination.CONVERGED_POSE
    if parameters.cost_tolerance > 0.0 and abs(now.cost - before.cost) < parameters.cost_tolerance:
        return Termination.CONVERGED_COST
    if len(history) > parameters.max_iterations:
        return Termination.BUDGET_SPENT
    return None


def step_length(T_before: FloatArray, T: FloatArray) -> tuple[float, float]:
    """How far a pose moved, |Δt| [m], and turned, |Δψ| [rad]."""
    (c, _, x), (s, _, y), _ = T.tolist()
    (c_before, _, x_before), (s_before, _, y_before), _ = T_before.tolist()
    turned = math.atan2(c_before * s - s_before * c, c_before * c + s_before * s)
    return math.hypot(x - x_before, y - y_before), abs(turned)
