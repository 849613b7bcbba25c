"""One step of odometry: match, check, and fall back in a stated order (section 5).

1. ICP from the prior, or from the last motion where there is none.
2. Where a sanity check fails: ICP once more, with a reduced gate and reduced steps.
3. Where there is no prior, or the match is not believed or doubtful: a search, and ICP from
   its best starts.
4. Where no match passes the checks: the prior.
5. Without a prior: skip the update, that is hold the last motion, or stand still where
   there is none to hold (a motion is held once) or `on_skip` says so.

Of several matches, the checks judge the one that agrees best with the target and deviates
least from the expected motion (`labkit.odometry.expectation`). A worse match is not believed
just because it passes the checks: if the best match lies half a metre beyond a limit, another
match within the limit is no better. If a scan fits in several places within the limits, the
match is not a measurement: the prior is taken, and without one the place nearest to the
expected motion. Motions that no wall fixes, such as the way along a corridor, are taken from
the prior or the expected motion.

Without the search, steps 1, 2, 4 and 5 are the lesson's chain: the first match that passes is
taken, and without a prior a step with a free direction is not believed.

A step depends on nothing but its arguments. So steps with a prior that are matched to the
scan before may run in any order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from labkit.arrays import FloatArray
from labkit.correspondences import MIN_PAIRS, huber_loss, pairs_at
from labkit.degeneracy import spread_ratio
from labkit.icp import icp
from labkit.odometry.expectation import Expectation
from labkit.odometry.free_space import seen_through
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.sanity import motion_complaints, quality_complaints
from labkit.odometry.search import alike, apart, field_of, search
from labkit.parameters import IcpParameters
from labkit.result import IcpResult
from labkit.scan import Scan
from labkit.schedule import close_gate
from labkit.se2 import from_xytheta, invert, to_xytheta
from labkit.target import Target

STILL = np.zeros(3)
AT_TARGET = np.eye(3)
NOTHING = np.empty((0, 3))
THROUGH = 0.5  # what a beam that looks through a wall counts, beside a point without partner
SURPRISE = 0.1  # of agreement, that a motion costs which is unlike any that was expected
SAME = 0.01  # scores of one place that differ by less: whichever was tried first
ALIKE = 0.05  # agreements that differ by less do not tell which of two matches is right


def estimate_step(
    source: Scan,
    target: Target | None,
    prior: FloatArray | None,
    last_motion: FloatArray,
    parameters: OdometryParameters,
    *,
    T_target_last: FloatArray = AT_TARGET,
    earlier_motions: FloatArray = NOTHING,
) -> StepRecord:
    """Estimate the motion from scan k (`target`) to scan k+1 (`source`).

    Parameters
    ----------
    source : Scan
        The newer scan, filtered already.
    target : Target or None
        The older one, or the map; None where it has no points.
    prior : ndarray, shape (3,), or None
        Expected increment from wheels or an IMU.
    last_motion : ndarray, shape (3,)
        The increment of the step before: guess and last resort without a prior.
    parameters : OdometryParameters
        Matcher, limits and fallbacks.
    T_target_last : ndarray, shape (3, 3)
        Where scan k was taken in the target's frame; the identity where it is the target.
    earlier_motions : ndarray, shape (K, 3)
        Increments of steps before, the newest first, for a search without a prior.

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

    motions = guess[None] if prior is not None else np.vstack([guess, earlier_motions])
    pair = _Pair(source, target, T_target_last, prior, motions, parameters)
    T_guess = T_target_last @ from_xytheta(guess)
    first = pair.match(T_guess, Decision.ICP)
    if not first.complaints and not _is_doubtful(first.agreement, prior, parameters):
        return first.record

    tried = [first]
    if first.complaints:
        tried.append(pair.match(T_guess, Decision.RETRY))
    if parameters.search:
        pair.search(tried)
        best = _best(tried)
    else:
        best = next((each for each in tried if not each.complaints), tried[-1])
    elsewhere = [each for each in tried if not alike(each.T_target_source, best.T_target_source)]
    others = [each.agreement for each in elsewhere if not each.complaints]
    margin = best.agreement - max(others, default=math.nan)
    ambiguous = parameters.search and not best.complaints and margin < ALIKE
    reasons = [each.reason for each in tried if each.complaints]
    if ambiguous:
        reasons.append(f"ambiguous: it fits elsewhere, too ({margin:+.3f})")
    believed = not best.complaints and not (ambiguous and prior is not None)
    return replace(
        best.record,
        increment=best.record.increment if believed else guess,
        decision=best.record.decision if believed else last_resort,
        margin=margin,
        ambiguous=ambiguous,
        reason="; ".join(reasons),
    )


def _is_doubtful(
    agreement: float, prior: FloatArray | None, parameters: OdometryParameters
) -> bool:
    """Whether a search should say if there is a better match than one that passes the checks."""
    return parameters.search and (prior is None or agreement < parameters.search_below)


@dataclass(frozen=True, eq=False)
class _Match:
    """A match that was tried: its record, the checks that it fails, and where it ended.

    Its agreement is 1 where every point of the source lies on the target, 0 where none has a
    partner there, and less where beams look through the target's walls.
    """

    record: StepRecord
    complaints: list[str]
    T_target_source: FloatArray
    agreement: float
    pair: _Pair

    @cached_property
    def score(self) -> float:
        """The agreement, less by how much the motion surprises."""
        return self.agreement - SURPRISE * self.pair.expected.unlikeliness(self.T_target_source)

    @property
    def reason(self) -> str:
        return f"{self.record.decision.value}: {', '.join(self.complaints)}"


def _best(tried: list[_Match]) -> _Match:
    """The match with the highest score.

    Or one that is about as good and passes the checks; or an earlier one that ended there.
    """
    best = max(tried, key=lambda each: each.score)
    if best.complaints:
        good = [each for each in tried if not each.complaints]
        return next((each for each in good if each.score > best.score - ALIKE), best)
    there = [each for each in tried if alike(each.T_target_source, best.T_target_source)]
    return next(each for each in there if each.score > best.score - SAME and not each.complaints)


@dataclass(frozen=True, eq=False)
class _Pair:
    """What all matches of a step have in common."""

    source: Scan
    target: Target
    T_target_last: FloatArray
    prior: FloatArray | None
    motions: FloatArray
    parameters: OdometryParameters

    @cached_property
    def expected(self) -> Expectation:
        return Expectation(self.motions, self.T_target_last)

    @cached_property
    def T_last_target(self) -> FloatArray:
        return invert(self.T_target_last)

    def search(self, tried: list[_Match]) -> None:
        """Add the matches from the motions of before, and from the best starts of a search.

        A start is passed over that lies where another match has ended.
        """
        limits, count = self.parameters.limits, self.parameters.search_starts
        if self.prior is None:
            middle, window = self.T_target_last, (limits.max_translation, limits.max_rotation)
        else:
            middle = self.expected.poses[0]
            window = limits.max_prior_translation, limits.max_prior_rotation
        field = field_of(self.target)
        found = search(self.source, field, middle, window, count=count)
        before = apart(self.expected.poses, (count + 1) // 2)
        for T_guess in [*before, *found]:
            if not any(alike(T_guess, each.T_target_source) for each in tried):
                tried.append(self.match(T_guess, Decision.SEARCH))

    def match(self, T_guess: FloatArray, decision: Decision) -> _Match:
        """Match once; the record of it, and every sanity check that it fails."""
        result = self._icp(T_guess, decision)
        seen = result.observability
        if seen is not None and seen.degenerate and self._completes(decision):
            result = self._icp(self.expected.completed(result.T_target_source, seen), decision)
        limits, T = self.parameters.limits, result.T_target_source
        increment = to_xytheta(self.T_last_target @ T)
        information, degenerate = math.nan, False
        through, spread, agreement = math.nan, math.nan, -math.inf
        if result.termination.failed:
            complaints = [result.message]
        else:
            seen = result.observability
            information = 0.0 if seen is None else float(seen.values[0])
            degenerate = information < limits.min_information
            through, spread = self._judge(T, increment)
            agreement = _agreement(_near_cost(result), through, result.parameters)
            complaints = motion_complaints(increment, self.prior, limits)
            gate = _near_gate(result.parameters)
            complaints += quality_complaints(result.fitness, result.inlier_rmse, limits, gate)
        if degenerate and not self._leaves_free_what_is_free():
            complaints.append(
                f"degenerate: information {information:.3f} < {limits.min_information:.3f}"
            )
        record = StepRecord(
            increment=increment,
            decision=decision,
            inlier_count=result.inlier_count,
            inlier_ratio=result.fitness,
            rmse=result.inlier_rmse,
            cost=result.cost,
            seen_through=through,
            rotation=abs(float(increment[2])),
            information=information,
            spread=spread,
            iterations=result.iterations,
            degenerate=degenerate,
            termination=result.termination,
        )
        return _Match(record, complaints, T, agreement, self)

    def _judge(self, T: FloatArray, increment: FloatArray) -> tuple[float, float]:
        """What the source looks through at the pose T, and the spread ratio of the motion."""
        motion = _seen_from_the_end(increment)
        through = seen_through(self.source, self.target.points, T)
        return through, spread_ratio(self.source, motion)

    def _icp(self, T_guess: FloatArray, decision: Decision) -> IcpResult:
        told = self.parameters
        matcher = told.retry if decision is Decision.RETRY else told.icp
        return icp(self.source, self.target, T_guess, matcher)

    def _completes(self, decision: Decision) -> bool:
        """Whether a free direction has to be put where it is expected; from a prior it is."""
        from_prior = self.prior is not None and decision is not Decision.SEARCH
        return self.parameters.search and not from_prior and self._leaves_free_what_is_free()

    def _leaves_free_what_is_free(self) -> bool:
        """Whether a match stays, along a free direction, where it was begun on good grounds."""
        grounds = self.prior is not None or self.parameters.search
        return grounds and self.parameters.icp.metric == "point_to_line"


def _agreement(cost: float, through: float, told: IcpParameters) -> float:
    """1 less the cost J over that of a scan without any partner, and less what is seen through."""
    return (
        1.0 - cost / _cost_of_no_partner(told) - THROUGH * (0.0 if math.isnan(through) else through)
    )


def _near_cost(result: IcpResult) -> float:
    """The cost J [m²] near the answer, also of a run whose last iteration was still far from it."""
    if not result.far[-1]:
        return result.cost
    T, told = result.T_target_source, result.parameters
    return pairs_at(result.source.points, result.target, T, told).cost


@lru_cache(maxsize=64)
def _cost_of_no_partner(told: IcpParameters) -> float:
    """The cost J [m²] near the answer of a scan no point of which has a partner."""
    return float(huber_loss(_near_gate(told), told.huber_delta))


@lru_cache(maxsize=64)
def _near_gate(told: IcpParameters) -> float:
    """The gate near the answer [m]."""
    gate = told.max_correspondence_distance
    return close_gate(gate, told.huber_delta) if told.approach else gate


def _seen_from_the_end(increment: FloatArray) -> FloatArray:
    """The motion (Δx, Δy) in the frame of scan k+1, as the newer scan sees it."""
    x, y, turn = increment.tolist()
    c, s = math.cos(turn), math.sin(turn)
    return np.array([c * x + s * y, c * y - s * x])
