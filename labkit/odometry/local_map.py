"""Target of the next scan: a map of the last key scans.

Against a map, errors add up from one key scan to the next, and not from one scan to the next.
Each point of the map keeps the normal from its own scan: if two views of a wall lie a
centimetre apart, a line through the mixture could have any direction.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.odometry.carried import carried, stands
from labkit.result import step_length
from labkit.scan import Scan
from labkit.se2 import apply, from_xytheta, invert
from labkit.support.arrays import FloatArray
from labkit.target import Target

KEY_SCANS = 30  # the map's memory, however long the robot drives
KEY_DISTANCE, KEY_ROTATION = 0.3, math.radians(20.0)  # [m] and [rad] between two key scans
MAP_CELL = 0.05  # [m]: a key scan keeps one point in each square of this size
AT_TARGET = np.eye(3)


class LocalMap(NamedTuple):
    """The last key scans as one target, in the frame of the newest of them.

    `T_target_last` is the pose of the scan before, from which the next one starts.
    """

    target: Target | None = None
    key: Target | None = None  # the newest key scan, as it was taken
    T_target_last: FloatArray = AT_TARGET
    sizes: tuple[int, ...] = ()  # points of each key scan, the oldest first

    def moved(
        self, scan: Scan, increment: FloatArray, prior: FloatArray | None, *, matched: bool
    ) -> LocalMap:
        """The map after the newest scan, one `increment` (Δx, Δy, Δψ) on.

        If a prior told the motion, what is carried along stays out of the map.
        """
        T_last = self.T_target_last @ from_xytheta(increment)
        here = self._replace(T_target_last=T_last)
        moved, turned = step_length(AT_TARGET, T_last)
        is_near = moved <= KEY_DISTANCE and turned <= KEY_ROTATION
        if len(scan) < MIN_PAIRS or (self.target and matched and is_near):
            return here
        key = fixed = Target(scan)
        if prior is not None and self.target and self.key:
            off = carried(scan, stands(scan, self.key), self.target, T_last)
            fixed = Target(scan.select(~off)) if off.any() else key
        return here._with(fixed, key)

    def _with(self, newest: Target, key: Target) -> LocalMap:
        """Add a key scan: of each cell the first point, with its normal among all of the scan.

        The map moves into the frame of this scan, and loses the oldest one beyond `KEY_SCANS`.
        """
        cells = np.floor(newest.points / MAP_CELL) @ [1.0, 1j]
        kept = np.sort(np.unique(cells, return_index=True)[1])
        points, normals = newest.points[kept], newest.normals[kept]
        sizes = (*self.sizes, len(kept))
        if self.target:
            T = invert(self.T_target_last)
            surplus = sum(sizes[:-KEY_SCANS])
            points = np.vstack([apply(T, self.target.points[surplus:]), points])
            normals = np.vstack([self.target.normals[surplus:] @ T[:2, :2].T, normals])
        target = Target(Scan.from_points(points), normals)
        return LocalMap(target, key, sizes=sizes[-KEY_SCANS:])
