"""One step of odometry: match, check, and fall back in a stated order (section 5).

1. ICP from the prior, or from the last motion where there is none.
2. Where a sanity check fails: ICP once more, with a reduced gate and reduced steps.
3. Where that helps no more, or the match is doubtful: a search, and ICP from its best starts.
4. Where no match passes the checks: the prior.
5. Without a prior: skip the update, that is hold the last motion, or stand still where
   there is none to hold (a motion is held once) or `on_skip` says so.

Of several matches the one that agrees best with the target is judged. A worse one is not
believed because it passes the checks: a scan that was matched half a metre beyond a limit
does not come to lie elsewhere by being matched once more.

A step depends on nothing but its arguments. Against the scan before it, steps with a prior
may so run in any order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from labkit.arrays import FloatArray
from labkit.correspondences import MIN_PAIRS
from labkit.degeneracy import spread_ratio
from labkit.icp import icp
from labkit.odometry.free_space import seen_through
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.sanity import motion_complaints, quality_complaints
from labkit.odometry.search import alike, field_of, search
from labkit.parameters import IcpParameters
from labkit.scan import Scan
from labkit.se2 import from_xytheta, invert, to_xytheta
from labkit.target import Target

STILL = np.zeros(3)
AT_TARGET = np.eye(3)
NEAR = 0.16  # [m]: the gate that a match of the odometry's own parameters ends with
AS_WELL = 0.1  # scores that differ by less do not tell which of two matches is right


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
        The older one, or the map; None where it has no points.
    prior : ndarray, shape (3,), or None
        Expected increment from wheels or an IMU.
    last_motion : ndarray, shape (3,)
        The increment of the step before: guess and last resort without a prior.
    parameters : OdometryParameters
        Matcher, limits and fallbacks.
    T_target_last : ndarray, shape (3, 3)
        Where scan k was taken in the target's frame; the identity where it is the target.

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

    pair = _Pair(source, target, T_target_last, prior, parameters)
    tried = [pair.match(guess, Decision.ICP)]
    if tried[0].complaints:
        tried.append(pair.match(guess, Decision.RETRY))
    as_well = AS_WELL if parameters.search else math.inf  # the lesson's chain: whoever passes
    best = _best(tried, as_well)
    if parameters.search and (best.complaints or best.score < parameters.search_below):
        first = best
        tried += pair.matches_from_search()
        best = _best(tried, as_well)
        if best.complaints and not first.complaints:
            best = first  # doubtful, but nothing that can be believed is better
    rest = [each for each in tried if not alike(each.T_target_source, best.T_target_source)]
    believed = not best.complaints
    return replace(
        best.record,
        increment=best.record.increment if believed else guess,
        decision=best.record.decision if believed else last_resort,
        margin=best.score - max((each.score for each in rest), default=math.nan),
        reason="; ".join(each.reason for each in tried if each.complaints),
    )


@dataclass(frozen=True, eq=False)
class _Match:
    """A match that was tried: its record, the checks that it fails, and where it ended.

    Its score says how well it agrees with the target: the share of the source that lies
    within `NEAR` of it, less the share of what is in view that contradicts it.
    """

    record: StepRecord
    complaints: list[str]
    T_target_source: FloatArray
    score: float

    @property
    def reason(self) -> str:
        return f"{self.record.decision.value}: {', '.join(self.complaints)}"


def _best(tried: list[_Match], as_well: float) -> _Match:
    """The match that agrees best; of those that agree about as well, the first to be tried.

    That is the one nearest to the guess. Scores that differ by up to `as_well` count alike; a
    match that passes the checks goes before one that does not, but only among these.
    """
    most = max(each.score for each in tried)
    alike_good = [each for each in tried if each.score >= most - as_well]
    return next((each for each in alike_good if not each.complaints), alike_good[0])


@dataclass(frozen=True, eq=False)
class _Pair:
    """What all matches of a step have in common."""

    source: Scan
    target: Target
    T_target_last: FloatArray
    prior: FloatArray | None
    parameters: OdometryParameters

    def matches_from_search(self) -> Iterator[_Match]:
        """ICP from the best starts of a search, which looks wherever a step may end."""
        limits = self.parameters.limits
        if self.prior is None:
            middle, window = STILL, (limits.max_translation, limits.max_rotation)
        else:
            middle = self.prior
            window = limits.max_prior_translation, limits.max_prior_rotation
        starts = search(
            self.source,
            field_of(self.target),
            self.T_target_last @ from_xytheta(middle),
            window,
            self.parameters.search_starts,
        )
        for start in starts:
            guess = to_xytheta(invert(self.T_target_last) @ start.T_target_source)
            yield self.match(guess, Decision.SEARCH)

    def match(self, guess: FloatArray, decision: Decision) -> _Match:
        """Match once; the record of it, and every sanity check that it fails."""
        matcher = self.parameters.retry if decision is Decision.RETRY else self.parameters.icp
        limits = self.parameters.limits
        T_guess = self.T_target_last @ from_xytheta(guess)
        result = icp(self.source, self.target, T_guess, matcher, engine=self.parameters.engine)
        increment = to_xytheta(invert(self.T_target_last) @ result.T_target_source)
        information, degenerate = math.nan, False
        through, score = math.nan, -math.inf
        if result.termination.failed:
            complaints = [result.message]
        else:
            seen = result.observability
            information = 0.0 if seen is None else float(seen.values[0])
            degenerate = information < limits.min_information
            through = seen_through(self.source, self.target.points, result.T_target_source)
            pairs = result.correspondences
            score = float(np.mean(pairs.kept & (pairs.distances <= NEAR)))
            score -= 0.0 if math.isnan(through) else through
            complaints = motion_complaints(increment, self.prior, limits)
            complaints += quality_complaints(result.fitness, result.inlier_rmse, limits)
        if degenerate and not self._keeps_the_prior(matcher, decision):
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
            spread=spread_ratio(self.source, _seen_from_the_end(increment)),
            iterations=result.iterations,
            degenerate=degenerate,
            termination=result.termination,
        )
        return _Match(record, complaints, result.T_target_source, score)

    def _keeps_the_prior(self, matcher: IcpParameters, decision: Decision) -> bool:
        """Whether a match leaves a free direction of the motion where the prior puts it.

        From a start of the search it stays where that put it.
        """
        from_prior = self.prior is not None and decision is not Decision.SEARCH
        return from_prior and matcher.metric == "point_to_line"


def _seen_from_the_end(increment: FloatArray) -> FloatArray:
    """The motion (Δx, Δy) in the frame of scan k+1, as the newer scan sees it."""
    x, y, turn = increment.tolist()
    c, s = math.cos(turn), math.sin(turn)
    return np.array([c * x + s * y, c * y - s * x])
