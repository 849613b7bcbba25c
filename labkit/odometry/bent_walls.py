"""Bent walls: they show wrong angles of the beams, without wheels and without a second scan.

A straight wall lies at the distance r(θ) along the beam of the bearing θ, and its inverse
u = 1/r is a sinusoid: u'' = −u. If the angles are told s times too wide, u'' = −u / s².
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from labkit.odometry.constants import HISTORY, MAX_ROUGHNESS, WALL_VIEW
from labkit.scan import Scan


def is_sampled(number: int) -> bool:
    """True for the scans of a run whose walls are looked at: at first all, later one of forty."""
    return number % min(1 + number // HISTORY, HISTORY) == 0


def curvature(scan: Any) -> float:
    """Median of −u''/u over the walls in view: 1 if they look straight.

    A wall is a stretch of beams whose u lies on a parabola, and which is no ring around the
    scanner. NaN where none is in view, or the scan has no angles.
    """
    if not isinstance(scan, Scan) or scan.ranges is None or scan.beams is None:
        return math.nan
    if scan.angles is None or len(scan.angles) < 2:
        return math.nan
    spacing = abs(float(np.median(np.diff(scan.angles))))
    count = math.ceil(WALL_VIEW / spacing) if spacing > 0.0 else 0
    if not 3 < count <= len(scan.angles):
        return math.nan
    inverse = np.full(len(scan.angles), np.nan)
    inverse[scan.beams] = 1.0 / scan.ranges[scan.beams]
    stretches = np.lib.stride_tricks.sliding_window_view(inverse, count)[:: count // 2]
    u = stretches[np.isfinite(stretches).all(axis=1)].T
    bearing = spacing * (np.arange(count) - 0.5 * (count - 1))
    powers = np.vander(bearing, 3)
    parabolas = np.linalg.lstsq(powers, u)[0]
    is_smooth = (np.abs(powers @ parabolas / u - 1.0) < MAX_ROUGHNESS).all(axis=0)
    is_ring = (np.abs(u / u.mean(axis=0) - 1.0) < MAX_ROUGHNESS).all(axis=0)
    second, _, zeroth = parabolas[:, is_smooth & ~is_ring]
    curvatures = -2.0 * second / zeroth
    of_walls = curvatures[curvatures > 0.0]
    return float(np.median(of_walls)) if len(of_walls) else math.nan
