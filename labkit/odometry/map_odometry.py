"""The lab's own odometry: propose, match, score, choose, against a map of the last key scans.

propose   where the robot may be: by the wheels or the last motions, and by a search
match     ICP from each of these places
score     how well the scan lies on the map there, and how unexpected the motion is  (5.3)
choose    the highest score; the wheels' own pose, or the last motion, may tell more
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.odometry.base import Odometry
from labkit.odometry.choose import (
    GOOD_MEAN_SCORE,
    MIN_SCORE,
    SCORE_HISTORY,
    choose,
    min_score,
)
from labkit.odometry.integration import integrate_step
from labkit.odometry.local_map import LocalMap
from labkit.odometry.match import Match, match, stay
from labkit.odometry.propose import expect, propose
from labkit.odometry.record import STILL, Decision, Evidence, StepRecord, no_match, record_of_match
from labkit.odometry.sanity import SanityLimits, prior_failures, unknown_std
from labkit.odometry.wheels import SCALE_HISTORY, believable_wheels, is_frozen, scale_of
from labkit.scan import Scan
from labkit.se2 import from_xytheta, invert, relative, to_xytheta
from labkit.support.arrays import FloatArray
from labkit.target import Target

NOTHING = Scan.from_points(np.empty((0, 2)))
FROZEN = "the scan repeats the one before while the wheels moved: does the scanner hang?"
MOTION_HISTORY = 20  # motions that a later step may repeat


class MapState(NamedTuple):
    """State of the lab's odometry between two scans."""

    pose: FloatArray
    scans: int = 0
    map: LocalMap = LocalMap()
    last_scan: Target | None = None  # the last one with points
    last_motion: FloatArray = STILL
    motions: tuple[FloatArray, ...] = ()  # that matches measured, the newest first
    lost: int = 0  # steps since the last match
    T_last_refused: FloatArray | None = None  # where the last match ended, if it was refused
    scores: tuple[float, ...] = ()  # of the best matches beside wheels, the newest first
    scales: tuple[float, ...] = ()  # of the wheels, that matches measured, the newest first

    def after(self, record: StepRecord, scan: Scan) -> MapState:
        """The state after a step."""
        matched = record.decision.matched
        increment = record.increment
        is_held = record.decision in (Decision.HOLD, Decision.STAND)
        motions = self.motions
        scales = self.scales
        if matched and not record.degenerate:
            motions = (increment, *motions)
            scale = math.nan if record.prior is None else scale_of(record.prior, increment)
            if not math.isnan(scale):
                scales = (scale, *scales)
        scores = self.scores
        if record.prior is not None and not math.isnan(record.score):
            scores = (max(0.0, record.score), *scores)
        return MapState(
            pose=integrate_step(self.pose, increment),
            scans=self.scans + 1,
            map=self.map.advance(scan, increment, record.prior, matched=matched),
            last_scan=Target(scan) if len(scan) >= MIN_PAIRS else self.last_scan,
            last_motion=STILL if is_held else increment,  # hold a motion only once
            motions=motions[:MOTION_HISTORY],
            lost=0 if matched else self.lost + 1,
            T_last_refused=record.T_taken_refused,
            scores=scores[:SCORE_HISTORY],
            scales=scales[:SCALE_HISTORY],
        )


class MapOdometry(Odometry[MapState]):
    """Odometry of the lab: against a map, with a search, for wheels and scans that may be wrong.

    Between calls it holds the map, the pose and the last motions, as the lesson's Simulink block
    does in persistent variables: never more, however long the drive.

    Examples
    --------
    >>> import labkit
    >>> from labkit.odometry import OdometryParameters
    >>> walls = np.random.default_rng(0).uniform(-4, 4, (80, 2))
    >>> T_old_new = labkit.transform(0.1, 0.05, 0.02)
    >>> odometry = MapOdometry(OdometryParameters(icp=labkit.IcpParameters()))
    >>> _ = odometry.update(walls)
    >>> record = odometry.update(labkit.apply(labkit.invert(T_old_new), walls))
    >>> np.round(odometry.pose, 6).tolist()
    [0.1, 0.05, 0.02]
    """

    def begin(self, pose: FloatArray) -> MapState:
        """The state before the first scan."""
        return MapState(pose)

    def advance(
        self, state: MapState, scan: Scan, prior: FloatArray | None
    ) -> tuple[StepRecord, MapState]:
        """One step: its record, and the state after it."""
        if state.scans == 0:
            seen = scan
            record = StepRecord(increment=STILL, decision=Decision.START)
        else:
            wheels = believable_wheels(prior, state.scales, scan, state.last_scan)
            told = None if wheels is None else prior
            frozen = is_frozen(scan, state.last_scan, wheels)
            seen = NOTHING if frozen else scan
            record = replace(self.step(state, seen, wheels), prior=told)
            if frozen:
                record = replace(record, reason=FROZEN)
        return record, state.after(record, seen)

    def step(self, state: MapState, scan: Scan, prior: FloatArray | None) -> StepRecord:
        """Propose, match, score and choose."""
        target = state.map.target
        T_map_last = state.map.T_target_last
        limits = widen_limits(self.parameters.limits, state.lost if prior is None else 0)
        if target is None or len(scan) < MIN_PAIRS:
            record = no_match("older" if target is None else "newer")
            return refuse(record, prior, state.last_motion, limits)
        motions = np.array([state.last_motion, *state.motions])
        expected = expect(T_map_last, prior, motions, state.T_last_refused)
        matches: list[Match] = []
        for candidates in propose(scan, target, expected, limits):
            for T_guess in candidates:
                matches.append(match(scan, target, T_guess, expected, self.parameters.icp))
            best, margin = choose(matches)
            if best.score >= expected.sure_score and not (best.is_degenerate and prior is None):
                break
        decision = Decision.ICP if best is matches[0] else Decision.SEARCH
        if prior is not None:
            at_wheels = stay(scan, target, expected, self.parameters.icp)
            if at_wheels.agreement >= max(best.agreement, MIN_SCORE):
                best = at_wheels
                decision = Decision.CONFIRMED
        record = record_of_best(best, margin, T_map_last, decision)
        least = MIN_SCORE if prior is None else min_score(state.scores)
        if best.score > least:
            return believe(record, prior, limits)
        led = least > MIN_SCORE
        return refuse(replace(record, led=led), prior, state.last_motion, limits)


def record_of_best(
    best: Match, margin: float, T_map_last: FloatArray, decision: Decision
) -> StepRecord:
    """The record of a step that takes the best of its matches."""
    increment = to_xytheta(invert(T_map_last) @ best.T)
    record = record_of_match(best.result, increment, decision, T_map_last)
    return replace(record, agreement=best.agreement, score=best.score, margin=margin)


def believe(record: StepRecord, prior: FloatArray | None, limits: SanityLimits) -> StepRecord:
    """The record of a match that is believed, also where it lies against the prior."""
    reasons = [] if prior is None else prior_failures(record.increment, prior, limits)
    against_prior = bool(reasons)
    if record.ambiguous:
        reasons.append(f"ambiguous: the scan fits elsewhere, too ({record.margin:+.3f})")
    evidence = record.evidence._replace(std=unknown_std(prior, limits))
    reason = ", ".join(reasons)
    return replace(record, against_prior=against_prior, reason=reason, evidence=evidence)


def refuse(
    record: StepRecord, prior: FloatArray | None, last_motion: FloatArray, limits: SanityLimits
) -> StepRecord:
    """The same record, but with the prior; without one hold the last motion, or stand still."""
    increment = prior
    decision = Decision.PRIOR
    if increment is None:
        increment = last_motion
        decision = Decision.HOLD if last_motion.any() else Decision.STAND
    evidence = Evidence(unknown_std(prior, limits))
    T_taken_refused = None
    if prior is not None and record.agreement > 0.0 and not record.led:
        T_taken_refused = relative(from_xytheta(prior), from_xytheta(record.increment))
    return replace(
        record,
        T_taken_refused=T_taken_refused,
        increment=increment,
        decision=decision,
        reason=record.reason or why_refused(record),
        evidence=evidence,
    )


def why_refused(record: StepRecord) -> str:
    """Why the best match of a step is not believed, for a person."""
    if record.termination is not None and record.termination.failed:
        return record.termination.value
    if record.led:
        return (
            f"following the wheels: the best matches of the last {SCORE_HISTORY} steps score less "
            f"than {GOOD_MEAN_SCORE} on average, and this one {record.score:.2f}"
        )
    return f"the best match scores only {record.score:.2f}"


def widen_limits(limits: SanityLimits, lost: int) -> SanityLimits:
    """The limits of a motion after so many lost steps, for the search."""
    if lost == 0:
        return limits
    return replace(
        limits,
        max_translation=(1 + lost) * limits.max_translation,
        max_rotation=min(math.pi, (1 + lost) * limits.max_rotation),
    )
