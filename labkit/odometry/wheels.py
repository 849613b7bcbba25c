"""Wheels, believed as far as matches bear them out.

Wheels that are worn, or told in another unit, tell each way short or long by the same factor. The
matches measure it. Wheels that stand while the scan moves tell nothing; nor does a scan that
repeats the one before to the last digit, unless the wheels stand.
"""

from __future__ import annotations

import math

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.odometry.constants import MIN_MOTION, REPEAT_DISTANCE, REST, SAME_VIEW_SHARE
from labkit.odometry.integration import is_within
from labkit.odometry.record import Scales
from labkit.scan import Scan
from labkit.support.arrays import FloatArray
from labkit.target import Target


def is_at_rest(told: FloatArray) -> bool:
    """True if wheels tell that the robot stands."""
    return is_within(told, REST)


def scale_of(told: FloatArray, measured: FloatArray) -> float:
    """How many times as far as the wheels told a match measured; NaN if either hardly moved.

    The way told counts along the measured one: the noise across it would make it too long.
    """
    length = math.hypot(measured[0], measured[1])
    if min(length, math.hypot(told[0], told[1])) < MIN_MOTION[0]:
        return math.nan
    along = float(measured[:2] @ told[:2]) / length
    return length / along if along != 0.0 else math.nan


def is_frozen(scan: Scan, last_scan: Target | None, told: FloatArray | None) -> bool:
    """True if a scan repeats the last one to the last digit, and no wheels tell a stand."""
    if last_scan is None or (told is not None and is_at_rest(told)):
        return False
    last = last_scan.scan
    if scan.beams is not None and scan.ranges is not None and last.ranges is not None:
        return np.array_equal(scan.ranges, last.ranges, equal_nan=True)
    return np.array_equal(scan.points, last_scan.points)


def believable_wheels(
    told: FloatArray | None,
    scales: Scales,
    scan: Scan,
    last_scan: Target | None,
) -> FloatArray | None:
    """The motion that the wheels told, times the factor that matches measured.

    None if they told more than the robot can do, or that it stands while the scan has moved.
    """
    if told is None:
        return None
    if is_at_rest(told) and last_scan is not None and len(scan) >= MIN_PAIRS:
        _, distances = last_scan.search.query(scan.points)
        if np.mean(distances < REPEAT_DISTANCE) < SAME_VIEW_SHARE:
            return None
    motion = scales.correct(told)
    return motion if scales.allow(motion) else None
