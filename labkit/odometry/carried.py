"""Things carried along: still in the scanner's own frame, so no witness of its motion.

A trolley that the robot pushes, or a person beside it, lies in every scan where it lay before:
so much of a scan may agree with a robot that stands still. If a motion is expected, points that
lie as they lay, and not on the map there, are left out. A wall along the way agrees with both,
and stays.
"""

from __future__ import annotations

import numpy as np

from labkit.odometry.constants import CARRIED_SHARES, REPEAT_DISTANCE
from labkit.scan import Scan
from labkit.se2 import apply
from labkit.support.arrays import BoolArray, FloatArray
from labkit.target import Target


def mask_repeats(scan: Scan, earlier: Target) -> BoolArray:
    """Mask of the points that lie where an earlier scan had one, both as the scanner sees them."""
    _, distances = earlier.search.query(scan.points)
    return np.asarray(distances < REPEAT_DISTANCE)


def mask_carried(
    scan: Scan, repeats: BoolArray, target: Target, T_target_scan: FloatArray
) -> BoolArray:
    """Mask of the points that are carried along; none where they are too few, or nearly all.

    `repeats` marks the points that lie as they lay; see `mask_repeats`.
    """
    least, most = CARRIED_SHARES
    if repeats.mean() <= least:
        return np.zeros(len(scan), np.bool_)
    _, distances = target.search.query(apply(T_target_scan, scan.points))
    carried = repeats & (distances > 2.0 * REPEAT_DISTANCE)
    share_is_usual = least < carried.mean() < most
    return np.asarray(carried & share_is_usual)
