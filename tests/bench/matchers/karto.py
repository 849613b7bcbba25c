"""Karto's correlative scan matcher, on which slam_toolbox is built: one sweep on one other.

It searches a grid around the guess, and so needs the beams of a sweep: bare points have none.
"""

from __future__ import annotations

from functools import cache

import karto_scanmatcher as karto
import numpy as np

from labkit import Scan, to_xytheta, transform
from labkit.support.arrays import FloatArray

TAKES_SCANS = True
RANGE_MAX = 30.0  # m, half the side of its grid: 80 m finds no more and takes longer
ORIGIN = karto.Pose2(0.0, 0.0, 0.0)


def can_match(scan: Scan) -> bool:
    """Whether the points know their beams."""
    return scan.ranges is not None


def match(source: Scan, target: Scan, T_init: FloatArray, gate: float) -> tuple[FloatArray, None]:
    """Coarse, then fine, in a square as wide as the gate; penalties keep it near the guess."""
    guess = karto.Pose2(*to_xytheta(T_init))
    newer, older = _sweep(source, guess), _sweep(target, ORIGIN)
    best = _matcher(gate).match_scan(newer, [older], True, True).best_pose
    return transform(best.x, best.y, best.yaw), None


@cache
def _matcher(gate: float) -> karto.Wrapper:
    """A matcher is made once for a log, as a mapper does."""
    config = karto.ScanMatcherConfig()
    config.search_size = gate
    config.range_threshold = RANGE_MAX
    return karto.Wrapper(config)


def _sweep(scan: Scan, pose: karto.Pose2) -> karto.LocalizedRangeScan:
    angles = scan.angles
    step = angles[1] - angles[0]
    config = karto.LaserScanConfig(angles[0], angles[-1], step, 0.0, RANGE_MAX, RANGE_MAX, "laser")
    ranges = np.full(len(angles), RANGE_MAX)
    ranges[scan.beams] = scan.ranges[scan.beams]
    return karto.LocalizedRangeScan(config, ranges, pose, pose, 0, 0.0)


MATCHERS = {"Karto": match}
