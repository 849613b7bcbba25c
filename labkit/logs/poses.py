"""Rows of poses (x, y, θ): and the way from the robot to its scanner."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_floats
from labkit.errors import InvalidParameterError, LogError
from labkit.se2 import from_xytheta, relative, to_xytheta, transform, wrap


def as_offset(laser_offset: ArrayLike) -> FloatArray:
    """Check the place of the scanner on the robot, (x [m], y [m], θ [rad])."""
    offset = as_floats(laser_offset, "laser_offset", hint="give (x, y, θ)")
    if offset.shape != (3,) or not np.isfinite(offset).all():
        raise InvalidParameterError(
            f"`laser_offset` must be three finite numbers x, y, θ, got {laser_offset!r}"
        )
    return offset


def move_to_scanner(poses: FloatArray, offset: FloatArray) -> FloatArray:
    """Poses of the scanner, ``T_w_laser = T_w_robot @ T_robot_laser``, θ wrapped.

    Parameters
    ----------
    poses : ndarray, shape (K, 3)
        The robot's poses in the world.
    offset : ndarray, shape (3,) or (K, 3)
        The scanner's pose on the robot; zeros give the poses back bit for bit.

    Returns
    -------
    ndarray, shape (K, 3)
    """
    T_w_laser = from_xytheta(poses) @ transform(offset[..., 0], offset[..., 1], 0.0)
    theta = wrap(poses[:, 2] + offset[..., 2])
    return np.column_stack([T_w_laser[:, 0, 2], T_w_laser[:, 1, 2], theta])


def mounting(laser: FloatArray, robot: FloatArray) -> FloatArray:
    """Where the scanner sits on the robot by each line's two poses, shape (K, 3)."""
    return to_xytheta(relative(from_xytheta(robot), from_xytheta(laser)))


def is_declared(mounts: FloatArray) -> bool:
    """Whether the two poses differ by more than their six printed decimals."""
    return bool((np.abs(mounts) > 1e-5).any())


def is_rigid(mounts: FloatArray, tolerance: float = 0.1) -> bool:
    """Whether all mountings are one, within `tolerance` metres and radians."""
    T = from_xytheta(mounts)
    return bool((np.abs(to_xytheta(relative(T[0], T))) <= tolerance).all())


def refuse_second_offset(laser_offset: FloatArray, mounts: FloatArray, file: str) -> None:
    """Raise `LogError` if the caller gives an offset where the log declares its own."""
    if laser_offset.any():
        x, y, theta = np.median(mounts, axis=0)
        raise LogError(
            f"{file}: the log itself says where the scanner sits on the robot "
            f"({x:.3f} m, {y:.3f} m, {theta:.4f} rad), and `laser_offset` is "
            f"{tuple(laser_offset.tolist())}; leave `laser_offset` out"
        )
