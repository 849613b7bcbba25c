"""Score of a match: how well the scan lies on the map, and how far the motion is from the expected.

    s(T) = 1 − J(T) / h_δ(d_max) − ½ v(T) − c u(T) / (1 + u(T))                       (5.3)

J is the cost (4.1), so the first two terms are 1 where all of the scan lies on the map, and 0 where
none of it does. v is the share of the map's visible points that beams look through: a beam that
ended at 5 m has seen that nothing stands at 3 m. u is the squared distance of the motion from the
nearest expected one, over the error that is usual. It costs at most c: the scan can overrule the
wheels, as it must where they jump or slip.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.correspondences import loss_of
from labkit.odometry.propose import Expectation
from labkit.result import IcpResult
from labkit.scan import Scan
from labkit.schedule import gate_of
from labkit.support.arrays import FloatArray
from labkit.support.compiled import compiled

CLEARANCE = 0.3  # [m]: a beam must end this far behind a point to have looked through it
MAX_GAP = math.radians(5.0)  # between two beams farther apart nobody knows what stands
LOOKED_THROUGH_COST = 0.5  # of agreement, if beams look through all walls in view


class Score(NamedTuple):
    """The score of a match, and its agreement: the score without the cost of the motion."""

    score: float = -math.inf
    agreement: float = -math.inf


def score(result: IcpResult, expected: Expectation) -> Score:
    """Score a match by (5.3); −∞ where it failed."""
    if result.termination.failed:
        return Score()
    delta, gate = result.parameters.huber_delta, gate_of(result.parameters, False)
    worst = loss_of(gate, delta) if gate < math.inf else math.inf
    T = np.array(result.T_target_source)
    looked_through = seen_through(*beams_of(result.source), np.array(result.target.points), T)
    agreement = 1.0 - min(1.0, result.cost / worst)
    if looked_through > 0.0:  # NaN where nothing of the map is in view
        agreement -= LOOKED_THROUGH_COST * looked_through
    return Score(agreement - expected.cost(T), agreement)


@compiled
def seen_through(bearing: FloatArray, end: FloatArray, target: FloatArray, T: FloatArray) -> float:
    """Share of the visible target points that beams pass through, at the pose T.

    The beams, of `beams_of`, are sorted by their bearing [rad], and end [m] away. Points
    hidden behind the beams' ends are not in view; NaN where none is.
    """
    through, hit, count = 0, 0, len(bearing)
    reach = end.max() + CLEARANCE
    for i in range(len(target)):
        dx, dy = target[i, 0] - T[0, 2], target[i, 1] - T[1, 2]
        distance = math.hypot(dx, dy)
        if distance > reach:
            continue
        x, y = T[0, 0] * dx + T[1, 0] * dy, T[0, 1] * dx + T[1, 1] * dy
        angle = math.atan2(y, x)
        right = np.searchsorted(bearing, angle)  # the first beam at this bearing or beyond
        if right in (0, count) or bearing[right] - bearing[right - 1] >= MAX_GAP:
            continue
        if distance < min(end[right], end[right - 1]) - CLEARANCE:
            through += 1
        elif distance < max(end[right], end[right - 1]) + CLEARANCE:
            hit += 1
    return through / (through + hit) if through + hit > 0 else math.nan


def beams_of(source: Scan) -> tuple[FloatArray, FloatArray]:
    """Bearings [rad], ascending, and ends [m] of the beams that returned."""
    x, y = source.points.T
    bearing, end = np.arctan2(y, x), np.hypot(x, y)
    order = np.argsort(bearing, kind="stable")
    return bearing[order], end[order]
