"""Bent walls: they show wrong angles of the beams, without wheels and without a second scan.

A straight wall lies at the distance r(θ) along the beam of the bearing θ, and its inverse
u = 1/r is a sinusoid: u'' = −u. If the angles are told s times too wide, u'' = −u / s².
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labkit.odometry.constants import HISTORY, MAX_ROUGHNESS, WALL_VIEW
from labkit.scan import Scan
from labkit.support.arrays import FloatArray


def is_sampled(number: int) -> bool:
    """True for the scans of a run whose walls are looked at: at first all, later one of forty."""
    return number % min(1 + number // HISTORY, HISTORY) == 0


def curvature(scan: Any, first: Any) -> float:
    """Median of −u''/u over the walls in view: 1 if they look straight.

    A wall is a stretch of beams whose u lies on a parabola, and that does not look as it did in the
    `first` scan of the run: what stays in view as it is, the robot carries along. NaN where none is
    in view, or a scan has no angles.
    """
    spacing = spacing_of(scan)
    count = math.ceil(WALL_VIEW / spacing) if spacing > 0.0 else 0
    if not (spacing_of(first) > 0.0 and 3 < count <= len(scan.angles)):
        return math.nan
    u_of_beams = inverse_ranges(scan)
    u_before = inverse_ranges(first)
    is_new = np.ones(len(u_of_beams), np.bool_)
    if len(u_before) == len(u_of_beams):
        is_new = ~(np.abs(u_of_beams / u_before - 1.0) < MAX_ROUGHNESS)
    u = windows(u_of_beams, count)
    is_wall = np.isfinite(u).all(axis=0) & windows(is_new, count).any(axis=0)
    u = u[:, is_wall]
    bearing = spacing * (np.arange(count) - 0.5 * (count - 1))
    powers = np.vander(bearing, 3)
    parabolas = np.linalg.lstsq(powers, u)[0]
    is_smooth = (np.abs(powers @ parabolas / u - 1.0) < MAX_ROUGHNESS).all(axis=0)
    second, _, zeroth = parabolas[:, is_smooth]
    curvatures = -2.0 * second / zeroth
    of_walls = curvatures[curvatures > 0.0]
    return float(np.median(of_walls)) if len(of_walls) else math.nan


def spacing_of(scan: Any) -> float:
    """Angle [rad] from one beam of a scan to the next; NaN where it tells none."""
    if not isinstance(scan, Scan) or scan.ranges is None or scan.beams is None:
        return math.nan
    if scan.angles is None or len(scan.angles) < 2:
        return math.nan
    return abs(float(np.median(np.diff(scan.angles))))


def inverse_ranges(scan: Any) -> FloatArray:
    """1/r of each beam of a scan, shape (B,); NaN without a return."""
    inverse = np.full(len(scan.angles), np.nan)
    inverse[scan.beams] = 1.0 / scan.ranges[scan.beams]
    return inverse


def windows(values: NDArray[Any], count: int) -> NDArray[Any]:
    """Stretches of `count` neighbours, as columns; each begins in the middle of the one before."""
    return np.lib.stride_tricks.sliding_window_view(values, count)[:: count // 2].T
