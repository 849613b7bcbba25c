"""The lab's own odometry: propose, match, score, choose, check, by a map of what it has seen.

propose   where the robot may be: by the wheels or the last motions, and by a search
match     ICP from each of these places
score     how well the scan lies on the map there, and how unexpected the motion is  (5.3)
choose    the highest score; outside the wheels' window only a match that is plainly better
check     the same step by the last two scans alone

Where the last scans fitted too little, the wheels lead, and none of this is done.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.odometry.base import NO_POINTS, Odometry
from labkit.odometry.check import UNCHECKED, check_step
from labkit.odometry.constants import AT_ONCE, MARGIN, MIN_AGREEMENT, MIN_SCORE, SURE_SCORE
from labkit.odometry.integration import integrate_step
from labkit.odometry.local_map import LocalMap
from labkit.odometry.match import Match, match, stay
from labkit.odometry.propose import Expectation, expect, propose
from labkit.odometry.record import (
    STILL,
    Check,
    Decision,
    Evidence,
    Scales,
    StepRecord,
    no_match,
    record_of_match,
)
from labkit.odometry.sanity import SanityLimits, limit_failures, prior_failures, unknown_std
from labkit.odometry.scales import History, growth_of
from labkit.odometry.search import is_same_pose
from labkit.odometry.wheels import believable_wheels, is_frozen
from labkit.scan import Scan
from labkit.se2 import from_xytheta, invert, relative, to_xytheta, wrap
from labkit.support.arrays import FloatArray
from labkit.target import Target

FROZEN = "the scan repeats the one before to the last digit: does the scanner hang?"


class MapState(NamedTuple):
    """State of the lab's odometry between two scans."""

    pose: FloatArray
    scans: int = 0
    map: LocalMap = LocalMap()
    last_scan: Target | None = None  # the last one with points
    history: History = History()
    T_last_refused: FloatArray | None = None  # where the last match ended, if it was refused
    has_seen: bool = True  # whether the last scan with points is the one before, and no repeat

    def after(self, record: StepRecord, scan: Scan) -> MapState:
        """The state after a step. The map waits while a refused match may have been right."""
        increment = record.increment
        matched = record.decision.matched
        newest = Target(scan) if len(scan) >= MIN_PAIRS else None
        next_map = self.map.follow(increment)
        if newest is not None and not record.has_rival:
            next_map = next_map.add(newest, matched=matched)
        return MapState(
            pose=integrate_step(self.pose, increment),
            scans=self.scans + 1,
            map=next_map,
            last_scan=self.last_scan if newest is None else newest,
            history=self.history.after(record, scan),
            T_last_refused=record.T_taken_refused,
            has_seen=newest is not None,
        )


class MapOdometry(Odometry[MapState]):
    """Odometry of the lab: against a map, with a search, for wheels and scans that may be wrong.

    Between calls it holds the map, the pose and the last motions, as the lesson's Simulink block
    does in persistent variables. Only the walls that the map remembers become more as the robot
    drives: 32 bytes for each 10 cm, and a step looks at those around it alone.

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
            record = StepRecord(increment=STILL, decision=Decision.START)
            return record, state.after(record, scan)
        scales = state.history.scales(scan, prior, self.parameters.limits)
        wheels = believable_wheels(prior, scales, scan, state.last_scan)
        repeats = is_frozen(scan, state.last_scan, wheels)
        if repeats and wheels is None:
            return self.skip_repeat(state, prior, scales)
        seen = NO_POINTS if repeats else scan
        record = replace(
            self.step(state, seen, wheels, scales),
            prior=None if wheels is None else prior,
            scales=scales,
            repeats=repeats,
        )
        if record.decision.matched:
            record = replace(record, check=self.check(state, scan, wheels, record.increment))
        if repeats:
            record = replace(record, reason=FROZEN)
        elif prior is not None and wheels is None:
            reasons = [why_ignored(prior, scales), record.reason]
            record = replace(record, reason=", ".join(filter(None, reasons)))
        elif record.is_doubtful and not record.reason:
            record = replace(record, reason=why_doubtful(record))
        return record, state.after(record, seen)

    def skip_repeat(
        self, state: MapState, told: FloatArray | None, scales: Scales
    ) -> tuple[StepRecord, MapState]:
        """Stand still, and learn nothing: a scan came twice, and no wheels tell a motion."""
        record = StepRecord(
            increment=STILL,
            decision=Decision.STAND,
            reason=FROZEN,
            repeats=True,
            scales=scales,
            evidence=Evidence(unmatched_std(None, self.parameters.limits, scales)),
        )
        return record, state._replace(scans=state.scans + 1, has_seen=False)

    def check(
        self, state: MapState, scan: Scan, wheels: FloatArray | None, increment: FloatArray
    ) -> Check:
        """The same step by the scan before alone; NaN where that has no points or came twice."""
        if state.last_scan is None or not state.has_seen:
            return UNCHECKED
        return check_step(scan, state.last_scan, increment, wheels, self.parameters.icp)

    def step(
        self, state: MapState, scan: Scan, prior: FloatArray | None, scales: Scales
    ) -> StepRecord:
        """Propose, match, score and choose."""
        target = state.map.target
        T_map_last = state.map.T_target_last
        T_last_map = invert(T_map_last)
        history = state.history
        if target is None or len(scan) < MIN_PAIRS:
            record = no_match("older" if target is None else "newer")
            return self.refuse(record, prior, history, scales)
        motions = np.array([history.last_motion, *history.motions])
        expected = expect(T_map_last, prior, motions, scales, state.T_last_refused)
        leads = prior is not None and scales.wheels_lead
        matches: list[Match] = []
        reach = scales.steps * np.array(self.parameters.limits.window)
        for candidates in propose(scan, target, expected, reach):
            for T_guess in candidates:
                candidate = match(scan, target, T_guess, expected, self.parameters.icp)
                motion = to_xytheta(T_last_map @ candidate.T)
                is_expected = candidate.agreement >= SURE_SCORE or expected.allows(candidate.T)
                if not (scales.allow(motion) and is_expected):
                    candidate = candidate.without_score()
                matches.append(candidate)
            best = choose(matches)
            is_sure = best.score >= expected.sure_score
            if leads or (is_sure and not (best.is_degenerate and prior is None)):
                break
        choice = Choice(best, best.score > MIN_SCORE)
        if prior is not None:
            at_wheels = stay(scan, target, expected, self.parameters.icp, best)
            if leads:  # a scan that fits elsewhere does not bear them out
                choice = Choice(best_in_window(matches, at_wheels, expected), is_believed=False)
            else:
                choice = choose_beside_wheels(matches, at_wheels, expected)
        decision = Decision.SEARCH
        if choice.confirms_wheels:
            decision = Decision.CONFIRMED
        elif is_same_pose(choice.match.T, matches[0].T):
            decision = Decision.ICP
        margin = margin_of(choice.match, matches)
        record = record_of_best(choice.match, margin, T_map_last, decision)
        if not choice.is_believed:
            return self.refuse(replace(record, led=leads), prior, history, scales)
        T_taken_refused = None
        if choice.rival is not None:
            T_taken_refused = relative(choice.match.T, choice.rival.T)
        record = replace(record, T_taken_refused=T_taken_refused)
        return believe(record, prior, self.parameters.limits, scales)

    def refuse(
        self, record: StepRecord, prior: FloatArray | None, history: History, scales: Scales
    ) -> StepRecord:
        """The same record, but with the prior; without one hold the last motion, or stand still."""
        increment = prior
        decision = Decision.PRIOR
        if increment is None:
            increment = history.last_motion
            decision = Decision.HOLD if increment.any() else Decision.STAND
        T_taken_refused = None
        if prior is not None and record.agreement > 0.0 and not record.led:
            T_taken_refused = relative(from_xytheta(prior), from_xytheta(record.increment))
        return replace(
            record,
            T_taken_refused=T_taken_refused,
            increment=increment,
            decision=decision,
            reason=record.reason or why_refused(record, scales),
            evidence=Evidence(unmatched_std(prior, self.parameters.limits, scales)),
        )


class Choice(NamedTuple):
    """The match that is chosen."""

    match: Match
    is_believed: bool
    rival: Match | None = None  # a better one outside the wheels' window
    confirms_wheels: bool = False  # it is the scan at the wheels' own pose


def choose(matches: Sequence[Match]) -> Match:
    """The match of the highest score; of equals the first one."""
    return max(matches, key=lambda match: match.score)


def choose_beside_wheels(
    matches: Sequence[Match], at_wheels: Match, expected: Expectation
) -> Choice:
    """The choice where wheels tell a motion: outside their window a match must be plainly better.

    The scan at the wheels' own pose wins where it agrees as well as the best match.
    """
    best = choose(matches)
    rival = None
    if not expected.holds(best.T):
        nearest = best_in_window(matches, at_wheels, expected)
        if not is_plainly_better(best, nearest, matches, expected):
            if nearest.score <= MIN_SCORE:
                return Choice(best, is_believed=False)
            has_score = math.isfinite(best.score)  # a failed match has none
            rival = best if has_score else None
            best = nearest
    if at_wheels.agreement >= max(best.agreement, MIN_SCORE):
        return Choice(at_wheels, is_believed=True, rival=rival, confirms_wheels=True)
    return Choice(best, best.score > MIN_SCORE, rival)


def best_in_window(matches: Sequence[Match], at_wheels: Match, expected: Expectation) -> Match:
    """The match of the highest score in the wheels' window, or the scan at their own pose."""
    return choose([match for match in [at_wheels, *matches] if expected.holds(match.T)])


def margin_of(best: Match, matches: Sequence[Match]) -> float:
    """By how much the agreement of a match exceeds that of the best one that ended elsewhere.

    NaN where none did that scores more than 0.
    """
    agreements = [match.agreement for match in elsewhere(best, matches) if match.score > 0.0]
    return best.agreement - max(agreements, default=math.nan)


def elsewhere(best: Match, matches: Sequence[Match]) -> list[Match]:
    """The matches that ended at other poses than one of them."""
    return [match for match in matches if not is_same_pose(best.T, match.T)]


def is_plainly_better(
    match: Match, nearest: Match, matches: Sequence[Match], expected: Expectation
) -> bool:
    """True if a match outside the window is better than the best one in it, and than any elsewhere.

    It agrees with the map, or goes on from where one before ended: two scans tell it. It lacks
    little of what the nearest one lacks: a door that shuts agrees with a robot at rest. And it is
    alone: where the scan fits at several places, none of them tells more than the wheels.
    """
    if match.agreement < MIN_AGREEMENT and not expected.goes_on(match.T):
        return False
    rival_score = max((rival.score for rival in elsewhere(match, matches)), default=-math.inf)
    is_alone = match.score - rival_score > MARGIN
    return is_alone and 1.0 - match.score < AT_ONCE * (1.0 - nearest.score)


def record_of_best(
    best: Match, margin: float, T_map_last: FloatArray, decision: Decision
) -> StepRecord:
    """The record of a step that takes the best of its matches."""
    increment = to_xytheta(invert(T_map_last) @ best.T)
    record = record_of_match(best.result, increment, decision, T_map_last)
    return replace(record, agreement=best.agreement, score=best.score, margin=margin)


def believe(
    record: StepRecord, prior: FloatArray | None, limits: SanityLimits, scales: Scales
) -> StepRecord:
    """The record of a match that is believed, also where it lies against the prior."""
    reasons = [] if prior is None else prior_failures(record.increment, prior, limits)
    against_prior = bool(reasons)
    if record.ambiguous:
        reasons.append(f"ambiguous: the scan fits elsewhere, too ({record.margin:+.3f})")
    evidence = record.evidence._replace(std=unmatched_std(prior, limits, scales))
    reason = ", ".join(reasons)
    return replace(record, against_prior=against_prior, reason=reason, evidence=evidence)


def unmatched_std(prior: FloatArray | None, limits: SanityLimits, scales: Scales) -> FloatArray:
    """Standard deviation (3,) of what no match tells: the wheels' usual error, if there are any."""
    if prior is None:
        return unknown_std(None, limits)
    shift = growth_of(prior) * scales.wheel_shift
    return np.array([shift, shift, growth_of(prior) * scales.wheel_turn])


def why_ignored(told: FloatArray, scales: Scales) -> str:
    """Why the wheels tell nothing in a step, for a person."""
    motion = scales.correct(told)
    if scales.allow(motion):
        return "the wheels tell that the robot stands, and the scan has moved"
    x, y, turn = motion.tolist()
    max_shift, max_turn = scales.farthest
    return (
        f"the wheels tell {math.hypot(x, y):.2f} m and {math.degrees(abs(turn)):.0f}°, more than "
        f"the robot can do ({max_shift:.2f} m, {math.degrees(max_turn):.0f}°)"
    )


def why_doubtful(record: StepRecord) -> str:
    """Why a match that is believed may be wrong all the same, for a person."""
    if record.check is not None and record.is_contradicted:
        x, y, turn = (record.check.increment - record.increment).tolist()
        if math.isnan(turn):
            return "no match with the scan before bears it out"
        return (
            f"a match with the scan before alone leads {math.hypot(x, y):.2f} m and "
            f"{math.degrees(abs(wrap(turn))):.1f}° elsewhere"
        )
    if record.is_over_gap:
        return "scans are missing before this one, and no wheels tell how far the robot went"
    return f"one direction is measured to {record.weakest_std:.2f} m only"


def why_refused(record: StepRecord, scales: Scales) -> str:
    """Why the best match of a step is not believed, for a person."""
    if record.termination is not None and record.termination.failed:
        return record.termination.value
    if failures := limit_failures(record.increment, scales.farthest):
        return f"the match leads farther than the robot can do: {', '.join(failures)}"
    if record.led:
        return (
            f"following the wheels: the last scans usually agreed too little with the map, and "
            f"this one by {record.agreement:.2f}"
        )
    if record.score == -math.inf:
        return "the match lies farther from the wheels than the robot moves in a step"
    return f"the best match scores only {record.score:.2f}"
