"""One step of odometry: match, check, and fall back in a stated order (section 5).

1. ICP from the prior, or from the last motion where there is none.
2. Where a sanity check fails: ICP once more, with a reduced gate and reduced steps.
3. Where that fails too: the prior.
4. Without a prior: skip the update, that is hold the last motion, or stand still where
   there is none to hold (a motion is held once) or `on_skip` says so.

A step depends on nothing but its arguments, so steps with a prior may run in any order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Literal, get_args

import numpy as np

from labkit.arrays import FloatArray, check_kind, check_range
from labkit.correspondences import MIN_PAIRS
from labkit.degeneracy import spread_ratio
from labkit.errors import InvalidParameterError
from labkit.filters import Preprocessing
from labkit.icp import icp
from labkit.odometry.sanity import SanityLimits, motion_complaints, quality_complaints
from labkit.registration import IcpParameters, Termination
from labkit.scan import Scan
from labkit.se2 import from_xytheta, to_xytheta
from labkit.target import Target

OnSkip = Literal["hold", "stand"]
STILL = np.zeros(3)


@dataclass(frozen=True, kw_only=True)
class OdometryParameters:
    """How scans become odometry; checked when it is made.

    Attributes
    ----------
    icp : IcpParameters
        The matcher's parameters.
    limits : SanityLimits
        What a step must pass.
    preprocessing : Preprocessing
        Filters that every scan goes through first.
    retry_gate, retry_step : float
        The retry's share of the gate and of each ICP step, in (0, 1].
    on_skip : {"hold", "stand"}
        Without a match and without a prior: hold the last motion once and then stand
        still, or stand still at once. The same motion is ICP's initial guess where there
        is no prior.
    """

    icp: IcpParameters = field(
        default_factory=lambda: IcpParameters(
            metric="point_to_line",
            overlap_ratio=1.0,
            huber_delta=0.02,
            translation_tolerance=3e-3,
            rotation_tolerance=7.5e-4,
            cost_tolerance=0.0,
            approach=True,
        )
    )
    limits: SanityLimits = field(default_factory=SanityLimits)
    preprocessing: Preprocessing = field(default_factory=Preprocessing)
    retry_gate: float = field(
        default=0.5, metadata={"help": "share of the gate in the second attempt"}
    )
    retry_step: float = field(
        default=0.5, metadata={"help": "share of each step in the second attempt"}
    )
    on_skip: OnSkip = field(
        default="hold",
        metadata={"help": "without match and prior: hold the last motion once, or stand still"},
    )

    def __post_init__(self) -> None:
        check_kind(self.icp, "icp", IcpParameters)
        check_kind(self.limits, "limits", SanityLimits)
        check_kind(self.preprocessing, "preprocessing", Preprocessing)
        check_range(self.retry_gate, "retry_gate", above=0.0, at_most=1.0)
        check_range(self.retry_step, "retry_step", above=0.0, at_most=1.0)
        if self.on_skip not in get_args(OnSkip):
            raise InvalidParameterError(
                f"must be one of {', '.join(get_args(OnSkip))}, got {self.on_skip!r}",
                parameter="on_skip",
            )

    @property
    def retry(self) -> IcpParameters:
        """The matcher's parameters for the second attempt."""
        return replace(
            self.icp,
            max_correspondence_distance=self.retry_gate * self.icp.max_correspondence_distance,
            step_fraction=self.retry_step * self.icp.step_fraction,
        )


class Decision(Enum):
    """Where a step's motion came from; the value is the word for a table.

    HOLD is a motion that was held; where that is no motion at all, the decision is STAND.
    """

    START = "start"
    ICP = "icp"
    RETRY = "retry"
    PRIOR = "prior"
    HOLD = "hold"
    STAND = "stand"

    @property
    def matched(self) -> bool:
        """Whether the motion came from matching the scans."""
        return self in (Decision.ICP, Decision.RETRY)

    @property
    def skipped(self) -> bool:
        """Whether the update was skipped."""
        return self in (Decision.HOLD, Decision.STAND)


@dataclass(frozen=True, eq=False, kw_only=True)
class StepRecord:
    """What one step decided, and on what grounds.

    The numbers are those of the last match that was tried; NaN where there was none.

    Attributes
    ----------
    increment : ndarray, shape (3,)
        (Δx, Δy, Δψ) taken, in the frame of scan k, [m, m, rad].
    decision : Decision
        Where it came from.
    reason : str
        The checks that failed on the way; empty where the first match passed.
    inlier_count, inlier_ratio, rmse, rotation : float
        Kept pairs, their share of the source, their RMSE [m], matched |Δψ| [rad].
    information : float
        Smallest eigenvalue of the information: near 0 where a direction is free.
    degenerate : bool
        Whether it is below the limit. The point-to-line metric leaves a free direction
        at the prior, and the step is then believed; without a prior it is not.
    spread : float
        The lesson's cheap corridor test; see `labkit.degeneracy.spread_ratio`.
    iterations : int
        ICP steps of the last match.
    termination : Termination or None
        How it ended.
    """

    increment: FloatArray
    decision: Decision
    reason: str = ""
    inlier_count: int = 0
    inlier_ratio: float = math.nan
    rmse: float = math.nan
    rotation: float = math.nan
    information: float = math.nan
    spread: float = math.nan
    iterations: int = 0
    degenerate: bool = False
    termination: Termination | None = None


def estimate_step(
    source: Scan,
    target: Target | None,
    prior: FloatArray | None,
    last_motion: FloatArray,
    parameters: OdometryParameters,
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
            source, target, guess=guess, prior=prior, matcher=matcher, limits=parameters.limits
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
    *,
    guess: FloatArray,
    prior: FloatArray | None,
    matcher: IcpParameters,
    limits: SanityLimits,
) -> tuple[StepRecord, list[str]]:
    """Match once; the record of it, and every sanity check that it fails."""
    result = icp(source, target, from_xytheta(guess), matcher)
    increment = to_xytheta(result.T_target_source)
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
        rotation=result.rotation,
        information=information,
        spread=spread_ratio(source, _seen_from_the_end(increment)),
        iterations=result.iterations,
        degenerate=degenerate,
        termination=result.termination,
    )
    return record, complaints
