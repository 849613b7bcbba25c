"""Target of the next scan: a map of the last key scans.

Against a map, errors add up from one key scan to the next, and not from one scan to the next.
Each point of the map keeps its place and the normal from its own scan: if two views of a wall lie
a centimetre apart, a line through the mixture could have any direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from labkit.odometry.carried import mask_carried, mask_repeats
from labkit.odometry.constants import KEY_MOTION, KEY_SCANS, MAP_CELL
from labkit.result import step_length
from labkit.se2 import from_xytheta, invert
from labkit.support.arrays import FloatArray
from labkit.target import Target, target_on_lines


class LocalMap(NamedTuple):
    """The last key scans as one target, in the frame of the newest of them.

    `T_target_last` is the pose of the scan before, from which the next one starts.
    """

    target: Target | None = None
    key: Target | None = None  # the newest key scan, as it was taken
    T_target_last: FloatArray = np.eye(3)
    sizes: tuple[int, ...] = ()  # points of each key scan, the oldest first

    def follow(self, increment: FloatArray) -> LocalMap:
        """The same map after one `increment` (Δx, Δy, Δψ)."""
        return self._replace(T_target_last=self.T_target_last @ from_xytheta(increment))

    def add(self, newest: Target, prior: FloatArray | None, *, matched: bool) -> LocalMap:
        """The map with the newest scan, at `T_target_last`, if it was not matched, or lies far off.

        If a prior told the motion, what is carried along stays out of the map.
        """
        distance, rotation = step_length(np.eye(3), self.T_target_last)
        is_near = distance <= KEY_MOTION[0] and rotation <= KEY_MOTION[1]
        if self.target and matched and is_near:
            return self
        fixed = newest
        if prior is not None and self.target and self.key:
            scan = newest.scan
            repeats = mask_repeats(scan, self.key)
            carried = mask_carried(scan, repeats, self.target, self.T_target_last)
            if carried.any():
                fixed = Target(scan.select(~carried))
        return self._add_key_scan(fixed, newest)

    def _add_key_scan(self, newest: Target, key: Target) -> LocalMap:
        """Add a key scan: of each cell the first point, with its normal among all of the scan.

        The map moves into the frame of this scan, and loses the oldest one beyond `KEY_SCANS`.
        """
        column, row = np.floor(newest.points / MAP_CELL).T
        cells = column + 1j * row  # one number a cell: sorted in a tenth of the time of a pair
        first_of_cell = np.sort(np.unique(cells, return_index=True)[1])
        points = newest.points[first_of_cell]
        normals = newest.normals[first_of_cell]
        sizes = (*self.sizes, len(first_of_cell))
        if self.target:
            T = invert(self.T_target_last)
            surplus = sum(sizes[:-KEY_SCANS])
            moved = (T[:2, :2] @ self.target.points[surplus:].T + T[:2, 2:]).T
            points = np.vstack([moved, points])
            normals = np.vstack([self.target.normals[surplus:] @ T[:2, :2].T, normals])
        target = target_on_lines(points, normals)
        return LocalMap(target, key, sizes=sizes[-KEY_SCANS:])
