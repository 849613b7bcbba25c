"""One step of odometry: the lesson's second flow chart, with its fallbacks in a stated order.

A  `_Step.match`      ICP from the prior, or from the last motion where there is none
B  `_Step.judged`     the increment (Δx, Δy, Δψ) in the frame of scan k
C  `integrate_step`   the pose, in `labkit.odometry.integration`
D  `_Step.judged`     the sanity checks; `_Step.choose`: the best of several matches
E  `estimate_step`    the match that is believed
F  `_Step.fall_back`  a search, and ICP from its peaks, where the first match is not believed,
                      agrees too little with the target, or leaves open what no prior tells;
                      without the search, ICP with a reduced gate and reduced steps
   `estimate_step`    the prior; without one, skip: hold the last motion once, or stand still

A match lies within the window around the prior, nearer where it agrees less. Or it overrides the
prior: with an agreement of 0.5, if the last motions are like the match and unlike the prior; with
0.8, if the prior is longer than a step can be, as after a gap, or off by its turn alone. What is
carried along is left out first. If a scan fits in several places, the match is not a measurement:
the prior is taken, where there is one. Motions that no wall fixes, such as the way along a
corridor, are taken from the prior or, with the search, from the last motions, unless the scan fits
clearly less well there. Without the search, the lesson's checks hold as they are.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property

import numpy as np

from labkit.correspondences import MIN_PAIRS, huber_loss
from labkit.covariance import censi_information
from labkit.degeneracy import spread_ratio
from labkit.icp import icp
from labkit.odometry.agreement import THROUGH, beams_of, seen_through
from labkit.odometry.carried import stands, without_carried
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.sanity import FULL, SanityLimits, beyond, conflicts, poor
from labkit.odometry.search import STARTS, alike, apart, completed, search, surprise
from labkit.result import IcpResult, Termination
from labkit.scan import Scan
from labkit.schedule import gate_of
from labkit.se2 import from_xytheta, invert, rotation, to_xytheta
from labkit.support.arrays import FloatArray
from labkit.support.errors import DegenerateAlignmentError
from labkit.target import Target

STILL = np.zeros(3)
RANGE_STD = 0.01  # [m] of a range, at least
AT_TARGET = np.eye(3)
SUPPORTED, SURE = 0.5, 0.8  # agreement that asks for no search, with a prior and without one
SURPRISE = 0.1  # of agreement, that a motion costs which is unlike any that was expected
SAME = 0.01  # scores closer than this tie; the first tried wins
ALIKE = 0.05  # agreements that differ by less do not tell which of two matches is right


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
        return self in MATCHED


MATCHED = Decision.ICP, Decision.RETRY, Decision.SEARCH


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
        The checks that failed on the way; empty where the first match passed.
    inlier_count, inlier_ratio, rmse, rotation : float
        Kept pairs, their share of the source, the root mean square of their residuals [m], and
        |Δψ| [rad].
    seen_through, agreement : float
        Share of the target's visible points that beams pass through; and 1 where all of the scan
        lies on the target, 0 where none does, less where beams pass through; −∞ of a failed match.
    margin, ambiguous : float, bool
        By how much the match agrees better than the best one elsewhere that passes the checks,
        NaN without one; and whether that is too little to tell which is right.
    against_prior : bool
        Whether the match was believed although it lies beyond the limits around the prior.
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
    information: float = math.nan
    degenerate: bool = False
    spread: float = math.nan
    iterations: int = 0
    termination: Termination | None = None

    @property
    def is_doubtful(self) -> bool:
        """True if the step was not matched, or its match has little support or a rival."""
        unsure = self.ambiguous or self.against_prior or self.agreement < SUPPORTED
        return self.decision is not Decision.START and (unsure or not self.decision.matched)


def estimate_step(
    source: Scan,
    target: Target | None,
    prior: FloatArray | None,
    motions: FloatArray,
    parameters: OdometryParameters,
    *,
    T_target_last: FloatArray = AT_TARGET,
    T_target_told: FloatArray = AT_TARGET,
    key: Scan | None = None,
) -> StepRecord:
    """Estimate the motion from scan k (`target`) to scan k+1 (`source`).

    Parameters
    ----------
    source, target : Scan, Target or None
        The newer scan, filtered, and the older one or the map; None without points.
    prior : ndarray, shape (3,), or None
        Expected increment from wheels or an IMU.
    motions : ndarray, shape (3,) or (K, 3)
        Increments of the steps before, the newest first. Without a prior the first is the guess
        and the last resort, and all are likely.
    parameters : OdometryParameters
        Matcher, limits and fallbacks.
    T_target_last : ndarray, shape (3, 3)
        Where scan k was taken in the target's frame; the identity where it is the target.
    T_target_told : ndarray, shape (3, 3)
        The same by the priors alone, since the target got its frame.
    key : Scan, optional
        The scan in whose frame the target lies, as it was taken. Points that lie as they did
        there while the prior moves are carried along, and left out.
    """
    likely = np.atleast_2d(motions)
    last_resort = Decision.HOLD if likely[0].any() else Decision.STAND
    if prior is not None:
        likely, last_resort = np.vstack([prior, likely]), Decision.PRIOR
    told = T_target_last, prior is not None, parameters.limits
    if target is None or len(source) < MIN_PAIRS:
        which = "older" if target is None else "newer"
        reason = f"the {which} scan has fewer than {MIN_PAIRS} points"
        covariance = covariance_of(None, *told)
        return StepRecord(
            increment=likely[0], decision=last_resort, covariance=covariance, reason=reason
        )

    expected = T_target_last @ from_xytheta(likely)
    step = _Step(source, target, T_target_last, prior, expected, parameters)
    tried = [step.match(expected[0], Decision.ICP)]
    if prior is not None and key is not None and parameters.search:
        is_near = not tried[0].complaints and not tried[0].record.against_prior
        here = tried[0].T_target_source if is_near else expected[0]
        still = stands(source, key)
        for T in (here, T_target_told @ from_xytheta(prior)):
            fixed = without_carried(source, still, target, T)
            if len(fixed) < len(source):
                other = replace(step, source=fixed)
                again = other.match(expected[0], Decision.ICP)
                if again.record.agreement > tried[0].record.agreement:
                    step, tried = other, [again]
    if step.asks_for_more(tried[0]):
        tried += step.fall_back()
    best = step.choose(tried)
    shift, turn = best.record.increment[:2], best.record.increment[2]
    record = replace(best.record, spread=spread_ratio(source, rotation(turn).T @ shift))
    if not best.complaints and not (record.ambiguous and prior is not None):
        return replace(record, covariance=covariance_of(best.result, *told))  # E
    taken = replace(record, increment=likely[0], decision=last_resort, against_prior=False)
    return replace(taken, covariance=covariance_of(None, *told))  # F


def covariance_of(
    result: IcpResult | None, T_target_last: FloatArray, is_told: bool, limits: SanityLimits
) -> FloatArray:
    """Covariance (3, 3) of an increment: Censi's where a match sees, a third of the limits else."""
    shift, turn = limits.max_translation, limits.max_rotation
    if is_told:
        shift, turn = limits.max_prior_translation, limits.max_prior_rotation
    information = np.diag(np.divide(3.0, [shift, shift, turn]) ** 2)
    if result is not None:
        J = np.eye(3)  # from the target's axes to those of scan k
        J[:2, :2] = T_target_last[:2, :2].T
        with suppress(DegenerateAlignmentError):
            information += J @ censi_information(result, RANGE_STD) @ J.T
    return np.asarray(np.linalg.inv(information))


@dataclass(frozen=True, eq=False)
class _Match:
    """A match that was tried, where it ended, and the checks that forbid to believe it."""

    record: StepRecord
    T_target_source: FloatArray  # NaN where it failed
    complaints: list[str]
    score: float = -math.inf  # the agreement, less by how much the motion surprises
    result: IcpResult | None = None


@dataclass(frozen=True, eq=False)
class _Step:
    """One step. `expected`: poses predicted by the prior (first) and the last motions."""

    source: Scan
    target: Target
    T_target_last: FloatArray
    prior: FloatArray | None
    expected: FloatArray
    parameters: OdometryParameters

    def match(self, T_guess: FloatArray, decision: Decision, *, is_peak: bool = False) -> _Match:
        """Match once (A), and judge the outcome.

        Along a free direction a peak is arbitrary: move the match to the expected pose unless it
        fits clearly worse there.
        """
        told = self.parameters.retry if decision is Decision.RETRY else self.parameters.icp
        result = icp(self.source, self.target, T_guess, told)
        found, seen = self.judged(result, decision), result.observability
        if is_peak and seen is not None and seen.degenerate:
            T = completed(result.T_target_source, seen, self.expected_of(found.record))
            there = self.match(T, decision)
            if there.record.agreement > found.record.agreement - ALIKE:
                return there
        return found

    def judged(self, result: IcpResult, decision: Decision) -> _Match:
        """The motion of a match (B), and every sanity check that it fails (D)."""
        T, told, limits = result.T_target_source, result.parameters, self.parameters.limits
        increment = to_xytheta(invert(self.T_target_last) @ T)
        record = StepRecord(
            increment=increment,
            decision=decision,
            inlier_count=result.inlier_count,
            inlier_ratio=result.fitness,
            agreement=-math.inf,
            rotation=abs(float(increment[2])),
            iterations=result.iterations,
            termination=result.termination,
        )
        if result.termination.failed:
            return _Match(replace(record, reason=result.message), T, [result.message])
        pairs, seen = result.correspondences, result.observability
        through = seen_through(*self._view, np.array(T))
        gate = gate_of(told.for_loop, False)
        worst = huber_loss(gate, told.huber_delta) if gate < math.inf else math.inf  # (4.1)
        agreement = 1.0 - min(1.0, result.cost / worst)  # far from the answer pairs cost more
        agreement -= THROUGH * (0.0 if math.isnan(through) else through)
        free = seen is None or seen.degenerate
        rmse = math.sqrt(np.mean(pairs.residuals[pairs.kept] ** 2))
        information = 0.0 if seen is None else float(seen.values[0])
        needed = agreement if self.parameters.search else FULL
        against = conflicts(increment, self.prior, limits, needed)
        found = poor(result.fitness, rmse, limits)
        if self.prior is None or against or not self.parameters.search:
            found += beyond(increment, limits)
        is_expected = self.prior is not None or self.parameters.search
        if free and not (told.metric == "point_to_line" and is_expected):
            found.append(f"degenerate: information {information:.3f}")
        overrides = bool(against) and agreement >= self.overriding(T, increment)
        record = replace(
            record,
            reason=", ".join([*found, *against]),
            rmse=rmse,
            seen_through=through,
            agreement=agreement,
            against_prior=overrides,
            information=information,
            degenerate=free,
        )
        unlike = surprise(T, self.expected_of(record))
        score = agreement - SURPRISE * unlike / (1.0 + unlike)
        return _Match(record, T, found if overrides else [*found, *against], score, result)

    def expected_of(self, record: StepRecord) -> FloatArray:
        """The poses that are expected of a match near the prior, or of one against it."""
        if self.prior is None:
            return self.expected
        return self.expected[1:] if record.against_prior else self.expected[:1]

    def overriding(self, T: FloatArray, increment: FloatArray) -> float:
        """The agreement with which a match at T, far from the prior, is believed all the same."""
        if self.prior is None or not self.parameters.search:
            return math.inf
        limits, unlike = self.parameters.limits, surprise(T, self.expected[1:])
        if unlike < 1.0 and surprise(self.expected[0], self.expected[1:]) > 1.0 + unlike:
            return SURE if beyond(self.prior, limits) else SUPPORTED
        shift = increment[:2] - self.prior[:2]
        return SURE if math.hypot(*shift) <= limits.max_prior_translation else math.inf

    def asks_for_more(self, match: _Match) -> bool:
        """True if there may be a better match than this first one."""
        record, asked = match.record, SURE if self.prior is None else SUPPORTED
        untold = record.against_prior or (record.degenerate and self.prior is None)
        weak = untold or record.agreement < asked
        return bool(match.complaints) or (self.parameters.search and weak)

    def fall_back(self) -> list[_Match]:
        """A match with reduced steps (F), or those from a search's starts."""
        if not self.parameters.search:
            return [self.match(self.expected[0], Decision.RETRY)]
        limits, told = self.parameters.limits, self.prior is not None
        window = limits.max_translation, limits.max_rotation
        found = search(self.source, self.target, self.T_target_last, window)
        if told:  # finer, where the wheels lead
            window = limits.max_prior_translation, limits.max_prior_rotation
            found += search(self.source, self.target, self.expected[0], window)
        others = apart(self.expected, STARTS)[1:]
        tried = [self.match(T_guess, Decision.SEARCH, is_peak=told) for T_guess in others]
        return tried + [self.match(T_guess, Decision.SEARCH, is_peak=True) for T_guess in found]

    def choose(self, tried: list[_Match]) -> _Match:
        """The best match, compared with those that ended elsewhere.

        With a search, a match with a complaint, or against the prior, must be better than those
        without by `ALIKE`.
        """
        best = tried[-1]
        if self.parameters.search:
            questioned = [each.record.against_prior or bool(each.complaints) for each in tried]
            scores = [each.score for each in tried] - ALIKE * np.array(questioned)
            best = tried[int(np.argmax(scores >= scores.max() - SAME))]
        others = [
            each.record.agreement
            for each in tried
            if not each.complaints
            and each.record.against_prior <= best.record.against_prior
            and not alike(best.T_target_source, each.T_target_source)
        ]
        margin = best.record.agreement - max(others, default=math.nan)
        ambiguous = self.parameters.search and not best.complaints and margin < ALIKE
        why = {each.record.decision.value: each.record.reason for each in (tried[0], best)}
        reasons = [f"{decision}: {reason}" for decision, reason in why.items() if reason]
        if ambiguous:
            reasons.append(f"ambiguous: it fits elsewhere, too ({margin:+.3f})")
        told = replace(best.record, margin=margin, ambiguous=ambiguous, reason="; ".join(reasons))
        return replace(best, record=told)

    @cached_property
    def _view(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return *beams_of(self.source), np.array(self.target.points)
