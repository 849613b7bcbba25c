"""Things carried along: still in the scanner's own frame, so no witness of its motion.

A trolley that the robot pushes, or a person beside it, lies in every scan where it lay before:
so much of a scan may agree with a robot that stands still. If a motion is expected, points that
lie as they lay, and not on the map there, are left out. A wall along the way agrees with both,
and stays.
"""

from __future__ import annotations

import numpy as np

from labkit.scan import Scan
from labkit.se2 import apply
from labkit.support.arrays import BoolArray, FloatArray
from labkit.target import Target

NEAR, OFF = 0.1, 0.2  # [m]: a point that lies as it lay; a point that lies on nothing
SHARE = 0.1, 0.65  # of a scan that is carried: less is chance, and more says that wheels slip


def stands(scan: Scan, before: Target) -> BoolArray:
    """Mask of the points that lie where an earlier scan had one, both as the scanner sees them."""
    return np.asarray(before.search.query(scan.points)[1] < NEAR)


def carried(scan: Scan, still: BoolArray, target: Target, T_target_scan: FloatArray) -> BoolArray:
    """Mask of the points that are carried along; none where they are too few, or nearly all.

    `still` marks the points that lie as they lay; see `stands`.
    """
    if still.mean() <= SHARE[0]:
        return np.zeros(len(scan), np.bool_)
    _, off = target.search.query(apply(T_target_scan, scan.points))
    mask = still & (off > OFF)
    return np.asarray(mask & (SHARE[0] < mask.mean() < SHARE[1]))
