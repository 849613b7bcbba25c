"""The poses of a log's laser lines: what they say of the scanner's place on the robot."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import BoolArray, FloatArray, IntArray, as_floats
from labkit.errors import InvalidParameterError, LogError
from labkit.logs.laser_lines import LaserLine, Pose
from labkit.logs.lines import DamageReport
from labkit.se2 import from_xytheta, relative, to_xytheta, transform, wrap

SAME_PLACE = 0.1
"""A line whose pose lies farther from where other lines put it [m, rad] contradicts them."""

PRINTED = 1e-5
"""Two poses that differ by no more than this [m, rad] differ by their printed decimals."""

DAMAGED_SHARE = 0.02
"""No larger share of the lines contradicts all others by damage alone."""


class PoseColumns:
    """Collects the poses and times of laser lines, 80 bytes a line."""

    def __init__(self) -> None:
        self._numbers = array("q")
        self._rows = array("d")

    def __len__(self) -> int:
        """How many lines there are."""
        return len(self._numbers)

    def add(self, number: int, line: LaserLine, vertex: Pose = (0.0, 0.0, 0.0)) -> None:
        """Take down what one line says."""
        self._numbers.append(number)
        self._rows.extend((line.beams.stamp, *line.laser, *line.robot, *vertex))

    def table(self) -> PoseTable:
        """What was collected, as arrays."""
        rows = np.array(self._rows).reshape(-1, 10)
        return PoseTable(
            numbers=np.array(self._numbers, dtype=np.intp),
            stamps=rows[:, 0],
            laser=rows[:, 1:4],
            robot=rows[:, 4:7],
            vertices=rows[:, 7:],
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseTable:
    """The laser lines of a log without their ranges.

    Attributes
    ----------
    numbers : ndarray of int, shape (K,)
        The lines' numbers in the file.
    stamps : ndarray, shape (K,)
        Times [s].
    laser, robot, vertices : ndarray, shape (K, 3)
        Poses (x [m], y [m], θ [rad]): both triples of the line, and the vertex above it.
    """

    numbers: IntArray
    stamps: FloatArray
    laser: FloatArray
    robot: FloatArray
    vertices: FloatArray

    def select(self, kept: BoolArray) -> PoseTable:
        """The lines that a mask names."""
        return PoseTable(**{name: rows[kept] for name, rows in vars(self).items()})

    def timed(self) -> PoseTable:
        """The stamps NaN where no line has a time, but only zeros."""
        if self.stamps.any():  # then a zero is where their clock began
            return self
        return replace(self, stamps=np.full(len(self.stamps), np.nan))


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
    table: PoseTable, report: DamageReport
) -> tuple[PoseTable, FloatArray | None]:
    """Where the scanner sits on the robot, by the two poses of each laser line.

    A few lines that contradict all others hold a damaged pose, and are skipped.

    Parameters
    ----------
    table : PoseTable
        The laser lines of a log.
    report : DamageReport
        Takes the lines that are left out.

    Returns
    -------
    kept : PoseTable
        The lines that agree; all of them where there is no mounting.
    mount : ndarray, shape (3,), or None
        ``T_robot_laser`` as (x [m], y [m], θ [rad]), the median over the lines: zeros where
        laser and robot coincide, so that the log does not say; None where their difference
        changes along the run, so that the laser's triple is a corrected pose.
    """
    mounts = to_xytheta(relative(from_xytheta(table.robot), from_xytheta(table.laser)))
    mount = _median(mounts)
    odd = beyond(to_xytheta(relative(from_xytheta(mount), from_xytheta(mounts))), SAME_PLACE)
    if not is_few(odd):
        return table, None
    reason = f"the laser sits {{}} on the robot, in other lines {_text(mount)}"
    kept = leave_out(table, odd, mounts, reason, report)
    return kept, mount if (np.abs(mount) > PRINTED).any() else np.zeros(3)


def leave_out(
    table: PoseTable, odd: BoolArray, offsets: FloatArray, reason: str, report: DamageReport
) -> PoseTable:
    """The laser lines without the odd ones, which are reported with their offset for the {}."""
    for number, offset in zip(table.numbers[odd].tolist(), offsets[odd], strict=True):
        report.skip(number, reason.format(_text(offset)))
    return table.select(~odd)


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
