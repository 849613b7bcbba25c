"""One step of odometry: match, check, and fall back in a stated order (section 5).

1. ICP from the prior, or from the last motion where there is none.
2. Where a sanity check fails: ICP once more, with a reduced gate and reduced steps.
3. Where that fails too: the prior.
4. Without a prior: skip the update, that is hold the last motion, or stand still where
   there is none to hold (a motion is held once) or `on_skip` says so.

A step depends on nothing but its arguments. Against the scan before it, steps with a prior
may so run in any order.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from labkit.arrays import FloatArray
from labkit.correspondences import MIN_PAIRS
from labkit.degeneracy import spread_ratio
from labkit.icp import icp
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.sanity import motion_complaints, quality_complaints
from labkit.parameters import IcpParameters
from labkit.scan import Scan
from labkit.se2 import from_xytheta, invert, to_xytheta
from labkit.target import Target

STILL = np.zeros(3)
AT_TARGET = np.eye(3)


def estimate_step(
    source: Scan,
    target: Target | None,
    prior: FloatArray | None,
    last_motion: FloatArray,
    parameters: OdometryParameters,
    *,
    T_target_last: FloatArray = AT_TARGET,
) -> StepRecord:
    """Estimate the motion from scan k (`target`) to scan k+1 (`source`).

    Parameters
    ----------
    source : Scan
        The newer scan, filtered already.
    target : Target or None
        The older one; None where it had no points.
    prior : ndarray, shape (3,), or None
        Expected increment from wheels or an IMU.
    last_motion : ndarray, shape (3,)
        The increment of the step before: guess and last resort without a prior.
    T_target_last : ndarray, shape (3, 3)
        Where scan k was taken in the target's frame; the identity where it is the target.
    parameters : OdometryParameters
        Matcher, limits and fallbacks.

    Returns
    -------
    StepRecord
    """
    skipped = last_motion if parameters.on_skip == "hold" else STILL
    guess = skipped if prior is None else prior
    if prior is not None:
        last_resort = Decision.PRIOR
    else:
        last_resort = Decision.HOLD if skipped.any() else Decision.STAND
    if target is None or len(source) < MIN_PAIRS:
        which = "older" if target is None else "newer"
        reason = f"the {which} scan has fewer than {MIN_PAIRS} points"
        return StepRecord(increment=guess, decision=last_resort, reason=reason)

    reasons: list[str] = []
    for decision in (Decision.ICP, Decision.RETRY):
        matcher = parameters.icp if decision is Decision.ICP else parameters.retry
        record, complaints = _attempt(
            source,
            target,
            T_target_last,
            guess=guess,
            prior=prior,
            matcher=matcher,
            parameters=parameters,
        )
        if not complaints:
            reason = "; ".join(reasons)
            return replace(record, decision=decision, reason=reason) if reasons else record
        reasons.append(f"{decision.value}: {', '.join(complaints)}")
    return replace(record, increment=guess, decision=last_resort, reason="; ".join(reasons))


def _seen_from_the_end(increment: FloatArray) -> FloatArray:
    """The motion (Δx, Δy) in the frame of scan k+1, as the newer scan sees it."""
    x, y, turn = increment.tolist()
    c, s = math.cos(turn), math.sin(turn)
    return np.array([c * x + s * y, c * y - s * x])


def _attempt(
    source: Scan,
    target: Target,
    T_target_last: FloatArray,
    *,
    guess: FloatArray,
    prior: FloatArray | None,
    matcher: IcpParameters,
    parameters: OdometryParameters,
) -> tuple[StepRecord, list[str]]:
    """Match once; the record of it, and every sanity check that it fails."""
    limits, T_guess = parameters.limits, T_target_last @ from_xytheta(guess)
    result = icp(source, target, T_guess, matcher, engine=parameters.engine)
    increment = to_xytheta(invert(T_target_last) @ result.T_target_source)
    fitness, rmse = result.fitness, result.inlier_rmse
    information, degenerate = math.nan, False
    if result.termination.failed:
        complaints = [result.message]
    else:
        seen = result.observability
        information = 0.0 if seen is None else float(seen.values[0])
        degenerate = information < limits.min_information
        complaints = motion_complaints(increment, prior, limits)
        complaints += quality_complaints(fitness, rmse, limits)
    free_part_from_prior = prior is not None and matcher.metric == "point_to_line"
    if degenerate and not free_part_from_prior:
        complaints.append(
            f"degenerate: information {information:.3f} < {limits.min_information:.3f}"
        )
    record = StepRecord(
        increment=increment,
        decision=Decision.ICP,
        inlier_count=result.inlier_count,
        inlier_ratio=fitness,
        rmse=rmse,
        rotation=abs(float(increment[2])),
        information=information,
        spread=spread_ratio(source, _seen_from_the_end(increment)),
        iterations=result.iterations,
        degenerate=degenerate,
        termination=result.termination,
    )
    return record, complaints
