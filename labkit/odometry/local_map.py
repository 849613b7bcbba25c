"""Target of the next scan: a map of the last key scans, and of the walls before them.

Against a map, errors add up from one key scan to the next, and not from one scan to the next;
where the robot comes back to walls that the map remembers, they end. Each point of the map keeps
its place and the normal from its own scan: if two views of a wall lie a centimetre apart, a line
through the mixture could have any direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from labkit.odometry.constants import KEY_MOTION, KEY_SCANS, MAP_CELL
from labkit.odometry.walls import (
    NO_WALLS,
    Walls,
    first_of_squares,
    mask_near,
    move,
    walls_seen_twice,
    with_normals,
)
from labkit.result import step_length
from labkit.se2 import apply, from_xytheta, invert
from labkit.support.arrays import FloatArray
from labkit.target import Target, target_on_lines


class LocalMap(NamedTuple):
    """Surroundings of the robot as one target, in the frame of the newest key scan.

    First come the walls that it remembers, then the points of the last key scans, the oldest first.
    `T_target_last` is the pose of the scan before, from which the next one starts.
    """

    target: Target | None = None
    T_target_last: FloatArray = np.eye(3)
    sizes: tuple[int, ...] = ()  # points of each of the last key scans
    walls: Walls = NO_WALLS
    T_walls_target: FloatArray = np.eye(3)

    def follow(self, increment: FloatArray) -> LocalMap:
        """The same map after one `increment` (Δx, Δy, Δψ)."""
        return self._replace(T_target_last=self.T_target_last @ from_xytheta(increment))

    def add(self, newest: Target, *, matched: bool) -> LocalMap:
        """The map with the newest scan if it was not matched, or lies far from the last key scan.

        Of each square such a key scan keeps the first point, with its normal among all of the scan.
        It brings nothing to walls that the map remembers. The map moves into its frame, and of the
        oldest one beyond `KEY_SCANS` it keeps the walls.
        """
        distance, rotation = step_length(np.eye(3), self.T_target_last)
        is_near = distance <= KEY_MOTION[0] and rotation <= KEY_MOTION[1]
        if self.target and matched and is_near:
            return self
        rows = with_normals(newest)
        rows = rows[np.sort(first_of_squares(rows, MAP_CELL))]
        if self.target is None:
            return LocalMap(map_target(np.hsplit(rows, 2)), sizes=(len(rows),))
        start = len(self.target.points) - sum(self.sizes)  # of the last key scans
        rows = rows[~mask_near(move(rows, self.T_target_last), self.target, 0, start)]
        walls = self.walls
        if len(self.sizes) == KEY_SCANS:
            end = start + self.sizes[0]
            walls = walls.add(move(walls_seen_twice(self.target, start, end), self.T_walls_target))
            start = end
        T_walls_target = self.T_walls_target @ self.T_target_last
        around = move(walls.around(T_walls_target), invert(T_walls_target))
        T_new_old = invert(self.T_target_last)
        points = apply(T_new_old, self.target.points[start:])
        normals = self.target.normals[start:] @ T_new_old[:2, :2].T
        target = map_target(np.hsplit(around, 2), (points, normals), np.hsplit(rows, 2))
        sizes = (*self.sizes[1 - KEY_SCANS :], len(rows))
        return LocalMap(target, sizes=sizes, walls=walls, T_walls_target=T_walls_target)


def map_target(*parts: Sequence[FloatArray]) -> Target:
    """A target of parts, each of them points (N, 2) and their normals."""
    points, normals = zip(*parts, strict=True)
    return target_on_lines(np.vstack(points), np.vstack(normals))
