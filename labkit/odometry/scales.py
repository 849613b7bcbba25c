"""Scales that a run measures on its last steps, so that nobody has to choose them.

How far wheels err, and by which factor they tell ways too short; how well a scan of this scanner in
these rooms usually fits; how long a step may be. They are medians, or a quantile, over the last
`HISTORY` steps. When a run begins, `MIN_STEPS` of a stated value stand in for them.
"""

from __future__ import annotations

import math
from statistics import NormalDist, median, median_low
from typing import NamedTuple

import numpy as np

from labkit.odometry.constants import (
    HISTORY,
    LEAST_WHEEL_ERROR,
    MIN_AGREEMENT,
    MIN_STEPS,
    QUANTILE,
    UNUSUAL,
    USUAL_CHANGE,
)
from labkit.odometry.record import STILL, Decision, Scales, StepRecord
from labkit.odometry.sanity import SanityLimits
from labkit.odometry.wheels import scale_of
from labkit.scan import Scan
from labkit.support.arrays import FloatArray


class History(NamedTuple):
    """Measurements of the last steps, the newest first."""

    last_motion: FloatArray = STILL
    motions: tuple[FloatArray, ...] = ()  # that matches measured without doubt, or wheels told
    wheel_errors: tuple[tuple[float, float], ...] = ()  # [m], [rad]: as at rest
    wheel_factors: tuple[float, ...] = ()
    agreements: tuple[float, ...] = ()  # of the best matches
    intervals: tuple[float, ...] = ()  # [s] between two scans
    stamp: float = math.nan  # of the last scan [s]
    missed: int = 0  # steps since the last match

    def scales(self, scan: Scan, prior: FloatArray | None, limits: SanityLimits) -> Scales:
        """The scales by which the step to a scan is judged."""
        unmeasured = max(0, MIN_STEPS - len(self.wheel_errors))
        stated_error = UNUSUAL * np.array(LEAST_WHEEL_ERROR)
        errors = np.array([*self.wheel_errors, *[stated_error] * unmeasured])
        sigmas = NormalDist().inv_cdf(0.5 + 0.5 * QUANTILE)  # that it spans of a Gaussian
        usual_error = np.quantile(errors, QUANTILE, axis=0) / sigmas
        shift_error, turn_error = np.maximum(usual_error, LEAST_WHEEL_ERROR).tolist()
        x, y, turns = np.array([STILL, *self.motions]).T
        max_shift, max_turn = limits.reach(float(np.hypot(x, y).max()), float(np.abs(turns).max()))
        steps = self.steps_to(scan) + (self.missed if prior is None else 0)
        return Scales(
            wheel_shift=shift_error,
            wheel_turn=turn_error,
            wheel_factor=median_low([*self.wheel_factors, *[1.0] * MIN_STEPS]),
            agreement=median([*self.agreements, *[1.0] * MIN_STEPS]),
            steps=steps,
            max_shift=max_shift,
            max_turn=max_turn,
        )

    def steps_to(self, scan: Scan) -> float:
        """How many usual steps lie between the last scan and the next one, at least 1."""
        interval = scan.stamp - self.stamp
        if self.intervals and interval > 0.0:
            return max(1.0, interval / median(self.intervals))
        return 1.0

    def after(self, record: StepRecord, scan: Scan) -> History:
        """The history after a step."""
        is_measured = record.decision.matched and not record.degenerate
        motions, errors, factors = self.motions, self.wheel_errors, self.wheel_factors
        was_compared = not math.isnan(record.agreement)  # without scans wheels raise no limit
        spans_steps = record.prior is None and self.missed > 0  # it makes up for missed ones
        if is_measured and not (record.ambiguous or spans_steps):
            motions = (record.increment, *motions)
        elif record.decision is Decision.PRIOR and record.scales is not None and was_compared:
            motions = (record.increment / record.scales.steps, *motions)
        if is_measured and record.prior is not None:
            factor = scale_of(record.prior, record.increment)
            factors = factors if math.isnan(factor) else (factor, *factors)
            is_match = record.decision is not Decision.CONFIRMED
            if is_match and record.agreement >= MIN_AGREEMENT and record.scales is not None:
                errors = (wheel_error(record.prior, record.increment, record.scales), *errors)
        last_motion = record.increment
        if record.decision.is_guess:
            last_motion = STILL
        elif spans_steps or (record.ambiguous and record.prior is None):  # confirms no motion
            last_motion = motions[0] if motions else STILL
        agreements = self.agreements
        if was_compared:
            agreements = (max(0.0, record.agreement), *agreements)
        interval = scan.stamp - self.stamp
        intervals = (interval, *self.intervals) if interval > 0.0 else self.intervals
        return History(
            last_motion=last_motion,
            motions=motions[:HISTORY],
            wheel_errors=errors[:HISTORY],
            wheel_factors=factors[:HISTORY],
            agreements=agreements[:HISTORY],
            intervals=intervals[:HISTORY],
            stamp=scan.stamp,
            missed=self.missed + 1 if record.decision.is_guess else 0,
        )


def growth_of(motion: FloatArray) -> float:
    """How many times as large as at rest an error of the wheels usually is, after a motion."""
    x, y, turn = motion.tolist()
    shift, double_turn = USUAL_CHANGE
    return float(1.0 + math.hypot(x, y) / shift + abs(turn) / double_turn)


def wheel_error(told: FloatArray, measured: FloatArray, scales: Scales) -> tuple[float, float]:
    """Error of the wheels in a step, as it would be at rest, [m] and [rad]."""
    expected = scales.correct(told)
    x, y, turn = (measured - expected).tolist()
    growth = growth_of(expected)
    return math.hypot(x, y) / growth, abs(math.remainder(turn, math.tau)) / growth
