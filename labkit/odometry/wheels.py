"""Wheels, believed as far as matches bear them out.

Wheels that are worn, or told in another unit, tell each way short or long by the same factor. The
matches measure it. Wheels that stand while the scan moves tell nothing; nor does a scan that
repeats the one before to the last digit, while the wheels move.
"""

from __future__ import annotations

import math
from statistics import median_low

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.odometry.carried import mask_repeats
from labkit.scan import Scan
from labkit.support.arrays import FloatArray
from labkit.target import Target

REST_SHIFT = 0.02  # [m]: wheels that shift more do not stand
REST_TURN = math.radians(0.5)  # [rad]: nor do wheels that turn more
SAME_VIEW_SHARE = 0.9  # of a scan's points that repeat those of the scan before, at a stand
MIN_SHIFT = 0.05  # [m]: wheels and matches that drive less tell no scale
SCALE_HISTORY = 40  # matched steps that tell the scale of the wheels
USUAL_SCALES = (1.0,) * 10  # count among them, so that few change nothing


def is_at_rest(told: FloatArray) -> bool:
    """True if wheels tell that the robot stands."""
    x, y, turn = told.tolist()
    return math.hypot(x, y) <= REST_SHIFT and abs(turn) <= REST_TURN


def scale_of(told: FloatArray, measured: FloatArray) -> float:
    """How many times as far as the wheels told a match measured; NaN if either hardly moved.

    The way told counts along the measured one: the noise across it would make it too long.
    """
    length = math.hypot(measured[0], measured[1])
    if min(length, math.hypot(told[0], told[1])) < MIN_SHIFT:
        return math.nan
    along = float(measured[:2] @ told[:2]) / length
    return length / along if along != 0.0 else math.nan


def is_frozen(scan: Scan, last_scan: Target | None, told: FloatArray | None) -> bool:
    """True if a scan repeats the last one to the last digit, and the wheels tell a motion."""
    if told is None or last_scan is None or is_at_rest(told):
        return False
    if scan.ranges is not None and last_scan.scan.ranges is not None:
        return np.array_equal(scan.ranges, last_scan.scan.ranges, equal_nan=True)
    return np.array_equal(scan.points, last_scan.points)


def believable_wheels(
    told: FloatArray | None,
    scales: tuple[float, ...],
    scan: Scan,
    last_scan: Target | None,
) -> FloatArray | None:
    """The motion that the wheels told, times the median of the last scales.

    None if they told that the robot stands while the scan has moved.
    """
    if told is None:
        return None
    if is_at_rest(told) and last_scan is not None and len(scan) >= MIN_PAIRS:
        share = np.mean(mask_repeats(scan, last_scan))
        if share < SAME_VIEW_SHARE:
            return None
    scale = median_low([*scales, *USUAL_SCALES])  # one of them: the mean of 1 and −1 is none
    return np.asarray(told * np.array([scale, scale, 1.0]))
