"""Things carried along: still in the scanner's own frame, so no witness of its motion.

A trolley that the robot pushes, or a person beside it, lies in every scan where it lay before:
so much of a scan may agree with a robot that stands still. If a motion is expected, points that
lie as they lay, and not on the map there, are left out. A wall along the way agrees with both,
and stays.
"""

from __future__ import annotations

import numpy as np

from labkit.neighbors import NearestNeighbors
from labkit.scan import Scan
from labkit.se2 import apply
from labkit.support.arrays import BoolArray, FloatArray
from labkit.target import Target

NEAR, OFF = 0.1, 0.2  # [m]: a point that lies as it lay; a point that lies on nothing
SHARE = 0.1, 0.65  # of a scan that is carried: less is chance, and more says that wheels slip


def stands(scan: Scan, before: Scan) -> BoolArray:
    """Mask of the points that lie where an earlier scan had one, both as the scanner sees them."""
    if len(before) == 0:
        return np.zeros(len(scan), bool)
    return np.asarray(NearestNeighbors(before.points).query(scan.points)[1] < NEAR)


def without_carried(
    scan: Scan, still: BoolArray, target: Target, T_target_scan: FloatArray
) -> Scan:
    """The scan without the points that are carried along, or as it is where they are too few.

    `still`, shape (N,), marks the points that lie as they lay; see `stands`.
    """
    _, off = target.search.query(apply(T_target_scan, scan.points))
    carried = still & (off > OFF)
    return scan.select(~carried) if SHARE[0] < carried.mean() < SHARE[1] else scan
