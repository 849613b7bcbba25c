"""The record of one step: what every odometry of the lab tells of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from labkit.correspondences import MIN_PAIRS, Correspondences, pairs_at
from labkit.covariance import fuse
from labkit.degeneracy import observability
from labkit.line_alignment import Information
from labkit.odometry.constants import (
    LEAD_AGREEMENT,
    LEAST_WHEEL_ERROR,
    MARGIN,
    MAX_ERROR,
    MIN_AGREEMENT,
    MIN_SCORE,
)
from labkit.odometry.integration import is_within
from labkit.parameters import IcpParameters
from labkit.result import IcpResult, Termination
from labkit.scan import Scan
from labkit.support.arrays import EPSILON, FloatArray
from labkit.support.errors import DegenerateAlignmentError
from labkit.target import Target

STILL = np.zeros(3)


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

    @property
    def is_guess(self) -> bool:
        """True if neither scan nor wheels told the motion."""
        return self in (Decision.HOLD, Decision.STAND)


class Scales(NamedTuple):
    """Scales that a run measured on its last steps, and holds the next one to."""

    wheel_shift: float  # usual error of the wheels at rest [m]
    wheel_turn: float  # the same [rad]
    wheel_factor: float  # how many times as far as the wheels the matches lead
    agreement: float  # of a scan with the map, usually
    steps: float  # usual steps since the last scan or, without wheels, since the last match
    max_shift: float  # the farthest that a usual step can lead [m], and that wheels can err
    max_turn: float  # the same [rad]

    @property
    def wheels_lead(self) -> bool:
        """True if scans usually fit too little to be believed beside wheels.

        They may fit less where matches bear the wheels out, as those of a sparse scanner do.
        """
        is_borne_out = self.wheel_shift <= LEAST_WHEEL_ERROR[0]
        return self.agreement < (MIN_AGREEMENT if is_borne_out else LEAD_AGREEMENT)

    @property
    def farthest(self) -> tuple[float, float]:
        """The farthest that the step can lead, [m] and [rad]."""
        return self.steps * self.max_shift, min(math.pi, self.steps * self.max_turn)

    def correct(self, told: FloatArray) -> FloatArray:
        """The motion that wheels told, (3,), times the factor that matches measured."""
        factors: FloatArray = np.array([self.wheel_factor, self.wheel_factor, 1.0])
        return told * factors

    def allow(self, motion: FloatArray) -> bool:
        """True if a motion is one that the robot can do; NaN is none."""
        return is_within(motion, self.farthest)


@dataclass(frozen=True, eq=False, kw_only=True)
class Placement:
    """A scan at a pose on a target and the pairs that it makes there, without a run of ICP."""

    source: Scan
    target: Target
    parameters: IcpParameters
    T_target_source: FloatArray
    coarse: bool = False  # pairs within the coarse gate; see `labkit.schedule`
    iterations: int = 0
    termination: Termination | None = None
    message: str = "a scan at a pose"

    @cached_property
    def correspondences(self) -> Correspondences:
        """The association at the pose."""
        T = np.array(self.T_target_source)
        return pairs_at(self.source, self.target, T, self.parameters, coarse=self.coarse)

    @cached_property
    def observability(self) -> Information | None:
        """Information of the pairs about each direction; None where none lies on a surface."""
        return observability(self.correspondences, self.target)


class Evidence(NamedTuple):
    """Ground on which the covariance of a step is computed, when somebody asks for it."""

    std: FloatArray  # (3,): standard deviation of what no match tells [m, m, rad]
    placement: Placement | None = None  # on the matched points of the target alone
    T_target_last: FloatArray = np.eye(3)
    covariance: FloatArray | None = None  # (3, 3), in place of a match that was let go


UNKNOWN = Evidence(STILL)


class Check(NamedTuple):
    """Motion of a step by the two scans alone; see `labkit.odometry.check`."""

    increment: FloatArray  # (3,) [m, m, rad]; NaN where no match told it
    noise: float = math.nan  # [m]: RMS of the residuals, or δ if that is less
    information: float = math.nan  # smallest eigenvalue


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
        its walls; where the wheels lead, of the best match near them. Of the lab's odometry alone,
        as the next three.
    score : float
        The agreement less the cost of an unexpected motion; see `labkit.odometry.score`.
    margin : float
        By how much the agreement exceeds that of the best match elsewhere; NaN if none was tried.
    against_prior : bool
        Whether the match lies beyond the limits around the prior, and was believed all the same.
    check : Check or None
        The same motion by a match with the scan before alone; None where the step is such a match,
        or was not matched.
    led : bool
        Whether the wheels lead: the last scans fitted too little to be believed beside them.
    repeats : bool
        Whether the scan repeats the one before to the last digit, though no wheels tell a stand.
    T_taken_refused : ndarray, shape (3, 3), or None
        Where a match ended that was refused, or to which one near the wheels was preferred, in the
        frame of the pose that was taken.
    scales : Scales or None
        What the run had measured before the step, and held it to.
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
    check: Check | None = None
    led: bool = False
    repeats: bool = False
    T_taken_refused: FloatArray | None = field(default=None, repr=False)
    scales: Scales | None = None
    evidence: Evidence = field(default=UNKNOWN, repr=False)

    @property
    def has_rival(self) -> bool:
        """True if a match scored, and was refused for another motion: it may have been right."""
        return self.T_taken_refused is not None and self.score > MIN_SCORE

    @property
    def ambiguous(self) -> bool:
        """True if the scan fits elsewhere, too."""
        return self.margin < MARGIN

    @property
    def is_doubtful(self) -> bool:
        """True if the step may be wrong.

        It was not matched, or its match is ambiguous, lies against the prior, is contradicted by
        the scan before, leads over missing scans without wheels, or sees too little along a
        direction that wheels do not tell well either.
        """
        if self.decision is Decision.START:
            return False
        is_unclear = not self.decision.matched or self.ambiguous or self.against_prior
        is_unmeasured = self.is_free or self.weakest_std > self.allowed_std
        return is_unclear or is_unmeasured or self.is_contradicted or self.is_over_gap

    @property
    def is_free(self) -> bool:
        """True if the match leaves a direction free, and no wheels told it."""
        return self.prior is None and self.degenerate

    @property
    def is_contradicted(self) -> bool:
        """True if a match with the scan before alone leads elsewhere, or found nothing."""
        return self.check is not None and are_apart(self.check.increment, self.increment)

    @property
    def is_over_gap(self) -> bool:
        """True if scans are missing before this one, and no wheels told the motion."""
        return self.prior is None and self.scales is not None and self.scales.steps >= 2.0

    @property
    def allowed_std(self) -> float:
        """Largest `weakest_std` [m] of a step that is not doubtful.

        Beside wheels it is `MAX_ERROR`, and half of it where the step lies more than two of their
        usual errors off them: one of the two is wrong. Without wheels it is that of a wrong step.
        """
        if self.prior is None:
            return 2.0 * MAX_ERROR[0]
        told = self.prior if self.scales is None else self.scales.correct(self.prior)
        x, y, _ = (self.increment - told).tolist()
        is_off_wheels = math.hypot(x, y) > 2.0 * float(self.evidence.std[0])
        return 0.5 * MAX_ERROR[0] if is_off_wheels else MAX_ERROR[0]

    @property
    def weakest_std(self) -> float:
        """Standard deviation [m] of a step along the direction that two scans alone see least.

        Residuals of neighbours err alike, so many pairs measure as one does. The fewer walls face
        the direction, the less they tell; beside them the wheels tell the rest. NaN without a
        match.
        """
        noise, information = self.rmse, self.information
        if self.check is not None:
            noise, information = self.check.noise, self.check.information
        std = float(self.evidence.std[0])
        return std / math.sqrt(1.0 + max(0.0, information) * (std / max(noise, EPSILON)) ** 2)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance (3, 3) of the increment, computed when it is first asked for.

        Censi's in the directions that the match sees, and the tolerances at which ICP stops. In
        those that it leaves free, and where nothing was matched, the standard deviation is the
        wheels' usual error, or else a third of the limits.
        """
        placement = self.evidence.placement
        if self.evidence.covariance is not None:
            return self.evidence.covariance
        wide = np.diag(self.evidence.std**2)
        if placement is None:
            return wide
        # A copy, so that pairs and search trees, ten times as large as the match, are not kept.
        all_rows = np.arange(len(placement.target.points))
        placement = replace(placement, target=placement.target.select(all_rows))
        # Residuals show what the map lacks, too; the noise of its points counts where it is more.
        resolution = max(placement.parameters.translation_tolerance, EPSILON)
        noise = float(np.fmax(self.rmse, resolution))
        tolerances = [resolution, resolution, placement.parameters.rotation_tolerance]
        J = np.eye(3)  # from the target's axes to those of scan k
        J[:2, :2] = self.evidence.T_target_last[:2, :2].T
        try:
            # The step leads from one match to another, which err alike.
            covariance = 2.0 * fuse(placement, noise, STILL, 0.5 * wide)[1]
        except DegenerateAlignmentError:
            return wide
        return np.asarray(J @ covariance @ J.T + np.diag(np.square(tolerances)))

    def let_match_go(self) -> StepRecord:
        """The record with its covariance in place of the match from which it is computed."""
        evidence = Evidence(self.evidence.std, covariance=self.covariance)
        return replace(self, evidence=evidence)


def record_of_match(
    match: IcpResult | Placement,
    increment: FloatArray,
    decision: Decision,
    T_target_last: FloatArray,
) -> StepRecord:
    """The record of a step by a match that ends at `increment`, (3,), in the frame of scan k."""
    record = StepRecord(
        increment=increment,
        decision=decision,
        rotation=abs(float(increment[2])),
        iterations=match.iterations,
        termination=match.termination,
    )
    if match.termination is not None and match.termination.failed:
        return record
    pairs = match.correspondences
    information = match.observability
    return replace(
        record,
        inlier_count=pairs.inlier_count,
        inlier_ratio=pairs.fitness,
        rmse=rmse_of(pairs),
        information=0.0 if information is None else float(information.values[0]),
        degenerate=information is None or information.degenerate,
        evidence=Evidence(STILL, on_matched_points(match), T_target_last),
    )


def are_apart(motion: FloatArray, other: FloatArray) -> bool:
    """True if two motions (3,) differ by more than `MAX_ERROR`; NaN differs."""
    return not is_within(motion - other, MAX_ERROR)


def rmse_of(pairs: Correspondences) -> float:
    """Root mean square [m] of the kept pairs' residuals, which the metric minimises; else NaN."""
    if not pairs.kept.any():
        return math.nan
    return math.sqrt(np.mean(pairs.residuals[pairs.kept] ** 2))


def on_matched_points(match: IcpResult | Placement) -> Placement:
    """The scan where a match put it, on the matched points alone: a record outlives the map."""
    rows = np.unique(match.correspondences.target_index)
    coarse = isinstance(match, IcpResult) and match.coarse_poses == len(match.poses)
    return Placement(
        source=match.source,
        target=match.target.select(rows),
        parameters=match.parameters,
        T_target_source=match.T_target_source,
        coarse=coarse,
    )


def no_match(which: str) -> StepRecord:
    """The record of a step whose `which` scan, the older or the newer, is too empty to match."""
    reason = f"the {which} scan has fewer than {MIN_PAIRS} points"
    return StepRecord(increment=STILL, decision=Decision.STAND, reason=reason)
