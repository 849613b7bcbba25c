"""Surveyed relations of the SLAM benchmark: how to judge a trajectory without a reference.

Somebody matched chosen pairs of scans by hand and wrote down the pose of one in the frame of
the other (Kümmerle et al., "On measuring the accuracy of SLAM algorithms", Autonomous Robots
27(4), 2009). A file has lines ``t1 t2 x y z roll pitch yaw`` with times in seconds, or
``i,j,dx,dy,dtheta`` with 0-based scan indices; ``#`` begins a comment.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from labkit.evaluation import PoseErrors
from labkit.evaluation.pose_errors import pose_differences
from labkit.se2 import from_xytheta, relative
from labkit.support.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Relations:
    """N surveyed poses (x [m], y [m], θ [rad]) of the second scan in the frame of the first.

    `ends` (N, 2) are the two scans' indices, or their times [s] if `by_stamp`.
    """

    ends: FloatArray
    by_stamp: bool
    increments: FloatArray

    def scan_indices(self, stamps: FloatArray) -> IntArray:
        """The scans (N, 2) that the relations join, found by their times if these are given."""
        if not self.by_stamp:
            return self.ends.astype(np.intp)
        return cKDTree(stamps[:, None]).query(self.ends[..., None])[1]


def read_relations(path: str | Path) -> Relations:
    """Read a file of relations in either form."""
    lines = Path(path).read_text(encoding="utf-8").splitlines()
    bare = [line.partition("#")[0].strip() for line in lines if not line.startswith("i,j")]
    by_stamp = not any("," in line for line in bare)
    rows = np.loadtxt([line for line in bare if line], delimiter=None if by_stamp else ",", ndmin=2)
    increments = rows[:, [2, 3, 7]] if by_stamp else rows[:, 2:]
    return Relations(ends=rows[:, :2], by_stamp=by_stamp, increments=increments)


def relation_errors(
    relations: Relations, poses: FloatArray, stamps: FloatArray, tolerance: float = 0.05
) -> tuple[PoseErrors, IntArray]:
    """Errors ``invert(relation) @ T_i_j`` of the relations whose scans exist, and their (i, j)."""
    pairs = relations.scan_indices(stamps)
    if relations.by_stamp:
        found = (np.abs(stamps[pairs] - relations.ends) <= tolerance).all(axis=1)
    else:
        found = (pairs < len(poses)).all(axis=1)
    i, j = pairs[found].T
    T = from_xytheta(poses)
    surveyed = from_xytheta(relations.increments[found])
    return PoseErrors(*pose_differences(surveyed, relative(T[i], T[j]))), pairs[found]
