"""One step of odometry: the lesson's second flow chart, with its fallbacks in a stated order.

A  `_Step.match`      ICP from the prior, or from the last motion where there is none
B  `_Step.judged`     the increment (Δx, Δy, Δψ) in the frame of scan k
C  `integrate_step`   the pose, in `labkit.odometry.integration`
D  `_Step.judged`     the sanity checks; `_Step.choose`: the best of several matches
E  `estimate_step`    the match that is believed
F  `_Step.fall_back`  reduced steps, or a search; `estimate_step`: the prior, or skip

1. ICP from the prior, or from the last motion.
2. Where that match is not believed, or agrees too little with the target: a search, and ICP
   from its peaks. Without the search: once more, with a reduced gate and reduced steps.
3. Where no match near the prior has support: the same as if there were no prior. A match that
   has, and that is alone, is believed against it.
4. The prior; without one, skip the update: hold the last motion once, or stand still.

If a scan fits in several places within the limits, the match is not a measurement: the prior
is taken, where there is one. Motions that no wall fixes, such as the way along a corridor, are
taken from the prior or, with the search, from the last motions; without either the step is not
believed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from labkit.arrays import FloatArray
from labkit.correspondences import MIN_PAIRS, loss
from labkit.degeneracy import spread_ratio
from labkit.icp import icp
from labkit.odometry.agreement import THROUGH, beams_of, seen_through
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.sanity import complaints
from labkit.odometry.search import STARTS, alike, apart, completed, search, unlikeliness
from labkit.parameters import IcpParameters
from labkit.result import IcpResult, Termination
from labkit.scan import Scan
from labkit.schedule import stage_of
from labkit.se2 import from_xytheta, invert, to_xytheta
from labkit.target import Target

STILL = np.zeros(3)
AT_TARGET = np.eye(3)
SUPPORTED, SURE = 0.5, 0.8  # agreement that asks for no search, with a prior and without
SURPRISE = 0.1  # of agreement, that a motion costs which is unlike any that was expected
SAME = 0.01  # scores that differ by less: whichever was tried first
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
        return self in (Decision.ICP, Decision.RETRY, Decision.SEARCH)


@dataclass(frozen=True, eq=False, kw_only=True)
class StepRecord:
    """Record of one step: its decision and reason, the numbers of its best match (NaN without one).

    Attributes
    ----------
    increment, decision : ndarray, shape (3,), and Decision
        (Δx, Δy, Δψ) taken, in the frame of scan k, [m, m, rad], and where it came from.
    reason : str
        The checks that failed on the way; empty where the first match passed.
    inlier_count, inlier_ratio, rotation : float
        Kept pairs, their share of the source, and the match's |Δψ| [rad].
    rmse, cost : float
        Root mean square of the kept pairs' residuals [m], and the truncated Huber cost J [m²].
    seen_through : float
        Share of the target's points in view that the scan's beams look through.
    agreement : float
        1 where all of the scan lies on the target, 0 where none does, and less where its beams
        look through the target; −∞ where the match failed.
    margin, ambiguous : float, bool
        By how much the match agrees better than the best one elsewhere that passes the checks,
        NaN without one; and whether that is too little to tell which is right.
    against_prior : bool
        Whether the match was believed although it lies beyond the limits around the prior.
    information, degenerate : float, bool
        Smallest eigenvalue of the information, and whether a direction is free.
    spread : float
        The lesson's cheap corridor test; see `labkit.degeneracy.spread_ratio`.
    iterations, termination : int, Termination or None
        ICP steps of the match, and how it ended.
    """

    increment: FloatArray
    decision: Decision
    reason: str = ""
    inlier_count: int = 0
    inlier_ratio: float = math.nan
    rmse: float = math.nan
    cost: float = math.nan
    seen_through: float = math.nan
    agreement: float = math.nan
    margin: float = math.nan
    ambiguous: bool = False
    against_prior: bool = False
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
    motions: FloatArray,
    parameters: OdometryParameters,
    *,
    T_target_last: FloatArray = AT_TARGET,
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
    """
    likely = np.atleast_2d(motions if prior is None else prior)
    last_resort = Decision.HOLD if likely[0].any() else Decision.STAND
    last_resort = last_resort if prior is None else Decision.PRIOR
    resort = StepRecord(increment=likely[0], decision=last_resort)
    if target is None or len(source) < MIN_PAIRS:
        which = "older" if target is None else "newer"
        return replace(resort, reason=f"the {which} scan has fewer than {MIN_PAIRS} points")

    expected = T_target_last @ from_xytheta(likely)
    step = _Step(source, target, T_target_last, prior, expected, parameters)
    tried = [step.match(expected[0], Decision.ICP)]
    if tried[0].complaints or step.is_doubtful(tried[0]):
        step.fall_back(tried)
    best = step.choose(tried)
    shift, R = best.record.increment[:2], from_xytheta(best.record.increment)[:2, :2]
    record = replace(best.record, spread=spread_ratio(source, R.T @ shift))
    believed = not best.complaints and not (record.ambiguous and prior is not None)
    if prior is not None and parameters.search and (not believed or step.is_doubtful(best)):
        alone = estimate_step(
            source, target, None, motions, parameters, T_target_last=T_target_last
        )
        if alone.decision.matched and alone.agreement >= SUPPORTED and not alone.ambiguous:
            against = complaints(
                alone.increment, alone.inlier_ratio, alone.rmse, parameters.limits, prior
            )
            return replace(alone, reason=record.reason, against_prior=bool(against))
    if believed:
        return record  # E
    return replace(record, increment=resort.increment, decision=resort.decision)  # F


@dataclass(frozen=True, eq=False)
class _Match:
    """A match that was tried, where it ended, and the sanity checks that it fails."""

    record: StepRecord
    T_target_source: FloatArray  # NaN where it failed
    complaints: list[str]
    score: float = -math.inf  # the agreement, less by how much the motion surprises


@dataclass(frozen=True, eq=False)
class _Step:
    """Context of all matches of a step; `expected` are poses, the likeliest first."""

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
        elsewhere = self.parameters.search and (self.prior is None or decision is Decision.SEARCH)
        if elsewhere and self._on_lines and seen is not None and seen.degenerate:
            T_guess = completed(result.T_target_source, seen, self.expected)
            result = icp(self.source, self.target, T_guess, told)
        return self.judged(result, decision)

    def judged(self, result: IcpResult, decision: Decision) -> _Match:
        """The motion of a match (B), and every sanity check that it fails (D)."""
        T, told, limits = result.T_target_source, result.parameters, self.parameters.limits
        increment = to_xytheta(invert(self.T_target_last) @ T)
        record = StepRecord(
            increment=increment,
            decision=decision,
            inlier_count=result.inlier_count,
            inlier_ratio=result.fitness,
            cost=result.cost,
            agreement=-math.inf,
            rotation=abs(float(increment[2])),
            iterations=result.iterations,
            termination=result.termination,
        )
        if result.termination.failed:
            return _Match(record, T, [result.message])
        pairs, seen = result.correspondences, result.observability
        through = seen_through(*self._view, np.array(T))
        agreement = 1.0 - result.cost / _worst_cost(told)
        agreement -= THROUGH * (0.0 if math.isnan(through) else through)
        record = replace(
            record,
            rmse=math.sqrt(np.mean(pairs.residuals[pairs.kept] ** 2)),
            seen_through=through,
            agreement=agreement,
            information=0.0 if seen is None else float(seen.values[0]),
            degenerate=seen is None or seen.degenerate,
        )
        found = complaints(increment, result.fitness, record.rmse, limits, self.prior)
        is_expected = self.prior is not None or self.parameters.search
        if record.degenerate and not (self._on_lines and is_expected):
            found.append(f"degenerate: information {record.information:.3f}")
        score = agreement - SURPRISE * unlikeliness(T, self.expected)
        return _Match(record, T, found, score)

    def is_doubtful(self, match: _Match) -> bool:
        """True if a search should say if there is a better match than one that passes."""
        asked = SURE if self.prior is None else SUPPORTED
        return self.parameters.search and match.record.agreement < asked

    def fall_back(self, tried: list[_Match]) -> None:
        """Add a match with reduced steps (F), or from a search's starts where none has ended."""
        limits, middle = self.parameters.limits, self.expected[0]
        window = limits.max_prior_translation, limits.max_prior_rotation
        if not self.parameters.search:
            tried.append(self.match(middle, Decision.RETRY))
            return
        if self.prior is None:
            middle, window = self.T_target_last, (limits.max_translation, limits.max_rotation)
        found = search(self.source, self.target, middle, window)
        for T_guess in [*apart(self.expected, STARTS // 2), *found]:
            if not any(alike(T_guess, each.T_target_source) for each in tried):
                tried.append(self.match(T_guess, Decision.SEARCH))

    def choose(self, tried: list[_Match]) -> _Match:
        """The best match, compared with those that ended elsewhere.

        With a search, a match with a complaint must be better than those without by `ALIKE`.
        """
        best = tried[-1]
        if self.parameters.search:
            scores = [each.score - ALIKE * bool(each.complaints) for each in tried]
            best = tried[int(np.argmax(np.array(scores) >= max(scores) - SAME))]
        others = [
            each.record.agreement
            for each in tried
            if not each.complaints and not alike(best.T_target_source, each.T_target_source)
        ]
        margin = best.record.agreement - max(others, default=math.nan)
        ambiguous = self.parameters.search and not best.complaints and margin < ALIKE
        bad = [each for each in tried if each.complaints]
        reasons = [f"{each.record.decision.value}: {', '.join(each.complaints)}" for each in bad]
        if ambiguous:
            reasons.append(f"ambiguous: it fits elsewhere, too ({margin:+.3f})")
        told = replace(best.record, margin=margin, ambiguous=ambiguous, reason="; ".join(reasons))
        return replace(best, record=told)

    @cached_property
    def _view(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return *beams_of(self.source), np.array(self.target.points)

    @property
    def _on_lines(self) -> bool:
        return self.parameters.icp.metric == "point_to_line"


def _worst_cost(parameters: IcpParameters) -> float:
    """The cost J [m²] of a scan without any partner near the answer (4.1)."""
    near = stage_of(parameters.for_loop, 1, False, True)
    return loss(near.gate, near.huber_delta) if near.gate < math.inf else math.inf
