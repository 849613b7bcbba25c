"""Target of the next scan: a map of the last key scans, or of the last scan alone.

Against a map, errors add up from one key scan to the next, and not from one scan to the next.
Each point of the map keeps the normal from its own scan: if two views of a wall lie a
centimetre apart, a line through the mixture could have any direction.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.odometry.carried import stands, without_carried
from labkit.result import step_length
from labkit.scan import Scan
from labkit.se2 import apply, from_xytheta, invert
from labkit.support.arrays import FloatArray
from labkit.target import Target

KEY_SCANS = 30  # the map's memory, however long the robot drives
KEY_DISTANCE, KEY_ROTATION = 0.3, math.radians(20.0)  # [m] and [rad] between two key scans
MAP_CELL = 0.05  # [m]: a key scan keeps one point in each square of this size


class LocalMap:
    """The last key scans as one target, in the frame of the newest of them.

    With `last_scan`, the target is the last scan alone, and all of its points.
    `T_target_last` is the pose of the scan before, from which the next one starts.
    """

    def __init__(self, *, last_scan: bool = False) -> None:
        self.last_scan = last_scan
        self.target: Target | None = None
        self.T_target_told = np.eye(3)  # the last pose by the priors since the newest key scan
        self.key = Scan(points=np.empty((0, 2)))  # the newest key scan, as it was taken
        self.T_target_last = np.eye(3)
        self._sizes: deque[int] = deque()  # points of each key scan, the oldest first

    def add(
        self, scan: Scan, increment: FloatArray, prior: FloatArray | None, *, matched: bool
    ) -> None:
        """Take the newest scan, one `increment` (Δx, Δy, Δψ) on.

        If a prior told the motion, what is carried along stays out of the map.
        """
        self.T_target_last = self.T_target_last @ from_xytheta(increment)
        self.T_target_told = self.T_target_told @ from_xytheta(
            increment if prior is None else prior
        )
        moved, turned = step_length(np.eye(3), self.T_target_last)
        if len(scan) < MIN_PAIRS:
            return
        if self.target is None:
            self.target = self._thinned(scan)
        elif self.last_scan or not matched or moved > KEY_DISTANCE or turned > KEY_ROTATION:
            fixed = scan
            if prior is not None:
                still = stands(scan, self.key)
                fixed = without_carried(scan, still, self.target, self.T_target_last)
            self.target = self._with_key(self.target, self._thinned(fixed))
        else:
            return
        self.key = scan
        self.T_target_told = np.eye(3)
        self.T_target_last = np.eye(3)

    def _thinned(self, scan: Scan) -> Target:
        """A key scan: of each cell the first point, with the normal among all points."""
        kept = np.arange(len(scan))
        if not self.last_scan:
            cells = np.floor(scan.points / MAP_CELL) @ [1.0, 1j]
            kept = np.sort(np.unique(cells, return_index=True)[1])
        self._sizes.append(len(kept))
        return Target(Scan.from_points(scan.points[kept]), Target(scan).normals[kept])

    def _with_key(self, target: Target, newest: Target) -> Target:
        """The map in the newest key scan's frame; the oldest is dropped beyond KEY_SCANS."""
        most = 1 if self.last_scan else KEY_SCANS
        surplus = self._sizes.popleft() if len(self._sizes) > most else 0
        T_newest_target = invert(self.T_target_last)
        points = apply(T_newest_target, target.points[surplus:])
        normals = target.normals[surplus:] @ T_newest_target[:2, :2].T
        return Target(
            Scan.from_points(np.vstack([points, newest.points])),
            np.vstack([normals, newest.normals]),
        )
