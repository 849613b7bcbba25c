"""Degenerate motions: what a scan cannot see in corridors and at single walls (section 5).

There are two tests. `observability` uses the surface normals, direction by direction.
`spread_ratio` is the lesson's cheap test. It looks only at how the points are spread, so it
takes any narrow room for a corridor.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from labkit.correspondences import Correspondences
from labkit.line_alignment import Information, line_information
from labkit.scan import Scan, as_scan
from labkit.support.arrays import as_floats, check_kind
from labkit.support.errors import DegenerateAlignmentError, InvalidPointsError
from labkit.target import Target

SHIFT = 0.1  # share of the turn in a motion (Δx, Δy, ℓΔψ) below which it is called a shift


def observability(
    pairs: Correspondences, target: Target, source_normals: ArrayLike | None = None
) -> Information | None:
    """Information of the kept pairs about each direction of the motion between two scans.

    The target's normals are used, whatever metric made the pairs; None where no kept pair lies on
    a surface. Noise in the normals makes a smooth wall look structured. It is independent in the
    two scans, so `source_normals`, shape (N, 2), in the target's frame, NaN where there is none,
    tell structure from noise. Pairs without both normals are left out.
    """
    check_kind(pairs, "pairs", Correspondences)
    check_kind(target, "target", Target)
    if pairs.target_index.max(initial=-1) >= len(target.normals):
        raise InvalidPointsError(
            f"`target` must be the target of `pairs`, got one of {len(target.normals)} points"
        )
    normals = target.normals[pairs.target_index]
    used = pairs.kept & np.isfinite(normals[:, 0])
    others = None
    if source_normals is not None:
        others = as_floats(source_normals, "source_normals", shape=(len(used), 2))
        used &= np.isfinite(others[:, 0])
        others = others[used]
    if not used.any():
        return None
    try:
        return line_information(pairs.source[used], normals[used], pairs.weights[used], others)
    except DegenerateAlignmentError:
        return None


def free_motions(information: Information) -> tuple[str, ...]:
    """The motions that the points leave free, in words, in the target's frame [m]."""
    check_kind(information, "information", Information)
    words = []
    for x, y, turn in information.free.T.tolist():
        if abs(turn) < SHIFT:
            sign = math.copysign(1.0 / math.hypot(x, y), x if abs(x) > SHIFT else y)
            words.append(f"shift along ({_metres(sign * x)}, {_metres(sign * y)})")
        else:  # what the motion leaves in its place: p − c = (−y, x) ℓ/turn
            reach = information.length / turn
            cx, cy = information.center + reach * np.array([-y, x])
            words.append(f"turn about ({_metres(cx)}, {_metres(cy)})")
    return tuple(words)


def _metres(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}"  # no "-0.00"


def spread_ratio(scan: Scan | ArrayLike, motion: ArrayLike) -> float:
    """The lesson's cheap corridor test: spread across the motion over spread along it.

    `motion`, shape (2,), is a direction in the frame of the scan. The ratio is well below 1 in a
    corridor that is driven along; it is NaN without motion or points.
    """
    points = as_scan(scan).points
    direction = as_floats(motion, "motion", shape=(2,))
    length = math.hypot(*direction)
    if not (length > 0.0 and len(points)):
        return math.nan
    dx, dy = direction / length
    along, across = (points @ [[dx, -dy], [dy, dx]]).std(axis=0)
    return float(across / along) if along > 0.0 else math.nan
