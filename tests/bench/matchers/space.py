"""From the plane to space and back, for libraries that know three dimensions only."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from labkit.se2 import transform
from labkit.support.arrays import FloatArray


def lift(points: FloatArray, z: float = 0.0) -> FloatArray:
    """Points (N, 2) at the height `z`, shape (N, 3)."""
    lifted = np.full((len(points), 3), z)
    lifted[:, :2] = points
    return lifted


def wall(points: FloatArray, height: float) -> FloatArray:
    """The points twice, `height` [m] apart, shape (2 N, 3): the plane through them is upright.

    In a flat cloud the least spread is that along z, and every normal that a library
    estimates points there. Standing up, a wall is a wall.
    """
    return np.concatenate([lift(points), lift(points, height)])


def lift_transform(T: FloatArray) -> FloatArray:
    """A motion of the plane, (3, 3), as one of space, (4, 4)."""
    lifted = np.eye(4)
    lifted[:2, :2], lifted[:2, 3] = T[:2, :2], T[:2, 2]
    return lifted


def drop_transform(T: FloatArray) -> FloatArray:
    """The motion of the plane that is nearest to one of space, (4, 4)."""
    return transform(T[0, 3], T[1, 3], np.arctan2(T[1, 0] - T[0, 1], T[0, 0] + T[1, 1]))


def normals(points: FloatArray, neighbors: int) -> FloatArray:
    """Unit normals (N, 2): across the line through the nearest points, itself included."""
    _, index = cKDTree(points).query(points, k=min(neighbors, len(points)))
    offset = points[index] - points[index].mean(axis=1, keepdims=True)
    x, y = offset[..., 0], offset[..., 1]
    xx, xy, yy = ((a * b).sum(axis=1) for a, b in ((x, x), (x, y), (y, y)))
    along = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    return np.column_stack([-np.sin(along), np.cos(along)])
