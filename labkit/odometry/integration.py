"""From increments to poses (section 5): where scan matching becomes odometry."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np
from numpy.typing import ArrayLike

from labkit.scan import check_angles
from labkit.se2 import matrices_of, relative, to_xytheta, wrap
from labkit.support.arrays import FloatArray, as_numbers, as_pose, as_poses


def integrate_step(pose: ArrayLike, increment: ArrayLike) -> FloatArray:
    """Move the pose (x, y, ψ) of scan k by an increment (Δx, Δy, Δψ) in its own frame.

    Returns
    -------
    ndarray, shape (3,)
        (x, y, ψ) at scan k+1 [m, m, rad], ψ in (−π, π].

    Examples
    --------
    >>> np.round(integrate_step([1.0, 0.0, np.pi / 2], [0.5, 0.0, 0.1]), 3).tolist()
    [1.0, 0.5, 1.671]
    """
    x, y, heading = as_pose(pose, "pose").tolist()
    dx, dy, turn = as_pose(increment, "increment").tolist()
    c, s = math.cos(heading), math.sin(heading)
    new_x = x + (c * dx - s * dy)  # (5.2)
    new_y = y + (s * dx + c * dy)
    return np.array([new_x, new_y, wrap(heading + turn)])  # (5.1)


def is_within(motion: FloatArray, limits: tuple[float, float]) -> bool:
    """True if a motion (3,) leads no farther than the limits, [m] and [rad]; NaN is not within.

    A turn may be a difference of two, beyond half a turn.
    """
    x, y, turn = motion.tolist()
    return math.hypot(x, y) <= limits[0] and abs(math.remainder(turn, math.tau)) <= limits[1]


def integrate(increments: ArrayLike, start: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Poses (K+1, 3) from K increments (K, 3), each in the frame of the pose before it."""
    still = np.zeros((1, 3))  # only wraps the heading of the start
    steps = np.vstack([still, as_poses(increments, "increments", minimum=0)])
    poses = list(accumulate(steps, integrate_step, initial=as_pose(start, "start")))
    return np.array(poses)[1:]


def increments_between(poses: ArrayLike) -> FloatArray:
    """Increments (K−1, 3) that `integrate` turns back into the poses (K, 3) or (K, 3, 3).

    A pose of NaN is unknown, and so are the increments before it and after it.
    """
    rows = as_poses(poses, "poses", gaps=True)
    is_unknown = np.isnan(rows)
    T_world = matrices_of(np.nan_to_num(rows))
    steps = to_xytheta(relative(T_world[:-1], T_world[1:]))
    return np.where(is_unknown[:-1] | is_unknown[1:], np.nan, steps)


def increments_of_scanner(increments: FloatArray, laser_offset: ArrayLike) -> FloatArray:
    """Motions of a scanner that sits at `laser_offset` on the robot, by the robot's, (K, 3).

    ``T_laser = T_robot_laser⁻¹ @ T_robot @ T_robot_laser``; a row of NaN stays one.
    """
    offset = as_numbers(laser_offset, "laser_offset", "x, y, θ")
    check_angles(offset[2:], "laser_offset")
    T_robot_laser = matrices_of(offset)
    motions = np.full_like(increments, np.nan)
    is_known = np.isfinite(increments).all(axis=1)
    if is_known.any():
        T_robot = matrices_of(increments[is_known])
        motions[is_known] = to_xytheta(relative(T_robot_laser, T_robot @ T_robot_laser))
    return motions
