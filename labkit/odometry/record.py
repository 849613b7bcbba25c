"""The record of one step: what every odometry of the lab tells of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.degeneracy import spread_ratio
from labkit.result import IcpResult, Termination
from labkit.se2 import rotation
from labkit.support.arrays import FloatArray

STILL = np.zeros(3)
SUPPORTED = 0.5  # agreement below which a match is doubtful


class Decision(Enum):
    """Source of a step's motion; STAND holds no motion at all."""

    START = "start"
    ICP = "icp"
    RETRY = "retry"
    SEARCH = "search"
    PRIOR = "prior"
    HOLD = "hold"
    STAND = "stand"

    @property
    def matched(self) -> bool:
        """True if the motion came from matching the scans."""
        return self in (Decision.ICP, Decision.RETRY, Decision.SEARCH)


@dataclass(frozen=True, eq=False, kw_only=True)
class StepRecord:
    """Record of one step: its decision and reason, the numbers of its best match (NaN without one).

    Attributes
    ----------
    increment, decision : ndarray, shape (3,), and Decision
        (Δx, Δy, Δψ) taken, in the frame of scan k, [m, m, rad], and where it came from.
    covariance : ndarray, shape (3, 3)
        Covariance of the increment: Censi's, with a third of the limits as the standard
        deviation along what the match does not see, and of a motion that was not matched.
    reason : str
        The checks that failed on the way, and whether the wheels lead; often empty.
    inlier_count, inlier_ratio, rmse, rotation : float
        Kept pairs, their share of the source, the root mean square of their residuals [m], and
        |Δψ| [rad].
    seen_through, agreement, margin, ambiguous : float, float, float, bool
        Share of the target's visible points that beams pass through; 1 where all of the scan lies
        on the target, 0 where none does, less where beams pass through, −∞ of a failed match; by
        how much it exceeds that of the best match elsewhere; whether that is too little to tell.
    against_prior : bool
        Whether the match was believed although it lies beyond the limits around the prior.
    refused : ndarray, shape (3,), or None
        The increment of a match that was not believed, if it is like the prior or a last motion.
    information, degenerate, spread : float, bool, float
        Smallest eigenvalue of the information, whether a direction is free, and the lesson's
        cheap corridor test; see `labkit.degeneracy.spread_ratio`.
    iterations, termination : int, Termination or None
        ICP steps of the match, and how it ended.
    """

    increment: FloatArray
    decision: Decision
    covariance: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))
    reason: str = ""
    inlier_count: int = 0
    inlier_ratio: float = math.nan
    rmse: float = math.nan
    rotation: float = math.nan
    seen_through: float = math.nan
    agreement: float = math.nan
    margin: float = math.nan
    ambiguous: bool = False
    against_prior: bool = False
    refused: FloatArray | None = None
    information: float = math.nan
    degenerate: bool = False
    spread: float = math.nan
    iterations: int = 0
    termination: Termination | None = None

    @property
    def is_doubtful(self) -> bool:
        """True if the step was not matched, or its match has little support or a rival.

        `degenerate` tells of a direction that the match did not see.
        """
        unsure = self.ambiguous or self.against_prior or self.agreement < SUPPORTED
        return self.decision is not Decision.START and (unsure or not self.decision.matched)


def record_of_match(result: IcpResult, increment: FloatArray, decision: Decision) -> StepRecord:
    """The record of a step by a match that ends at `increment`, (3,), in the frame of scan k."""
    x, y, heading = increment
    record = StepRecord(
        increment=increment,
        decision=decision,
        inlier_count=result.inlier_count,
        inlier_ratio=result.fitness,
        rotation=abs(float(heading)),
        spread=spread_ratio(result.source, rotation(heading).T @ [x, y]),
        iterations=result.iterations,
        termination=result.termination,
    )
    if result.termination.failed:
        return record
    seen = result.observability
    return replace(
        record,
        rmse=rmse_of(result),
        information=0.0 if seen is None else float(seen.values[0]),
        degenerate=seen is None or seen.degenerate,
    )


def rmse_of(result: IcpResult) -> float:
    """Root mean square [m] of the residuals of the kept pairs, which the metric minimises."""
    pairs = result.correspondences
    return math.sqrt(np.mean(pairs.residuals[pairs.kept] ** 2))


def no_match(which: str) -> StepRecord:
    """The record of a step whose `which` scan, the older or the newer, is too empty to match."""
    reason = f"the {which} scan has fewer than {MIN_PAIRS} points"
    return StepRecord(increment=STILL, decision=Decision.STAND, reason=reason)
