"""The schedule: what an iteration works with, far from the answer and near it (section 4).

Near the answer, a narrow δ and a narrow gate make for small errors. Far from it they would
leave only pairs that fit by chance, and the line metric, which lets scans slide, steps too
far. So under ``approach=True``, as long as the next step is likely to move the source by more
than `LONG` δ,

- δ is at least `WIDTH` times the median residual, so that half the pairs weigh in full;
- a share of the point-to-point metric, which grows with the square of that δ, calms the step;
- large scans are thinned to every n-th point, at least `FEW`;
- the whole gate is open. Near the answer it closes to `CLOSE_GATE` δ.

Pairs of Killian Court started at 0.5 m and 20° from the answer then find it in 88 % of the
cases instead of 74 %, those at 0.3 m and 10° in 98 % instead of 92 %; started near, they
take no more steps (`tests/bench/run.py --split tuning --pairs 2000 --sets killian`).

References
----------
.. [1] Yang, Antonante, Tzoumas, Carlone, "Graduated non-convexity for robust spatial
       perception", IEEE RA-L 5(2), 2020 (a loss that is narrowed on the way).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from labkit.neighbors import select
from labkit.parameters import IcpParameters
from labkit.support.arrays import BoolArray, FloatArray
from labkit.support.compiled import compiled

LONG = 0.5  # step over δ: a shorter one does not leave the noise
WIDTH = 5.0  # δ over the median residual: a step stays as robust as the median
CLOSE_GATE = 8.0  # gate over δ near the answer: noise stays within, other surfaces do not
POINT_SHARE = 1.0 / 4000.0  # share of point-to-point per squared widening of δ
FEW = 120  # points do as well from afar


class Stage(NamedTuple):
    """The settings of one iteration."""

    stride: int  # every so many-th source point is matched
    max_correspondence_distance: float  # d_max [m]
    overlap_ratio: float  # ρ
    huber_delta: float  # δ [m], which `widened` may widen
    far: bool  # whether the pose counts as far from the answer
    may_converge: bool  # whether the step before was taken near the answer


@compiled
def stage_of(parameters: IcpParameters, count: int, far: bool, may_converge: bool) -> Stage:
    """The stage of an iteration for `count` source points, far from the answer or near it."""
    stride = max(1, count // FEW) if far else 1
    gate, delta = gate_of(parameters, far), parameters.huber_delta
    return Stage(stride, gate, parameters.overlap_ratio, delta, far, may_converge)


@compiled
def gate_of(parameters: IcpParameters, far: bool) -> float:
    """The gate d_max [m], far from the answer or near it."""
    if parameters.approach and not far:
        return min(parameters.max_correspondence_distance, CLOSE_GATE * parameters.huber_delta)
    return parameters.max_correspondence_distance


@compiled
def widened(residuals: FloatArray, kept: BoolArray, stage: Stage) -> tuple[float, float]:
    """δ [m] of an iteration, and the share of point-to-point in its step.

    From afar δ is as wide as the median of the kept residuals asks.
    """
    delta, wide = stage.huber_delta, stage.huber_delta
    if not stage.far or math.isinf(delta):
        return delta, 0.0
    some = residuals[kept]
    if len(some) > 0:
        wide = max(delta, WIDTH * select(some, len(some) // 2))
    return wide, min(1.0, POINT_SHARE * (wide / delta) ** 2)


@compiled
def schedule(
    before: Stage, poses: list[FloatArray], source: FloatArray, parameters: IcpParameters
) -> Stage:
    """The next stage, after the step to ``poses[-1]``.

    It is far if it was, and if the next motion, which is expected to shrink as the last one did,
    is longer than `LONG` δ [m].
    """
    far = before.far
    if far:
        motion = displacement(source, poses[-2], poses[-1])
        if len(poses) > 2:
            motion_before = displacement(source, poses[-3], poses[-2])
            if motion < motion_before:
                motion *= motion / motion_before
        far = motion > LONG * parameters.huber_delta
    return stage_of(parameters, len(source), far, not before.far)


@compiled
def displacement(points: FloatArray, T_before: FloatArray, T: FloatArray) -> float:
    """Root mean square distance [m] by which a step moved the points (N, 2)."""
    total, c, s = 0.0, T[0, 0] - T_before[0, 0], T[1, 0] - T_before[1, 0]
    x, y = T[0, 2] - T_before[0, 2], T[1, 2] - T_before[1, 2]
    for i in range(len(points)):
        dx = c * points[i, 0] - s * points[i, 1] + x
        dy = s * points[i, 0] + c * points[i, 1] + y
        total += dx * dx + dy * dy
    return math.sqrt(total / len(points))
