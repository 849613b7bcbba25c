"""Agreement of a scan with its target at a pose: the walls that its beams look through.

A wrong match may lay half of a scan on walls, and the residuals do not show it, since they
know only pairs. But a beam that ended at 5 m has seen that nothing stands at 3 m. If a match
puts a wall of the map there, either the wall is gone or the match is wrong.
"""

from __future__ import annotations

import math

import numpy as np

from labkit.correspondences import huber_loss
from labkit.result import IcpResult
from labkit.scan import Scan
from labkit.schedule import gate_of
from labkit.support.arrays import FloatArray
from labkit.support.compiled import compiled

CLEARANCE = 0.3  # [m]: a beam must end this far behind a point to have looked through it
GAP = math.radians(5.0)  # between two beams farther apart nobody knows what stands
THROUGH = 0.5  # what a beam that looks through a wall counts, beside a point without partner


@compiled
def seen_through(bearing: FloatArray, end: FloatArray, target: FloatArray, T: FloatArray) -> float:
    """Share of the visible target points that beams pass through, at the pose T.

    The beams, of `beams_of`, are sorted by their bearing [rad], and end [m] away. Points
    hidden behind the beams' ends are not in view; NaN where none is.
    """
    through, hit, count = 0, 0, len(bearing)
    for i in range(len(target)):
        dx, dy = target[i, 0] - T[0, 2], target[i, 1] - T[1, 2]
        x, y = T[0, 0] * dx + T[1, 0] * dy, T[0, 1] * dx + T[1, 1] * dy
        angle, distance = math.atan2(y, x), math.hypot(x, y)
        right = np.searchsorted(bearing, angle)  # the first beam at this bearing or beyond
        if right in (0, count) or bearing[right] - bearing[right - 1] >= GAP:
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


def agreement_of(result: IcpResult) -> tuple[float, float]:
    """Agreement of a match, and the share of the target that its beams look through.

    The agreement is 1 where all of the scan lies on the target, and 0 where none does, as the
    cost (4.1) tells, less `THROUGH` times the share. Far from the answer pairs cost more.
    """
    beams, T = beams_of(result.source), np.array(result.T_target_source)
    through = seen_through(*beams, np.array(result.target.points), T)
    delta, gate = result.parameters.huber_delta, gate_of(result.parameters, False)
    worst = float(huber_loss(gate, delta)) if gate < math.inf else math.inf
    fit = 1.0 - min(1.0, result.cost / worst)
    return fit - THROUGH * (0.0 if math.isnan(through) else through), through
