"""The schedule: coarse iterations far from the answer, fine ones near it (section 4).

Near the answer, a narrow δ and a narrow gate make for small errors. Far from it they would
leave only pairs that fit by chance, and the line metric, which lets scans slide, steps too
far. So under ``approach=True`` the iterations are coarse as long as the next step is likely to
move the source by more than `LONG_STEP` δ:

- δ is at least `DELTA_PER_MEDIAN` times the median residual, so that half the pairs weigh in full;
- a share of the point-to-point metric, which grows with the square of that δ, calms the step;
- large scans are thinned to every n-th point, at least `COARSE_POINTS`;
- the whole gate is open. In fine iterations it closes to `GATE_PER_DELTA` δ.

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

from labkit.parameters import IcpParameters
from labkit.selection import kth_smallest
from labkit.support.arrays import BoolArray, FloatArray
from labkit.support.compiled import compiled

LONG_STEP = 0.5  # motion over δ: a shorter one does not leave the noise
DELTA_PER_MEDIAN = 5.0  # coarse δ over the median residual: a step stays as robust as the median
GATE_PER_DELTA = 8.0  # fine gate over δ: noise stays within, other surfaces do not
POINT_SHARE = 1.0 / 4000.0  # share of point-to-point per squared widening of δ
COARSE_POINTS = 120  # source points that are enough in coarse iterations


class Stage(NamedTuple):
    """The settings of one iteration, coarse or fine."""

    stride: int  # match every stride-th source point
    max_correspondence_distance: float  # d_max [m]
    overlap_ratio: float  # ρ
    huber_delta: float  # δ [m] of the parameters; see `adapt_delta`
    coarse: bool
    coarse_poses: int  # coarse poses so far, this one included


@compiled
def stage_of(parameters: IcpParameters, count: int, coarse: bool, coarse_poses: int) -> Stage:
    """The settings of an iteration for `count` source points, after so many coarse poses."""
    return Stage(
        max(1, count // COARSE_POINTS) if coarse else 1,
        gate_of(parameters, coarse),
        parameters.overlap_ratio,
        parameters.huber_delta,
        coarse,
        coarse_poses + coarse,
    )


@compiled
def gate_of(parameters: IcpParameters, coarse: bool) -> float:
    """The gate d_max [m] of a coarse or of a fine iteration."""
    gate = parameters.max_correspondence_distance
    if parameters.approach and not coarse:
        return min(gate, GATE_PER_DELTA * parameters.huber_delta)
    return gate


@compiled
def adapt_delta(residuals: FloatArray, kept: BoolArray, stage: Stage) -> tuple[float, float]:
    """δ [m] of an iteration, and the share of point-to-point in its step.

    Fine iterations take the δ of the parameters, and no share. A coarse iteration widens δ, if it
    is narrower than `DELTA_PER_MEDIAN` medians of the kept residuals, and the share grows with it.
    """
    fine_delta = stage.huber_delta
    if not stage.coarse or math.isinf(fine_delta):
        return fine_delta, 0.0
    coarse_delta = fine_delta
    kept_residuals = residuals[kept]
    if len(kept_residuals) > 0:
        median = kth_smallest(kept_residuals, len(kept_residuals) // 2)
        coarse_delta = max(fine_delta, DELTA_PER_MEDIAN * median)
    widening = coarse_delta / fine_delta
    return coarse_delta, min(1.0, POINT_SHARE * (widening * widening))


@compiled
def schedule(
    before: Stage, poses: list[FloatArray], source: FloatArray, parameters: IcpParameters
) -> Stage:
    """The settings of the next iteration, after the step to ``poses[-1]``.

    The next iteration is coarse if the last one was, and if the next motion is expected to be
    longer than `LONG_STEP` δ [m]. Motions are expected to shrink as the last one did.
    """
    coarse = before.coarse
    if coarse:
        motion = displacement(source, poses[-2], poses[-1])
        if len(poses) > 2:
            motion_before = displacement(source, poses[-3], poses[-2])
            if motion < motion_before:
                motion *= motion / motion_before
        coarse = motion > LONG_STEP * parameters.huber_delta
    return stage_of(parameters, len(source), coarse, before.coarse_poses)


@compiled
def displacement(points: FloatArray, T_before: FloatArray, T: FloatArray) -> float:
    """Root mean square distance [m] by which a step moved the points (N, 2)."""
    c = T[0, 0] - T_before[0, 0]
    s = T[1, 0] - T_before[1, 0]
    x, y = T[0, 2] - T_before[0, 2], T[1, 2] - T_before[1, 2]
    total = 0.0
    for i in range(len(points)):
        dx = c * points[i, 0] - s * points[i, 1] + x
        dy = s * points[i, 0] + c * points[i, 1] + y
        total += dx * dx + dy * dy
    return math.sqrt(total / len(points))
