"""The record of one step: what every odometry of the lab tells of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.covariance import fuse
from labkit.result import IcpResult, Termination
from labkit.scan import Scan
from labkit.support.arrays import FloatArray
from labkit.support.errors import DegenerateAlignmentError
from labkit.target import Target

STILL = np.zeros(3)
RANGE_STD = 0.01  # [m] of a range, at least
MIN_AGREEMENT = 0.5  # a match that agrees less is doubtful
MIN_MARGIN = 0.05  # of agreement: a match that exceeds another place by less is ambiguous


class Decision(Enum):
    """Source of a step's motion.

    CONFIRMED is the wheels' pose where the scan lies on the map as well as matched; STAND holds no
    motion at all.
    """

    START = "start"
    ICP = "icp"
    CONFIRMED = "confirmed"
    RETRY = "retry"
    SEARCH = "search"
    PRIOR = "prior"
    HOLD = "hold"
    STAND = "stand"

    @property
    def matched(self) -> bool:
        """True if the scan was matched, or confirmed what the wheels told."""
        return self in (Decision.ICP, Decision.CONFIRMED, Decision.RETRY, Decision.SEARCH)


class Evidence(NamedTuple):
    """Ground on which the covariance of a step is computed, when somebody asks for it."""

    std: FloatArray  # (3,): standard deviation of what no match tells [m, m, rad]
    result: IcpResult | None = None  # against the matched points of the target alone
    T_target_last: FloatArray = np.eye(3)
    covariance: FloatArray | None = None  # (3, 3), in place of a result that was let go


UNKNOWN = Evidence(STILL)


@dataclass(frozen=True, eq=False, kw_only=True)
class StepRecord:
    """Record of one step: its decision, and the numbers of its best match (NaN without one).

    Attributes
    ----------
    increment : ndarray, shape (3,)
        (Δx, Δy, Δψ) taken, in the frame of scan k [m, m, rad].
    decision : Decision
        Where the increment came from.
    prior : ndarray, shape (3,), or None
        What wheels or an IMU told of the step, uncorrected; None where they told nothing, or that
        the robot stands while its scan moved.
    reason : str
        The checks that failed on the way, for a person; often empty.
    inlier_count : int
        Kept pairs.
    inlier_ratio : float
        Kept pairs over source points.
    rmse : float
        Root mean square of the kept pairs' residuals [m].
    rotation : float
        |Δψ| of the match [rad].
    information : float
        Smallest eigenvalue of the information.
    degenerate : bool
        Whether the match leaves a direction free.
    iterations : int
        ICP steps of the match; 0 where the scan confirmed the wheels.
    termination : Termination or None
        How the match ended; None without one.
    agreement : float
        1 where all of the scan lies on the map, 0 where none does, less where beams look through
        its walls; of the lab's odometry alone, as the next three.
    score : float
        The agreement less the cost of an unexpected motion; see `labkit.odometry.score`.
    margin : float
        By how much the agreement exceeds that of the best match elsewhere; NaN if none was tried.
    against_prior : bool
        Whether the match lies beyond the limits around the prior, and was believed all the same.
    led : bool
        Whether the wheels lead: the last matches fit too little to be believed beside them.
    T_taken_refused : ndarray, shape (3, 3), or None
        Where a refused match ended, in the frame of the pose that was taken.
    """

    increment: FloatArray
    decision: Decision
    prior: FloatArray | None = None
    reason: str = ""
    inlier_count: int = 0
    inlier_ratio: float = math.nan
    rmse: float = math.nan
    rotation: float = math.nan
    information: float = math.nan
    degenerate: bool = False
    iterations: int = 0
    termination: Termination | None = None
    agreement: float = math.nan
    score: float = math.nan
    margin: float = math.nan
    against_prior: bool = False
    led: bool = False
    T_taken_refused: FloatArray | None = field(default=None, repr=False)
    evidence: Evidence = field(default=UNKNOWN, repr=False)

    @property
    def ambiguous(self) -> bool:
        """True if the scan fits elsewhere, too."""
        return self.margin < MIN_MARGIN

    @property
    def is_doubtful(self) -> bool:
        """True if the step may be wrong.

        It was not matched, or its match is ambiguous, agrees too little, lies against the prior,
        or leaves a direction free that no prior told.
        """
        if self.decision is Decision.START:
            return False
        is_unmeasured = self.degenerate and self.prior is None
        is_weak = self.agreement < MIN_AGREEMENT or self.ambiguous
        return not self.decision.matched or is_weak or self.against_prior or is_unmeasured

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance (3, 3) of the increment, computed when it is first asked for.

        Censi's in the directions that the match sees. In those that it leaves free, and where
        nothing was matched, a third of the limits is the standard deviation.
        """
        result = self.evidence.result
        if self.evidence.covariance is not None:
            return self.evidence.covariance
        wide = np.diag(self.evidence.std**2)
        if result is None:
            return wide
        # A copy, so that pairs and search trees, ten times as large as the match, are not kept.
        result = replace(result, target=Target(result.target.scan, result.target.normals))
        J = np.eye(3)  # from the target's axes to those of scan k
        J[:2, :2] = self.evidence.T_target_last[:2, :2].T
        try:
            covariance = fuse(result, RANGE_STD, STILL, wide)[1]
        except DegenerateAlignmentError:
            return wide
        return np.asarray(J @ covariance @ J.T)

    def let_match_go(self) -> StepRecord:
        """The record with its covariance in place of the match from which it is computed."""
        evidence = Evidence(self.evidence.std, covariance=self.covariance)
        return replace(self, evidence=evidence)


def record_of_match(
    result: IcpResult, increment: FloatArray, decision: Decision, T_target_last: FloatArray
) -> StepRecord:
    """The record of a step by a match that ends at `increment`, (3,), in the frame of scan k."""
    record = StepRecord(
        increment=increment,
        decision=decision,
        inlier_count=result.inlier_count,
        inlier_ratio=result.fitness,
        rotation=abs(float(increment[2])),
        iterations=result.iterations,
        termination=result.termination,
    )
    if result.termination.failed:
        return record
    observability = result.observability
    return replace(
        record,
        rmse=rmse_of(result),
        information=0.0 if observability is None else float(observability.values[0]),
        degenerate=observability is None or observability.degenerate,
        evidence=Evidence(STILL, with_matched_points(result), T_target_last),
    )


def rmse_of(result: IcpResult) -> float:
    """Root mean square [m] of the residuals of the kept pairs, which the metric minimises."""
    pairs = result.correspondences
    return math.sqrt(np.mean(pairs.residuals[pairs.kept] ** 2))


def with_matched_points(result: IcpResult) -> IcpResult:
    """The result against the matched points of its target alone: a record outlives the map."""
    is_matched = np.zeros(len(result.target.points), np.bool_)
    is_matched[result.correspondences.target_index] = True
    points = result.target.points[is_matched]
    target = Target(Scan.from_points(points), result.target.normals[is_matched])
    final = np.array(result.poses[-1:])
    coarse = int(result.coarse_poses == len(result.poses))
    return replace(result, poses=final, coarse_poses=coarse, target=target)


def no_match(which: str) -> StepRecord:
    """The record of a step whose `which` scan, the older or the newer, is too empty to match."""
    reason = f"the {which} scan has fewer than {MIN_PAIRS} points"
    return StepRecord(increment=STILL, decision=Decision.STAND, reason=reason)
