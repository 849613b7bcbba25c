"""Degenerate motions: what a scan cannot see in corridors and at single walls (section 5).

There are two tests. `observability` uses the surface normals, and judges each direction of the
motion by itself. `spread_ratio` is the lesson's cheap test. It looks only at how the points are
spread, so it takes any narrow room for a corridor.

Noisy normals show a free direction some degrees off. `follow_surfaces` finds it along the surfaces.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from labkit.alignment import product, turn_about
from labkit.correspondences import Correspondences, associate, reject_and_weigh
from labkit.line_alignment import (
    Information,
    center_and_length,
    information_of,
    line_residuals,
    line_rows,
    normal_equations,
    solve_constrained,
)
from labkit.neighbors import Grid, start_search
from labkit.parameters import IcpParameters
from labkit.scan import Scan, as_scan
from labkit.schedule import stage_of
from labkit.se2 import to_xytheta
from labkit.support.arrays import EPSILON, FloatArray, as_floats, as_normals, check_kind
from labkit.support.compiled import compiled
from labkit.support.errors import InvalidPointsError
from labkit.target import Target

MAX_TURN_OF_SHIFT = 0.1  # component ℓΔψ of a motion below which it is called a shift
SLIDE = 0.5  # [m or rad]: how far to slide along a free motion, to either side


def observability(
    pairs: Correspondences, target: Target, source_normals: ArrayLike | None = None
) -> Information | None:
    """Information of the kept pairs about each direction of the motion between two scans.

    It is computed from the target's normals, under either metric; None where no kept pair lies on
    a surface. Noise in the normals makes a smooth wall look structured. The noise of the two scans
    is independent, so `source_normals` tell structure from noise: shape (N, 2), in the target's
    frame, NaN where there is none. Pairs that lack a normal are left out.
    """
    check_kind(pairs, "pairs", Correspondences)
    check_kind(target, "target", Target)
    if pairs.target_index.max(initial=-1) >= len(target.normals):
        raise InvalidPointsError(
            f"`target` must be the target of `pairs`, got one of {len(target.normals)} points"
        )
    normals = target.normals[pairs.target_index]
    other_normals = normals
    used = pairs.kept & np.isfinite(normals[:, 0])
    if source_normals is not None:
        other_normals = as_normals(source_normals, "source_normals", len(used), gaps=True)
        used &= np.isfinite(other_normals[:, 0])
    points, weights = pairs.source[used], pairs.weights[used]
    _, length = center_and_length(points, weights)
    if not length > 0.0:
        return None
    return information_of(points, normals[used], other_normals[used], weights)


def free_motions(information: Information) -> tuple[str, ...]:
    """The motions that the points leave free, in words, in the target's frame [m]."""
    check_kind(information, "information", Information)
    return tuple(
        _shift_in_words(x, y)
        if abs(turn) < MAX_TURN_OF_SHIFT
        else _turn_in_words(information, x, y, turn)
        for x, y, turn in information.free.T.tolist()
    )


def _shift_in_words(x: float, y: float) -> str:
    """Say along which unit vector a shift goes; of v and −v the one that points right, or up."""
    sign = math.copysign(1.0 / math.hypot(x, y), x if abs(x) > MAX_TURN_OF_SHIFT else y)
    return f"shift along ({_metres(sign * x)}, {_metres(sign * y)})"


def _turn_in_words(information: Information, x: float, y: float, turn: float) -> str:
    """Say which point the motion (Δx, Δy, ℓΔψ) leaves in its place: p = c + (−Δy, Δx) / Δψ."""
    metres_per_turn = information.length / turn  # 1 / Δψ
    px, py = information.center + metres_per_turn * np.array([-y, x])
    return f"turn about ({_metres(px)}, {_metres(py)})"


def _metres(value: float) -> str:
    """Two decimals, without the sign of -0.00."""
    return f"{round(value, 2) + 0.0:.2f}"


def follow_surfaces(
    source: Scan,
    target: Target,
    T: FloatArray,
    parameters: IcpParameters,
    seen: FloatArray,
    direction: FloatArray,
) -> FloatArray:
    """A free direction, (3,), as the line between two places of the scan on the surfaces.

    The scan slides by `SLIDE` along it from T, (3, 3), to either side, and returns to the surfaces
    by the motions `seen`, (3, S). Where it turns away instead, it is the direction itself.
    """
    searched = source.points, target.search.grid, target.normals_for(parameters), target.normals
    directions = np.zeros((3, 3))
    directions[:, : seen.shape[1]] = seen
    match = to_xytheta(T)
    ends = []
    for side in (SLIDE, -SLIDE):
        end = return_to_surfaces(*searched, match + side * direction, directions, parameters)
        if abs(end[2] - match[2]) > math.pi:
            return direction
        ends.append(end)
    return (ends[0] - ends[1]) / (2.0 * SLIDE)


@compiled
def return_to_surfaces(
    source: FloatArray,
    target: Grid,
    loop_normals: FloatArray,
    normals: FloatArray,
    motion: FloatArray,
    seen: FloatArray,
    parameters: IcpParameters,
) -> FloatArray:
    """The motion (3,) that leads onto the surfaces again, changed in the `seen` directions alone.

    These are columns (3, 3), those of no direction 0. It keeps the run's budget and tolerances;
    the metric weighs pairs by the `loop_normals`, none under point-to-point.
    """
    search = start_search(target, len(source))
    stage = stage_of(parameters, len(source), False, 0)
    x = motion.copy()
    for _ in range(parameters.max_iterations):
        found = associate(source, search, turn_about((0.0, 0.0), x[2], x[0], x[1]), math.inf)
        pairs = reject_and_weigh(*found, target.points, loop_normals, stage)
        n = normals[pairs.target_index]
        weights = np.where(np.isfinite(n[:, 0]), pairs.weights, 0.0)
        J = line_rows(pairs.source, n, (x[0], x[1]), 1.0)
        A, g = normal_equations(J, J, line_residuals(pairs.source, pairs.target, n), weights)
        A_seen = product(product(seen.T, A), seen)
        smallest = 3.0 * EPSILON * (1.0 + np.trace(A_seen))  # of a direction seen: not rounding
        step = (seen * solve_constrained(A_seen, (seen.T * g).sum(axis=1), smallest)).sum(axis=1)
        x = x + step
        is_short = math.hypot(step[0], step[1]) < parameters.translation_tolerance
        if is_short and abs(step[2]) < parameters.rotation_tolerance:
            break
    return x


def spread_ratio(scan: Scan | ArrayLike, motion: ArrayLike) -> float:
    """The lesson's cheap corridor test: spread across the motion over spread along it.

    `motion`, shape (2,), is a direction in the frame of the scan. The ratio is well below 1 for a
    robot that drives along a corridor, and NaN without motion or points.
    """
    points = as_scan(scan).points
    direction = as_floats(motion, "motion", shape=(2,))
    length = math.hypot(*direction)
    if not (length > 0.0 and len(points)):
        return math.nan
    dx, dy = direction / length
    along, across = (points @ [[dx, -dy], [dy, dx]]).std(axis=0)
    return float(across / along) if along > 0.0 else math.nan
