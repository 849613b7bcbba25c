"""Pre-processing of a scan: box B of the lesson's flow chart.

Each filter takes a scan (or bare points) and returns a scan. It keeps the order of the
points and the beams they came from, so that later stages can use them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import scipy  # its parts are loaded when they are used
from numpy.typing import ArrayLike

from labkit.scan import Scan, as_scan
from labkit.support.arrays import check_range

SMALLEST_CELL = 1e-100  # [m]: in smaller cells the index of a cell overflows


def range_band(scan: Scan | ArrayLike, minimum: float = 0.0, maximum: float = math.inf) -> Scan:
    """Keep the points whose distance from the scanner lies in [minimum, maximum] metres."""
    minimum = check_range(minimum, "minimum", at_least=0.0, unit="m")
    maximum = check_range(maximum, "maximum", above=minimum, unit="m")
    scan = as_scan(scan)
    r = np.hypot(scan.points[:, 0], scan.points[:, 1])
    return scan.select((r >= minimum) & (r <= maximum))


def voxel_downsample(scan: Scan | ArrayLike, size: float) -> Scan:
    """Replace the points of each `size` × `size` cell [m] by their centroid.

    A corner of the grid lies at the scanner. The centroids come in the order in which the scan
    first meets their cells, and each takes over the beam of the first point in its cell.
    """
    size = check_range(size, "size", at_least=SMALLEST_CELL, unit="m")
    scan = as_scan(scan)
    cells = np.floor(scan.points / size)  # floats: integers end at 2**63
    _, first_point, cell = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    cell = cell.reshape(-1)  # of each point
    cell_count = len(first_point)
    point_count = np.bincount(cell, minlength=cell_count)
    sum_x = np.bincount(cell, scan.points[:, 0], cell_count)
    sum_y = np.bincount(cell, scan.points[:, 1], cell_count)
    centroids = np.column_stack([sum_x, sum_y]) / point_count[:, None]
    order = np.argsort(first_point)
    return replace(scan.select(first_point[order]), points=centroids[order])


def remove_isolated(scan: Scan | ArrayLike, radius: float) -> Scan:
    """Drop points that have no other point within `radius` metres.

    Such a point is mostly a mixed pixel at an edge, dust, or somebody's leg.
    """
    radius = check_range(radius, "radius", above=0.0, unit="m")
    scan = as_scan(scan)
    tree = scipy.spatial.cKDTree(scan.points)
    count = tree.query_ball_point(scan.points, radius, return_length=True)  # the point included
    return scan.select(count > 1)


@dataclass(frozen=True, kw_only=True)
class Preprocessing:
    """The filters that every scan of a run goes through, in the flow chart's order.

    The band of `range_band`, the cell of `voxel_downsample` and the radius of `remove_isolated`,
    all in metres; each filter is off by default.
    """

    range_min: float = field(
        default=0.0, metadata={"unit": "m", "help": "drop points nearer than this"}
    )
    range_max: float = field(
        default=math.inf,
        metadata={"unit": "m", "help": "drop points farther than this; inf turns it off"},
    )
    voxel_size: float = 0.0
    isolation_radius: float = 0.0

    def __post_init__(self) -> None:
        check_range(self.range_min, "range_min", at_least=0.0, unit="m")
        check_range(self.range_max, "range_max", above=self.range_min, unit="m")
        check_range(self.voxel_size, "voxel_size", at_least=0.0, unit="m")
        check_range(self.isolation_radius, "isolation_radius", at_least=0.0, unit="m")

    def __call__(self, scan: Scan | ArrayLike) -> Scan:
        """Return the filtered scan, or `scan` itself where every filter is off."""
        scan = as_scan(scan)
        if self.range_min > 0.0 or self.range_max < math.inf:
            scan = range_band(scan, self.range_min, self.range_max)
        if self.voxel_size > 0.0:
            scan = voxel_downsample(scan, self.voxel_size)
        if self.isolation_radius > 0.0:
            scan = remove_isolated(scan, self.isolation_radius)
        return scan
