"""Which part of a motion a scan cannot see: corridors and single walls (section 5).

Two tests stand side by side. `observability` asks the surface normals, direction by
direction; `spread_ratio` is the lesson's cheap one, which only looks at how the points
are spread, and so takes any narrow room for a corridor.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_transform, homogeneous
from labkit.correspondences import Correspondences
from labkit.errors import DegenerateAlignmentError, InvalidPointsError
from labkit.line_alignment import Information, information_of_rows, line_rows
from labkit.scan import Scan, as_scan
from labkit.target import Target

SHIFT = 0.1  # share of the turn in a motion (Δx, Δy, ℓΔψ) below which it is called a shift


def observability(
    source: Scan | ArrayLike, target: Target, T_target_source: ArrayLike, pairs: Correspondences
) -> Information | None:
    """What the kept pairs say about each direction of the motion between two scans.

    Parameters
    ----------
    source : Scan or array_like, shape (N, 2)
        The newer scan, in metres.
    target : Target
        The older scan; its normals are used, whatever metric made the pairs.
    T_target_source : array_like, shape (3, 3)
        The pose at which the pairs were made.
    pairs : Correspondences
        ``result.correspondences``.

    Returns
    -------
    Information or None
        None where no kept pair lies on a surface, so that nothing can be said.
    """
    points = as_scan(source, "source").points[:: pairs.every]
    T = as_transform(T_target_source, "T_target_source")
    moved = (T - target.to_center) @ homogeneous(points)
    return _information_on_lines(moved, pairs, target)


def observability_of(pairs: Correspondences, target: Target) -> Information | None:
    """The same of pairs where they stand."""
    if pairs.on_lines:  # of which those that lie on no surface have no weight
        return _information(pairs.rows, pairs.weights, target)
    return _information_on_lines(homogeneous(pairs.source - target.center.T), pairs, target)


def _information_on_lines(
    moved: FloatArray, pairs: Correspondences, target: Target
) -> Information | None:
    """That of pairs with source points (x, y, 1) about the target's centre."""
    rows = line_rows(moved, target.surface.take(pairs.target_index, axis=1))
    weights = pairs.weights * target.on_line.take(pairs.target_index)
    return _information(rows, weights, target)


def _information(rows: FloatArray, weights: FloatArray, target: Target) -> Information | None:
    try:
        return information_of_rows(rows, weights, target.center)
    except DegenerateAlignmentError:
        return None


def free_motions(information: Information) -> tuple[str, ...]:
    """The motions that the points leave free, in words, in the target's frame [m].

    Examples
    --------
    >>> import numpy as np
    >>> from labkit.line_alignment import line_information
    >>> wall = np.column_stack([np.linspace(-1.0, 1.0, 9), np.full(9, 2.0)])
    >>> free_motions(line_information(wall, np.tile([0.0, -1.0], (9, 1))))
    ('shift along (1.00, 0.00)',)
    """
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

    Parameters
    ----------
    scan : Scan or array_like, shape (N, 2)
        Points in metres.
    motion : array_like, shape (2,)
        Direction of the motion in the scan's frame; its length does not matter.

    Returns
    -------
    float
        Well below 1 in a corridor that is driven along; NaN without motion or points.
    """
    columns = homogeneous(as_scan(scan).points)
    direction: FloatArray = np.asarray(motion, dtype=np.float64)
    if direction.shape != (2,):
        raise InvalidPointsError(f"`motion` must have shape (2,), got {direction.shape}")
    dx, dy = direction.tolist()
    length = math.hypot(dx, dy)
    if not (length > 0.0 and columns.size):
        return math.nan
    dx, dy = dx / length, dy / length
    columns[:2] -= columns[:2, :1]  # about a point among them: sums then round little
    (xx, xy, x), (_, yy, y), (*_, count) = (columns @ columns.T).tolist()
    xx, xy, yy = xx - x * x / count, xy - x * y / count, yy - y * y / count
    along = dx * dx * xx + 2.0 * dx * dy * xy + dy * dy * yy
    across = dy * dy * xx - 2.0 * dx * dy * xy + dx * dx * yy
    return math.sqrt(max(0.0, across) / along) if along > 0.0 else math.nan
