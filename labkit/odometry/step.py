"""One step of odometry: the lesson's second flow chart, with its fallbacks in a stated order.

A  `_Step.match`      ICP from the prior, or from the last motion where there is none
B  `_Step.judged`     the increment (Δx, Δy, Δψ) in the frame of scan k
C  `integrate_step`   the pose, in `labkit.odometry.integration`
D  `_Step.judged`     the sanity checks; `_choose`: the best of several matches
E  `_published`       the match that is believed
F  `_Step.fall_back`  reduced steps, or a search; `_published`: the prior, or skip

1. ICP from the prior, or from the last motion.
2. Where there is no prior, or the match is not believed or doubtful: a search, and ICP from
   its best starts. Without the search, the lesson's chain: a failed match is tried once more
   with a reduced gate and reduced steps.
3. Where no match passes near the prior: a search as if there were no wheels. A match that is
   alone and well supported is believed against a prior that nothing supports.
4. The prior; without one, skip the update: hold the last motion, or stand still where there
   is none to hold (a motion is held once) or `on_skip` says so.

Of several matches, the checks judge the one that agrees best with the target and deviates
least from the expected motion (`labkit.odometry.expectation`). If the best one lies half a
metre beyond a limit, a worse one within the limit is no better. If a scan fits in several
places within the limits, the match is not a measurement: the prior is taken, and without one
the place nearest to the expected motion. Motions that no wall fixes, such as the way along a
corridor, are taken from the prior or, with the search, from the last motions; without either
the step is not believed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from labkit.arrays import FloatArray
from labkit.correspondences import MIN_PAIRS
from labkit.degeneracy import spread_ratio
from labkit.icp import icp
from labkit.odometry.agreement import THROUGH, beams_of, look_through, misfit
from labkit.odometry.expectation import completed, unlikeliness
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.sanity import motion_complaints, quality_complaints
from labkit.odometry.search import STARTS, alike, apart, field_of, search
from labkit.result import IcpResult
from labkit.scan import Scan
from labkit.schedule import CLOSE_GATE
from labkit.se2 import from_xytheta, invert, to_xytheta
from labkit.target import Target

STILL = np.zeros(3)
AT_TARGET = np.eye(3)
NOTHING = np.empty((0, 3))
DOUBTFUL = 0.6  # agreement below which a search says if there is a better match
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
    """
    skipped = last_motion if parameters.on_skip == "hold" else STILL
    guess, last_resort = prior, Decision.PRIOR
    if guess is None:
        guess, last_resort = skipped, Decision.HOLD if skipped.any() else Decision.STAND
    resort = StepRecord(increment=guess, decision=last_resort)
    if target is None or len(source) < MIN_PAIRS:
        which = "older" if target is None else "newer"
        return replace(resort, reason=f"the {which} scan has fewer than {MIN_PAIRS} points")

    likely = np.vstack([skipped, earlier_motions]) if prior is None else guess[None]
    expected = T_target_last @ from_xytheta(likely)
    step = _Step(source, target, T_target_last, prior, expected, parameters)
    tried = [step.match(expected[0], Decision.ICP)]
    if tried[0].complaints or step.is_doubtful(tried[0]):
        step.fall_back(tried)
    choice = _choose(tried, step)
    if choice.best.complaints and prior is not None and parameters.search:
        likely = np.vstack([skipped, earlier_motions])
        alone = replace(step, prior=None, expected=T_target_last @ from_xytheta(likely))
        again = [alone.judged(each.result, each.decision) for each in tried]
        alone.fall_back(again)
        witness = _choose(again, alone)
        if witness.measures_all:
            why = f"{choice.reason}; believed against the prior: alone, and well supported"
            choice = replace(witness, reason=why, against_prior=True)
    return _published(choice, source, resort)


@dataclass(frozen=True, eq=False)
class _Match:
    """A match that was tried, where it ended, and the sanity checks that it fails."""

    decision: Decision
    result: IcpResult
    increment: FloatArray
    complaints: list[str]
    agreement: float = -math.inf
    score: float = -math.inf  # the agreement, less by how much the motion surprises
    rmse: float = math.nan
    through: float = math.nan
    information: float = math.nan
    degenerate: bool = False

    @property
    def T_target_source(self) -> FloatArray:
        return self.result.T_target_source


@dataclass(frozen=True, eq=False)
class _Choice:
    """The best of the matches that were tried, and whether it is believed."""

    best: _Match
    margin: float
    ambiguous: bool
    believed: bool
    reason: str
    against_prior: bool = False

    @property
    def measures_all(self) -> bool:
        """Whether it is alone, and well supported in every direction."""
        supported = self.best.agreement >= DOUBTFUL and not self.best.degenerate
        return self.believed and supported and not self.ambiguous


@dataclass(frozen=True, eq=False)
class _Step:
    """What all matches of a step have in common; `expected` are poses, the likeliest first."""

    source: Scan
    target: Target
    T_target_last: FloatArray
    prior: FloatArray | None
    expected: FloatArray
    parameters: OdometryParameters

    def match(self, T_guess: FloatArray, decision: Decision) -> _Match:
        """Match once (A), and judge the outcome."""
        told = self.parameters.retry if decision is Decision.RETRY else self.parameters.icp
        result = icp(self.source, self.target, T_guess, told)
        seen = result.observability
        # From a prior, a free direction stays there; from elsewhere it is put where expected.
        from_prior = self.prior is not None and decision is not Decision.SEARCH
        if seen is not None and seen.degenerate and not from_prior and self._completes:
            T_guess = completed(result.T_target_source, seen, self.expected)
            result = icp(self.source, self.target, T_guess, told)
        return self.judged(result, decision)

    def judged(self, result: IcpResult, decision: Decision) -> _Match:
        """The motion of a match (B), and every sanity check that it fails (D)."""
        T, told, limits = result.T_target_source, result.parameters, self.parameters.limits
        increment = to_xytheta(self._T_last_target @ T)
        if result.termination.failed:
            return _Match(decision, result, increment, [result.message])
        pairs, seen = result.correspondences, result.observability
        gate, delta = told.max_correspondence_distance, told.huber_delta
        gate = min(gate, CLOSE_GATE * delta) if told.approach else gate
        through = look_through(*self._beams, self._walls, np.array(T))
        agreement = 1.0 - misfit(np.array(pairs.distances), np.array(pairs.residuals), gate, delta)
        agreement -= THROUGH * (0.0 if math.isnan(through) else through)
        rmse = math.sqrt(np.mean(pairs.residuals[pairs.kept] ** 2))
        information = 0.0 if seen is None else float(seen.values[0])
        degenerate = seen is None or seen.degenerate
        complaints = motion_complaints(increment, self.prior, limits)
        complaints += quality_complaints(result.fitness, rmse, limits)
        stays = told.metric == "point_to_line" and (self.prior is not None or self._completes)
        if degenerate and not stays:
            complaints.append(f"degenerate: information {information:.3f}")
        score = agreement - SURPRISE * unlikeliness(T, self.expected)
        numbers = agreement, score, rmse, through, information
        return _Match(decision, result, increment, complaints, *numbers, degenerate)

    def is_doubtful(self, match: _Match) -> bool:
        """Whether a search should say if there is a better match than one that passes."""
        return self.parameters.search and (self.prior is None or match.agreement < DOUBTFUL)

    def fall_back(self, tried: list[_Match]) -> None:
        """Add a match with reduced steps, or those from the best starts of a search (F).

        A start is passed over that lies where another match has ended.
        """
        limits, middle = self.parameters.limits, self.expected[0]
        window = limits.max_prior_translation, limits.max_prior_rotation
        if not self.parameters.search:
            tried.append(self.match(middle, Decision.RETRY))
            return
        if self.prior is None:
            middle, window = self.T_target_last, (limits.max_translation, limits.max_rotation)
        found = search(self.source, field_of(self.target), middle, window)
        for T_guess in [*apart(self.expected, STARTS // 2), *found]:
            if not any(alike(T_guess, each.T_target_source) for each in tried):
                tried.append(self.match(T_guess, Decision.SEARCH))

    @cached_property
    def _T_last_target(self) -> FloatArray:
        return invert(self.T_target_last)

    @cached_property
    def _beams(self) -> tuple[FloatArray, FloatArray]:
        return beams_of(self.source)

    @cached_property
    def _walls(self) -> FloatArray:
        return np.array(self.target.points)

    @property
    def _completes(self) -> bool:
        """Whether a free direction is put where the last motions suggest."""
        return self.parameters.search and self.parameters.icp.metric == "point_to_line"


def _choose(tried: list[_Match], step: _Step) -> _Choice:
    """Choose the best match, and compare it with those that ended elsewhere (D)."""
    good = [each for each in tried if not each.complaints]
    best = _best(tried) if step.parameters.search else (good or tried)[-1]
    others = [
        each.agreement for each in good if not alike(each.T_target_source, best.T_target_source)
    ]
    margin = best.agreement - max(others) if others else math.nan
    ambiguous = step.parameters.search and not best.complaints and margin < ALIKE
    reasons = [
        f"{bad.decision.value}: {', '.join(bad.complaints)}" for bad in tried if bad.complaints
    ]
    if ambiguous:
        reasons.append(f"ambiguous: it fits elsewhere, too ({margin:+.3f})")
    believed = not best.complaints and not (ambiguous and step.prior is not None)
    return _Choice(best, margin, ambiguous, believed, "; ".join(reasons))


def _best(tried: list[_Match]) -> _Match:
    """The match with the highest score.

    Or one that is about as good and passes the checks; or an earlier one that ended there.
    """
    best = max(tried, key=lambda each: each.score)
    good = [each for each in tried if not each.complaints]
    if best.complaints:
        return next((each for each in good if each.score > best.score - ALIKE), best)
    there = [each for each in good if alike(each.T_target_source, best.T_target_source)]
    return next(each for each in there if each.score > best.score - SAME)


def _published(choice: _Choice, source: Scan, resort: StepRecord) -> StepRecord:
    """The record of the match that is believed (E), or of the last resort (F)."""
    best, result = choice.best, choice.best.result
    x, y, turn = best.increment.tolist()
    c, s = math.cos(turn), math.sin(turn)
    from_the_end = [c * x + s * y, c * y - s * x]  # the motion, as the newer scan sees it
    return StepRecord(
        increment=best.increment if choice.believed else resort.increment,
        decision=best.decision if choice.believed else resort.decision,
        reason=choice.reason,
        inlier_count=result.inlier_count,
        inlier_ratio=result.fitness,
        rmse=best.rmse,
        cost=result.cost,
        seen_through=best.through,
        agreement=best.agreement,
        margin=choice.margin,
        ambiguous=choice.ambiguous,
        against_prior=choice.against_prior,
        rotation=abs(turn),
        information=best.information,
        spread=math.nan if result.termination.failed else spread_ratio(source, from_the_end),
        iterations=result.iterations,
        degenerate=best.degenerate,
        termination=result.termination,
    )
