"""Score of a match: how well the scan lies on the map, and how far the motion is from the expected.

    s(T) = 1 − J(T) / h_δ(d_max) − ½ v(T) − c log(1 + u(T))                             (5.3)

J is the cost (4.1), so the first two terms are 1 where all of the scan lies on the map, and 0 where
none of it does. v is the share of the map's visible points that beams look through: a beam that
ended at 5 m has seen that nothing stands at 3 m. u is the squared distance of the motion from the
nearest expected one, over half of the window. Its cost grows as slowly as a logarithm (a Cauchy
density has heavy tails): the scan can overrule the wheels, as it must where they jump or slip.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.correspondences import loss_of
from labkit.odometry.constants import CLEARANCE, LOOKED_THROUGH_COST
from labkit.odometry.propose import Expectation
from labkit.odometry.record import Placement
from labkit.result import IcpResult
from labkit.schedule import gate_of
from labkit.support.arrays import FloatArray
from labkit.support.compiled import compiled


class Score(NamedTuple):
    """The score of a match, and its agreement: the score without the cost of the motion."""

    score: float = -math.inf
    agreement: float = -math.inf


def score(
    result: IcpResult | Placement, expected: Expectation, least_agreement: float = -math.inf
) -> Score:
    """Score a match by (5.3); −∞ where it failed.

    Where its pairs alone agree by less than `least_agreement`, v is left out: it only lowers that.
    """
    if result.termination is not None and result.termination.failed:
        return Score()
    gate = gate_of(result.parameters, False)
    max_loss = math.inf if gate == math.inf else loss_of(gate, result.parameters.huber_delta)
    agreement = 1.0 - min(1.0, result.correspondences.cost / max_loss)
    T = np.array(result.T_target_source)
    if agreement >= least_agreement:
        looked_through = share_looked_through(result.source.points, result.target.points, T)
        if looked_through > 0.0:  # NaN where nothing of the map is in view
            agreement -= LOOKED_THROUGH_COST * looked_through
    return Score(agreement - expected.cost(T), agreement)


@compiled
def share_looked_through(source: FloatArray, target: FloatArray, T: FloatArray) -> float:
    """Share of the visible target points that the beams to the source points pass through, at T.

    Points hidden behind the beams' ends are not in view; NaN where none is.
    """
    bearings, lengths = beams_of(source)
    bins_per_bearing = 0.25 * len(bearings)  # as many bins from −2 to 2 as there are beams
    edges = (np.arange(len(bearings) + 1) - 0.5) / bins_per_bearing - 2.0  # early: for rounding
    first_of_bin = np.searchsorted(bearings, edges)
    looked_through = 0
    hit = 0
    max_distance = lengths.max() + CLEARANCE
    for i in range(len(target)):
        dx = target[i, 0] - T[0, 2]
        dy = target[i, 1] - T[1, 2]
        distance = math.sqrt(dx * dx + dy * dy)
        if distance > max_distance:
            continue
        x = T[0, 0] * dx + T[1, 0] * dy
        y = T[0, 1] * dx + T[1, 1] * dy
        direction = bearing(x, y)
        k = first_of_bin[int((direction + 2.0) * bins_per_bearing)]
        while k < len(bearings) and bearings[k] < direction:
            k += 1
        if k in (0, len(bearings)):  # the point lies between beams k − 1 and k
            continue
        if distance < min(lengths[k - 1], lengths[k]) - CLEARANCE:
            looked_through += 1
        elif distance < max(lengths[k - 1], lengths[k]) + CLEARANCE:
            hit += 1
    visible = looked_through + hit
    return looked_through / visible if visible > 0 else math.nan


@compiled
def beams_of(source: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bearings, ascending, and lengths [m] of the beams to points (N, 2)."""
    bearings = np.empty(len(source))
    lengths = np.empty(len(source))
    for i in range(len(source)):
        bearings[i] = bearing(source[i, 0], source[i, 1])
        lengths[i] = math.hypot(source[i, 0], source[i, 1])
    order = np.argsort(bearings, kind="mergesort")
    return bearings[order], lengths[order]


@compiled
def bearing(x: float, y: float) -> float:
    """A number from −2 to 2 that grows as the angle of (x, y) does, without trigonometry."""
    size = abs(x) + abs(y)
    share = y / size if size > 0.0 else 0.0
    return share if x >= 0.0 else math.copysign(2.0, y) - share
