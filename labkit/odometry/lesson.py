"""The lesson's odometry: its second flow chart, box by box.

Each scan is matched against the scan before it. A match that fails a check is tried once more with
half the gate and half of each step; then the prior is taken, or, without one, the step is skipped.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.icp import icp
from labkit.odometry.base import Odometry
from labkit.odometry.integration import integrate_step
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import STILL, Decision, Evidence, StepRecord, no_match, record_of_match
from labkit.odometry.sanity import match_failures, unknown_std
from labkit.scan import Scan
from labkit.se2 import from_xytheta, invert, to_xytheta
from labkit.support.arrays import FloatArray
from labkit.target import Target


class LessonState(NamedTuple):
    """State of the lesson's odometry between two scans."""

    pose: FloatArray
    scans: int = 0
    target: Target | None = None  # the last scan with points
    T_target_last: FloatArray = np.eye(3)  # the pose of scan k in its frame
    last_motion: FloatArray = STILL


class LessonOdometry(Odometry[LessonState]):
    """Odometry of the lesson: scan to scan, with sanity checks and fallbacks.

    Examples
    --------
    >>> import labkit
    >>> walls = np.random.default_rng(0).uniform(-4, 4, (80, 2))
    >>> T_old_new = labkit.transform(0.1, 0.05, 0.02)
    >>> odometry = LessonOdometry(OdometryParameters(icp=labkit.IcpParameters()))
    >>> _ = odometry.update(walls)
    >>> record = odometry.update(labkit.apply(labkit.invert(T_old_new), walls))
    >>> np.round(odometry.pose, 6).tolist()
    [0.1, 0.05, 0.02]
    """

    def begin(self, pose: FloatArray) -> LessonState:
        """The state before the first scan."""
        return LessonState(pose)

    def advance(
        self, state: LessonState, scan: Scan, prior: FloatArray | None
    ) -> tuple[StepRecord, LessonState]:
        """One step: its record, and the state after it."""
        record = StepRecord(increment=STILL, decision=Decision.START)
        if state.scans > 0:
            record = lesson_step(scan, state, prior, self.parameters)
        is_held = record.decision in (Decision.HOLD, Decision.STAND)
        next_state = LessonState(
            pose=integrate_step(state.pose, record.increment),  # C
            scans=state.scans + 1,
            target=state.target,
            T_target_last=state.T_target_last @ from_xytheta(record.increment),
            last_motion=STILL if is_held else record.increment,  # hold a motion only once
        )
        if len(scan) >= MIN_PAIRS:
            next_state = next_state._replace(target=Target(scan), T_target_last=np.eye(3))
        return record, next_state


def lesson_step(
    scan: Scan, state: LessonState, prior: FloatArray | None, parameters: OdometryParameters
) -> StepRecord:
    """Match (A), read the increment (B), check it (D), publish it (E) or fall back (F)."""
    std = unknown_std(prior, parameters.limits)
    if state.target is None or len(scan) < MIN_PAIRS:
        record = no_match(which="older" if state.target is None else "newer")
        return skip(replace(record, evidence=Evidence(std)), state, prior)
    T_guess = state.T_target_last @ from_xytheta(state.last_motion if prior is None else prior)
    reasons: list[str] = []
    for decision, matcher in (
        (Decision.ICP, parameters.icp),
        (Decision.RETRY, parameters.retry),  # F: half the gate, half of each step
    ):
        result = icp(scan, state.target, T_guess, matcher)  # A
        increment = to_xytheta(invert(state.T_target_last) @ result.T_target_source)  # B
        failures = match_failures(result, increment, prior, parameters.limits)  # D
        record = record_of_match(result, increment, decision, state.T_target_last)
        if not failures:
            evidence = record.evidence._replace(std=std)
            return replace(record, reason="; ".join(reasons), evidence=evidence)  # E
        reasons.append(f"{decision.value}: {', '.join(failures)}")
    record = replace(record, reason="; ".join(reasons), evidence=Evidence(std))
    return skip(record, state, prior)  # F


def skip(record: StepRecord, state: LessonState, prior: FloatArray | None) -> StepRecord:
    """Take the prior; without one hold the last motion, or stand still (F)."""
    if prior is not None:
        return replace(record, increment=prior, decision=Decision.PRIOR)
    decision = Decision.HOLD if state.last_motion.any() else Decision.STAND
    return replace(record, increment=state.last_motion, decision=decision)
