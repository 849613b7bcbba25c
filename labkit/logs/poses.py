"""Rows of poses (x, y, θ): and the way from the robot to its scanner."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import BoolArray, FloatArray, as_floats
from labkit.errors import InvalidParameterError, LogError
from labkit.logs.laser_lines import LaserLine
from labkit.logs.lines import DamageReport
from labkit.se2 import from_xytheta, relative, to_xytheta, transform, wrap

SAME_PLACE = 0.1
"""A line whose pose lies farther from where other lines put it [m, rad] contradicts them."""

PRINTED = 1e-5
"""Two poses that differ by no more than this [m, rad] differ by their printed decimals."""

DAMAGED_SHARE = 0.02
"""No larger share of the lines contradicts all others by damage alone."""


def as_offset(laser_offset: ArrayLike) -> FloatArray:
    """Check the place of the scanner on the robot, (x [m], y [m], θ [rad])."""
    offset = as_floats(laser_offset, "laser_offset", hint="give (x, y, θ)")
    if offset.shape != (3,) or not np.isfinite(offset).all():
        raise InvalidParameterError(
            f"must be three finite numbers x, y, θ, got {laser_offset!r}", parameter="laser_offset"
        )
    return offset


def move_to_scanner(poses: FloatArray, offset: FloatArray) -> FloatArray:
    """Poses of the scanner, ``T_w_laser = T_w_robot @ T_robot_laser``, θ wrapped.

    Parameters
    ----------
    poses : ndarray, shape (K, 3)
        The robot's poses in the world.
    offset : ndarray, shape (3,)
        The scanner's pose on the robot; zeros give the poses back bit for bit.

    Returns
    -------
    ndarray, shape (K, 3)
    """
    T_w_laser = from_xytheta(poses) @ transform(offset[0], offset[1], 0.0)
    theta = wrap(poses[:, 2] + offset[2])
    return np.column_stack([T_w_laser[:, 0, 2], T_w_laser[:, 1, 2], theta])


def agree_on_mounting(
    found: dict[int, LaserLine], report: DamageReport
) -> tuple[dict[int, LaserLine], FloatArray | None]:
    """Where the scanner sits on the robot, by the two poses of each laser line.

    A few lines that contradict all others hold a damaged pose, and are skipped.

    Parameters
    ----------
    found : dict of LaserLine
        The laser lines of a log by their number.
    report : DamageReport
        Takes the lines that are left out.

    Returns
    -------
    kept : dict of LaserLine
        The lines that agree; all of them where there is no mounting.
    mount : ndarray, shape (3,), or None
        ``T_robot_laser`` as (x [m], y [m], θ [rad]), the median over the lines: zeros where
        laser and robot coincide, so that the log does not say; None where their difference
        changes along the run, so that the laser's triple is a corrected pose.
    """
    laser = np.array([line.laser for line in found.values()])
    robot = np.array([line.robot for line in found.values()])
    mounts = to_xytheta(relative(from_xytheta(robot), from_xytheta(laser)))
    mount = _median(mounts)
    odd = beyond(to_xytheta(relative(from_xytheta(mount), from_xytheta(mounts))), SAME_PLACE)
    if not is_few(odd):
        return found, None
    reason = f"the laser sits {{}} on the robot, in other lines {_text(mount)}"
    kept = leave_out(found, odd, mounts, reason, report)
    return kept, mount if (np.abs(mount) > PRINTED).any() else np.zeros(3)


def leave_out(
    found: dict[int, LaserLine],
    odd: BoolArray,
    offsets: FloatArray,
    reason: str,
    report: DamageReport,
) -> dict[int, LaserLine]:
    """The laser lines without the odd ones, which are reported with their offset for the {}."""
    kept = {}
    for (number, line), leave, offset in zip(found.items(), odd, offsets, strict=True):
        if leave:
            report.skip(number, reason.format(_text(offset)))
        else:
            kept[number] = line
    return kept


def beyond(offsets: FloatArray, tolerance: float) -> BoolArray:
    """Which rows (x [m], y [m], θ [rad]) exceed the tolerance in any number, shape (K,)."""
    mask: BoolArray = np.any(np.abs(offsets) > tolerance, axis=1)
    return mask


def is_few(lines: BoolArray) -> bool:
    """Whether a mask over all lines marks so few that they are damage, not what the log says."""
    one_of_three = min(1, len(lines) // 3)
    return bool(np.count_nonzero(lines) <= max(one_of_three, DAMAGED_SHARE * len(lines)))


def refuse_second_offset(laser_offset: FloatArray, mount: FloatArray, file: str) -> None:
    """Raise `LogError` if the caller gives an offset where the log declares its own."""
    if laser_offset.any():
        raise LogError(
            f"{file}: the log itself says where the scanner sits on the robot {_text(mount)}, "
            f"and `laser_offset` is {tuple(laser_offset.tolist())}; leave `laser_offset` out"
        )


def _median(mounts: FloatArray) -> FloatArray:
    """Median of each number; that of θ about the mean direction, where ±π are one."""
    x, y, theta = mounts.T
    mean = np.arctan2(np.sin(theta).mean(), np.cos(theta).mean())
    return np.array([np.median(x), np.median(y), wrap(mean + np.median(wrap(theta - mean)))])


def _text(mount: FloatArray) -> str:
    x, y, theta = np.round(mount, 4) + 0.0  # without the sign of a zero
    return f"({x:.3f} m, {y:.3f} m, {theta:.4f} rad)"
