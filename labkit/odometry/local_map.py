"""What the next scan is matched against: a map of the last key scans, or of the last scan alone.

Against a map, errors add up from one key scan to the next, and not from one scan to the next.
Each point of the map keeps the normal from its own scan: if two views of a wall lie a
centimetre apart, a line through the mixture could have any direction.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from labkit.arrays import BoolArray, FloatArray, check_count, check_range
from labkit.correspondences import MIN_PAIRS
from labkit.scan import Scan
from labkit.se2 import apply, from_xytheta, invert
from labkit.target import Target


@dataclass(frozen=True, kw_only=True)
class MapParameters:
    """Which scans make up the map, and how much of them is kept; checked when it is made.

    Attributes
    ----------
    key_scans : int
        How many key scans the map holds: its memory, however long the robot drives.
    key_distance, key_rotation : float
        A scan becomes a key scan when it is this far from the last one [m], or turned by this
        much [rad], or when it was not matched.
    map_cell : float
        A key scan keeps one point in each square of this size [m]; 0 keeps them all.
    """

    key_scans: int = 30
    key_distance: float = 0.3
    key_rotation: float = math.radians(20.0)
    map_cell: float = 0.05

    def __post_init__(self) -> None:
        check_count(self.key_scans, "key_scans", at_least=1)
        check_range(self.key_distance, "key_distance", at_least=0.0, unit="m")
        check_range(self.key_rotation, "key_rotation", at_least=0.0, unit="rad")
        check_range(self.map_cell, "map_cell", at_least=0.0, unit="m")


LAST_SCAN = MapParameters(key_scans=1, key_distance=0.0, key_rotation=0.0, map_cell=0.0)


class LocalMap:
    """The last key scans as one target, in the frame of the newest of them.

    `T_target_last` is the pose of the scan before, from which the next one starts.
    """

    def __init__(self, parameters: MapParameters) -> None:
        self.parameters = parameters
        self.target: Target | None = None
        self.T_target_last = np.eye(3)
        self._sizes: deque[int] = deque()  # points of each key scan, the oldest first

    def add(self, scan: Scan, increment: FloatArray, *, matched: bool) -> None:
        """Take the newest scan, one `increment` (Δx, Δy, Δψ) on."""
        self.T_target_last = self.T_target_last @ from_xytheta(increment)
        if len(scan) < MIN_PAIRS:
            return
        if self.target is None:
            self.target = self._thinned(scan)
        elif not matched or self._is_far():
            self.target = self._with_key(self.target, self._thinned(scan))
        else:
            return
        self.T_target_last = np.eye(3)

    def _is_far(self) -> bool:
        (c, _, x), (s, _, y), _ = self.T_target_last.tolist()
        moved, turned = math.hypot(x, y), abs(math.atan2(s, c))
        return moved > self.parameters.key_distance or turned > self.parameters.key_rotation

    def _thinned(self, scan: Scan) -> Target:
        """A key scan: of each cell the first point, with the normal among all points."""
        kept = first_of_each_cell(scan.points, self.parameters.map_cell)
        self._sizes.append(int(kept.sum()))
        return Target(Scan.from_points(scan.points[kept]), Target(scan).normals[kept])

    def _with_key(self, target: Target, newest: Target) -> Target:
        """The map seen from the newest key scan, without the one that is too many."""
        surplus = self._sizes.popleft() if len(self._sizes) > self.parameters.key_scans else 0
        T_newest_target = invert(self.T_target_last)
        points = apply(T_newest_target, target.points[surplus:])
        normals = target.normals[surplus:] @ T_newest_target[:2, :2].T
        return Target(
            Scan.from_points(np.vstack([points, newest.points])),
            np.vstack([normals, newest.normals]),
        )


def first_of_each_cell(points: FloatArray, cell: float) -> BoolArray:
    """Which of the points (N, 2) come first in their square of side `cell` [m]; 0: all do."""
    first = np.ones(len(points), dtype=np.bool_)
    if cell > 0.0:
        column, row = np.floor(points / cell).T
        _, index = np.unique(column + 1j * row, return_index=True)
        first[:] = False
        first[index] = True
    return first
