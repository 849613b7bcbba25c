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

A match lies within the window around the prior; a doubtful one as near to it as sure matches
usually lie. Or it overrides the prior: with an agreement of 0.5, if it is like one of the last
motions, and the prior clearly less so. What is carried along is left out where the rest agrees
better. If a scan fits in several places, the match is not a measurement: the prior is taken, where
there is one. Motions that no wall fixes, such as the way along a corridor, are taken from the prior
or, with the search, from the last motions, unless the scan fits clearly less well there. Without
the search, the lesson's checks hold as they are. Over several steps the estimator decides: it puts
a match aside where the wheels lead, and goes back to one that was refused if the next scan fits
from there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.covariance import fuse
from labkit.degeneracy import spread_ratio
from labkit.icp import icp
from labkit.odometry.agreement import agreement_of
from labkit.odometry.carried import carried, stands
from labkit.odometry.local_map import LocalMap
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import STILL, SUPPORTED, Decision, StepRecord
from labkit.odometry.sanity import SanityLimits, Trust, fit_failures, limit_failures
from labkit.odometry.search import STARTS, alike, apart, completed, search, surprise
from labkit.result import IcpResult
from labkit.scan import Scan
from labkit.se2 import from_xytheta, invert, rotation, to_xytheta, wrap
from labkit.support.arrays import FloatArray, as_pose, as_poses
from labkit.support.errors import DegenerateAlignmentError
from labkit.target import Target

RANGE_STD = 0.01  # [m] of a range, at least
NO_LIMIT = 1e3  # [m] or [rad]: a motion without limit counts as one of this length
SURE = 0.8  # agreement that asks for no search without a usual prior
SURPRISE = 0.1  # of agreement, that a motion costs which is unlike any that was expected
ODD, CLEARLY = 4.0, 2.0  # surprise: too much for a match; by which a prior exceeds a match's
UNUSUAL = 1.0  # surprise of a prior whose match must be sure, or a search is asked for
NEW = Trust()  # of a run that begins
SAME = 0.01  # scores closer than this tie; the first tried wins
ALIKE = 0.05  # agreements that differ by less do not tell which of two matches is right


def estimate_step(
    source: Scan,
    target: Target | LocalMap | None,
    prior: FloatArray | None,
    motions: FloatArray,
    parameters: OdometryParameters,
    trust: Trust = NEW,
) -> StepRecord:
    """Estimate the motion from scan k to scan k+1 (`source`).

    Parameters
    ----------
    source : Scan
        The newer scan, filtered.
    target : Target, LocalMap or None
        The older scan, None without points, or the map. Points that lie as they did in the map's
        newest key scan, while the prior moves, are carried along, and left out.
    prior : ndarray, shape (3,), or None
        Expected increment from wheels or an IMU.
    motions : ndarray, shape (3,) or (K, 3)
        Increments of the steps before, the newest first. Without a prior the first is the guess
        and the last resort, and all are likely.
    parameters : OdometryParameters
        Matcher, limits and fallbacks.
    trust : Trust, optional
        How far sure matches lay from the wheels before.
    """
    seen = target if isinstance(target, LocalMap) else LocalMap(target=target)
    prior = None if prior is None else as_pose(prior, "prior")
    likely = as_poses(np.atleast_2d(motions), "motions")
    resort = unmatched(prior, likely[0], parameters.limits)
    likely = likely if prior is None else np.vstack([prior, likely])
    if seen.target is None or len(source) < MIN_PAIRS:
        which = "older" if seen.target is None else "newer"
        reason = f"the {which} scan has fewer than {MIN_PAIRS} points"
        return StepRecord(**resort, reason=reason)

    expected = seen.T_target_last @ from_xytheta(likely)
    step = _Step(source, seen.target, seen.T_target_last, prior, expected, parameters, trust)
    tried = [step.match(expected[0], Decision.ICP)]
    if prior is not None and seen.key is not None and parameters.search:
        is_near = not tried[0].complaints and not tried[0].record.against_prior
        here, still = tried[0].T_target_source if is_near else expected[0], stands(source, seen.key)
        for T in (here, seen.T_target_told @ from_xytheta(prior)):
            if (off := carried(source, still, seen.target, T)).any():
                other = replace(step, source=source.select(~off))
                again = other.match(expected[0], Decision.ICP)
                if again.record.agreement > tried[0].record.agreement:
                    step, tried = other, [again]
    if step.asks_for_more(tried[0]):
        tried += step.fall_back()
    best = step.choose(tried)
    x, y, heading = best.record.increment
    record = replace(best.record, spread=spread_ratio(source, rotation(heading).T @ [x, y]))
    if best.result is None or best.complaints or (record.ambiguous and prior is not None):  # F
        told = parameters.search and prior is not None
        if told and surprise(best.T_target_source, expected).min() < ODD:
            resort["refused"] = best.record.increment
        return replace(record, **resort)
    covariance = covariance_of(best.result, resort["covariance"], seen.T_target_last)
    return replace(record, covariance=covariance)  # E


def unmatched(
    prior: FloatArray | None, last_motion: FloatArray, limits: SanityLimits
) -> dict[str, Any]:
    """The motion, in a record's fields, of a step whose match is not believed."""
    shift, turn = limits.window if prior is None else limits.prior_window
    held = Decision.HOLD if last_motion.any() else Decision.STAND
    return {
        "increment": np.array(last_motion if prior is None else prior),
        "decision": held if prior is None else Decision.PRIOR,
        "covariance": np.diag(np.minimum([shift, shift, turn], NO_LIMIT) / 3.0) ** 2,
        "against_prior": False,
        "refused": None,
    }


def covariance_of(result: IcpResult, wide: FloatArray, T_target_last: FloatArray) -> FloatArray:
    """Covariance (3, 3) of an increment: Censi's where a match sees, `wide` where it does not."""
    J = np.eye(3)  # from the target's axes to those of scan k
    J[:2, :2] = T_target_last[:2, :2].T
    try:
        return np.asarray(J @ fuse(result, RANGE_STD, STILL, wide)[1] @ J.T)
    except DegenerateAlignmentError:
        return wide


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
    trust: Trust = NEW

    def match(self, T_guess: FloatArray, decision: Decision) -> _Match:
        """Match once (A), and judge the outcome."""
        told = self.parameters.retry if decision is Decision.RETRY else self.parameters.icp
        return self.judged(icp(self.source, self.target, T_guess, told), decision)

    def completed(self, found: _Match) -> _Match:
        """The match, moved along what it leaves free to where it is expected.

        It stays where it is if the scan fits clearly worse there.
        """
        seen = found.result.observability if found.result else None
        if seen is None or not seen.degenerate:
            return found
        T = completed(found.T_target_source, seen, self.expected_of(found.record))
        there = self.match(T, found.record.decision)
        return there if there.record.agreement > found.record.agreement - ALIKE else found

    def judged(self, result: IcpResult, decision: Decision) -> _Match:
        """The motion of a match (B), and every sanity check that it fails (D)."""
        T, limits, search = result.T_target_source, self.parameters.limits, self.parameters.search
        increment = to_xytheta(invert(self.T_target_last) @ T)
        record = StepRecord(
            increment=increment,
            decision=decision,
            reason=result.message,
            inlier_count=result.inlier_count,
            inlier_ratio=result.fitness,
            agreement=-math.inf,
            rotation=abs(float(increment[2])),
            iterations=result.iterations,
            termination=result.termination,
        )
        if result.termination.failed:
            return _Match(record, T, [result.message])
        pairs, seen = result.correspondences, result.observability
        rmse = math.sqrt(np.mean(pairs.residuals[pairs.kept] ** 2))
        agreement, through = agreement_of(result)
        against = []
        if self.prior is not None:
            doubtful = search and agreement < SUPPORTED
            window = self.trust.window(limits, self.prior) if doubtful else limits.prior_window
            off = increment - self.prior
            off[2] = wrap(off[2])
            against = limit_failures(off, window, " from the prior")
        overrides = bool(against and search and agreement >= SUPPORTED) and self.yields(T)
        found = fit_failures(result.fitness, rmse, limits)
        if self.prior is None or against or not search:
            found += limit_failures(increment, limits.window)
        free, information = seen is None or seen.degenerate, 0.0 if seen is None else seen.values[0]
        is_told = self.prior is not None or search
        if free and not (is_told and result.parameters.metric == "point_to_line"):
            found.append(f"degenerate: information {information:.3f}")
        record = replace(
            record,
            reason=", ".join([*found, *against]),
            rmse=rmse,
            seen_through=through,
            agreement=agreement,
            against_prior=overrides,
            information=float(information),
            degenerate=free,
        )
        unlike = surprise(T, self.expected_of(record)).min()
        score = agreement - SURPRISE * unlike / (1.0 + unlike)
        return _Match(record, T, found if overrides else [*found, *against], score, result)

    def expected_of(self, record: StepRecord) -> FloatArray:
        """The poses that are expected of a match near the prior, or of one against it."""
        if self.prior is None:
            return self.expected
        return self.expected[1:] if record.against_prior else self.expected[:1]

    def yields(self, T: FloatArray) -> bool:
        """True if a prior far from a match at T is clearly more unlike the last motions."""
        T_prior, last = self.expected[0], self.expected[1:]
        here, there = surprise(T, last).min(), surprise(T_prior, last).min()
        return bool(here < ODD and there > here + CLEARLY)

    def asks_for_more(self, match: _Match) -> bool:
        """True if there may be a better match than this first one."""
        record, (prior, *last) = match.record, self.expected
        unusual = self.prior is not None and surprise(prior, np.array(last)).min() > UNUSUAL
        asked = SURE if self.prior is None or unusual else SUPPORTED
        untold = record.against_prior or (record.degenerate and self.prior is None)
        weak = untold or record.agreement < asked
        return bool(match.complaints) or (self.parameters.search and weak)

    def fall_back(self) -> list[_Match]:
        """A match with reduced steps (F), or those from a search's starts."""
        if not self.parameters.search:
            return [self.match(self.expected[0], Decision.RETRY)]
        limits, others = self.parameters.limits, apart(self.expected, STARTS)[1:]
        found = search(self.source, self.target, self.T_target_last, limits.window)
        if self.prior is not None:  # finer, where the wheels lead
            found += search(self.source, self.target, self.expected[0], limits.prior_window)
        tried = [self.match(T_guess, Decision.SEARCH) for T_guess in [*others, *found]]
        kept = len(others) if self.prior is None else 0
        return tried[:kept] + [self.completed(each) for each in tried[kept:]]

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
