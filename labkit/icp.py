"""The robust ICP loop (section 4 of the lesson), its stages in the flow chart's order."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from labkit.alignment import align
from labkit.approach import is_far, settings_of
from labkit.arrays import FloatArray, as_transform, check_kind
from labkit.correspondences import MIN_PAIRS, Correspondences, associate, reject_and_weigh
from labkit.engine import is_available
from labkit.errors import DegenerateAlignmentError, InvalidParameterError
from labkit.line_alignment import align_to_lines
from labkit.parameters import IcpParameters
from labkit.result import IcpResult, Iteration, Termination, step_length
from labkit.scan import Scan, as_scan
from labkit.se2 import compose, from_xytheta, to_xytheta, transform
from labkit.target import Target, as_target

Engine = Literal["auto", "textbook", "compiled"]
ENGINES = get_args(Engine)
DEFAULTS = IcpParameters()


def icp(
    source: Scan | ArrayLike,
    target: Target | Scan | ArrayLike,
    T_init: ArrayLike | None = None,
    parameters: IcpParameters = DEFAULTS,
    *,
    engine: Engine = "auto",
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
    engine : {"auto", "textbook", "compiled"}
        What runs the loop: the functions of this module, or `labkit.engine`, which is the
        same algorithm compiled. "auto" takes the engine if numba is installed.

    Returns
    -------
    IcpResult
        With ``T_target_source``, how the run ended, and its whole history.

    Raises
    ------
    InvalidPointsError
        For an empty scan, a wrong shape, or points that are not finite.
    InvalidParameterError
        For parameters of another type, or an engine that is not there.

    Notes
    -----
    The cost is a mean over all N source points, so its denominator never changes:

        J = 1/N Σ h_δ(min(r, d_max))  over the ⌊ρN⌋ closest pairs               (4.1)

    with Huber's loss h_δ. No stage can raise it under the point-to-point metric: a step
    lowers the loss of the kept pairs, a new association lowers every distance, and a pair
    outside the gate counts as if it lay at the gate. With ``approach=True``, δ, d_max and N
    change between iterations, so costs far from the answer and near it do not compare.

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
    source, target = as_scan(source, "source", minimum=1), as_target(target)
    T = np.eye(3) if T_init is None else as_transform(T_init, "T_init")
    if compiled(engine):
        from labkit.engine import match  # noqa: PLC0415 (nobody else waits for numba)

        return match(source, target, T, parameters)
    return run(source, target, T, parameters)


def compiled(engine: Engine) -> bool:
    """Whether `engine` asks for `labkit.engine`, as the caller wishes or as numba is there."""
    if engine not in ENGINES:
        raise InvalidParameterError(
            f"must be one of {', '.join(ENGINES)}, got {engine!r}", parameter="engine"
        )
    if engine == "textbook":
        return False
    if engine == "compiled" and not is_available():
        raise InvalidParameterError(
            '"compiled" needs numba, which is not installed: pip install numba, or take "textbook"',
            parameter="engine",
        )
    return is_available()


def run(source: Scan, target: Target, T: FloatArray, parameters: IcpParameters) -> IcpResult:
    """The loop, from the guess T; the letters are the boxes of the flow chart."""
    poses, history, far = [T], list[Iteration](), parameters.approach
    while True:
        settings = settings_of(parameters, len(source), far=far)
        pairs = associate(source.points, target, T, settings)  # D
        pairs = reject_and_weigh(pairs, settings)  # E
        history.append(iteration(T, pairs, history, far=far))
        termination = check(history, parameters)  # H
        if termination is not None:
            break
        try:
            dT = minimise(pairs, parameters.step_fraction)  # F
        except DegenerateAlignmentError:
            termination = Termination.DEGENERATE
            break
        T = dT @ T  # G: the update composes on the left
        poses.append(T)
        far = far and is_far(source.points, poses, parameters.huber_delta)
    return IcpResult.of_history(history, termination, source, target, parameters)  # I


def iteration(
    T: FloatArray, pairs: Correspondences, history: list[Iteration], *, far: bool
) -> Iteration:
    """The record of the pose T and its pairs, after those of `history`."""
    if not history:
        return Iteration(T_target_source=T, correspondences=pairs, far=far)
    moved, turned = step_length(history[-1].T_target_source, T)
    return Iteration(
        T_target_source=T,
        correspondences=pairs,
        translation_step=moved,
        rotation_step=turned,
        far=far,
    )


def minimise(pairs: Correspondences, step_fraction: float = 1.0) -> FloatArray:
    """The step dT that best moves the kept pairs together under their metric: box F.

    Raises
    ------
    DegenerateAlignmentError
        Where the pairs leave the motion undetermined.
    """
    p, q, w = (each[pairs.kept] for each in (pairs.source, pairs.target, pairs.weights))
    if pairs.normals is None:
        dT = align(p, q, w)
    else:
        dT = align_to_lines(p, q, pairs.normals[pairs.kept], w, pairs.point_share)
    return dT if step_fraction == 1.0 else shorten(dT, p, step_fraction)


def shorten(dT: FloatArray, points: FloatArray, fraction: float) -> FloatArray:
    """The same motion, seen from the points' centroid, but less far."""
    x, y = points.mean(axis=0)
    T_center = transform(-x, -y, 0.0)
    T_back = transform(x, y, 0.0)
    motion = to_xytheta(compose(T_center, dT, T_back))
    return compose(T_back, from_xytheta(fraction * motion), T_center)


def check(history: list[Iteration], parameters: IcpParameters) -> Termination | None:
    """Whether to stop after ``history[-1]``, and why; None to go on: box H.

    The pose tests come first, since they need no pairs.
    """
    termination = check_convergence(history, parameters)
    if termination is Termination.CONVERGED_POSE:
        return termination
    return check_pairs(history[-1].correspondences) or termination


def check_pairs(pairs: Correspondences) -> Termination | None:
    """Why no step can come from `pairs`; None where one can."""
    if pairs.inlier_count >= MIN_PAIRS:
        return None
    if (pairs.within_gate & pairs.within_overlap).sum() >= MIN_PAIRS:
        return Termination.DEGENERATE  # matched, but to points that lie on no surface
    return Termination.TOO_FEW_CORRESPONDENCES


def check_convergence(history: list[Iteration], parameters: IcpParameters) -> Termination | None:
    """Whether the last step was short enough, or the budget is spent.

    The two pose tests hold together: a scan that turns about its own centre has Δt ≈ 0
    from the first step on, and under "any of them" it would stop there. The run never
    stops as converged right after a step of the far phase, however short.
    """
    if len(history) > 1 and not history[-2].far:
        before, now = history[-2:]
        if (
            now.translation_step < parameters.translation_tolerance
            and now.rotation_step < parameters.rotation_tolerance
        ):
            return Termination.CONVERGED_POSE
        if abs(now.cost - before.cost) < parameters.cost_tolerance:
            return Termination.CONVERGED_COST
    return Termination.BUDGET_SPENT if len(history) > parameters.max_iterations else None
