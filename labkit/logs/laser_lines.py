"""The two lines that carry a scan, ``FLASER`` and ``ROBOTLASER1``: one parser for all logs.

::

    FLASER n r1 … rn x y theta odom_x odom_y odom_theta ipc_timestamp host logger_timestamp

    ROBOTLASER1 type start fov res maxrange accuracy remission_mode n r1 … rn m rem1 … remm
                laser_x laser_y laser_th robot_x robot_y robot_th
                tv rv forward_safety side_safety turn_axis timestamp host logger_timestamp

An ``FLASER`` line says nothing of its beams. By convention the first one looks to −90°,
and the step is π/n for an even count, π/(n − 1) for an odd one (180 or 181 beams).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from labkit.arrays import BoolArray, FloatArray
from labkit.logs.lines import DamagedLine, count, expect_fields, finite, numbers, pose, time
from labkit.scan import Scan

LASER_WORDS = frozenset({"FLASER", "ROBOTLASER1"})

SICK_NO_RETURN = 81.8
"""From here on a SICK says "no return" [m]: 81.83 and 81.91 are met in logs."""

Pose = tuple[float, float, float]


@dataclass(frozen=True, eq=False, kw_only=True)
class LaserLine:
    """What one laser line says: the scan, and the poses (x, y, θ) of laser and robot."""

    scan: Scan
    laser: Pose
    robot: Pose


def parse_laser_line(fields: Sequence[str], range_max: float | None = None) -> LaserLine:
    """Read the fields of an ``FLASER`` or ``ROBOTLASER1`` line.

    Parameters
    ----------
    fields : sequence of str
        The line, split at white space, first word included.
    range_max : float, optional
        Beams at or beyond it [m] make no point. By default it is the maximum that the
        line declares; an ``FLASER`` line declares none, and there the no-return codes
        known from logs are dropped (0, 32.767, 50 to 52, 81.8 and more).

    Raises
    ------
    DamagedLine
        If a count does not match, or a field is not the number it should be.
    """
    read = _flaser if fields[0] == "FLASER" else _robotlaser
    return read(fields, range_max)


def timed_scans(found: Iterable[LaserLine]) -> tuple[Scan, ...]:
    """The scans of a log's lines; their stamps NaN where no line has a time, but only zeros."""
    scans = tuple(line.scan for line in found)
    if any(scan.stamp for scan in scans):  # then a zero is where their clock began
        return scans
    return tuple(replace(scan, stamp=math.nan) for scan in scans)


def _flaser(fields: Sequence[str], range_max: float | None) -> LaserLine:
    n = count(fields, 1, "beams", at_least=2)
    expect_fields(fields, n + 11, f"FLASER with {n} beams")
    step = math.pi / (n if n % 2 == 0 else n - 1)
    ranges = np.array(numbers(fields[2 : n + 2], "range"))
    scan = Scan.from_ranges(
        ranges,
        _beam_angles(-math.pi / 2, step, n),
        stamp=_stamp(*fields[n + 8 :]),
        range_max=math.inf if range_max is None else range_max,
    )
    if range_max is None:
        scan = scan.select(~_is_no_return(ranges[scan.beams]))
    laser = pose(fields[n + 2 : n + 5], "the laser pose")
    return LaserLine(scan=scan, laser=laser, robot=pose(fields[n + 5 : n + 8], "the robot pose"))


def _robotlaser(fields: Sequence[str], range_max: float | None) -> LaserLine:
    n = count(fields, 8, "beams", at_least=1)
    m = count(fields, n + 9, "remissions", at_least=0)
    expect_fields(fields, n + m + 24, f"ROBOTLASER1 with {n} beams and {m} remissions")
    start, fov, step, declared = (
        finite(field, name)
        for field, name in zip(
            fields[2:6],
            ("start angle", "field of view", "angular step", "maximum range"),
            strict=True,
        )
    )
    if not (abs(start) <= 2.0 * math.pi and 0.0 < step <= 2.0 * math.pi):
        raise DamagedLine(
            f"beams from {start:g} in steps of {step:g}, expected radians and a positive step"
        )
    if declared <= 0.0:
        raise DamagedLine(f"the maximum range is {declared:g}, expected a positive number")
    scan = Scan.from_ranges(
        numbers(fields[9 : n + 9], "range"),
        _beam_angles(start, _refine(step, fov, n), n),
        stamp=_stamp(*fields[-3:]),
        range_max=_declared_maximum(declared) if range_max is None else range_max,
    )
    first = n + m + 10
    laser = pose(fields[first : first + 3], "the laser pose")
    robot = pose(fields[first + 3 : first + 6], "the robot pose")
    return LaserLine(scan=scan, laser=laser, robot=robot)


def _declared_maximum(declared: float) -> float:
    # A SICK declared with its full 81.92 m still answers 81.83 where nothing came back.
    return SICK_NO_RETURN if SICK_NO_RETURN < declared < 82.0 else declared


def _is_no_return(ranges: FloatArray) -> BoolArray:
    signed_16_bit = np.abs(ranges - 32.767) < 0.005
    fifty = (ranges >= 50.0) & (ranges < 52.0)
    mask: BoolArray = signed_16_bit | fifty | (ranges >= SICK_NO_RETURN)
    return mask


def _refine(step: float, fov: float, n: int) -> float:
    """The step as a fraction of the field of view, where that agrees with its six decimals.

    0.017453 is short of one degree by 3e-7 rad, which 179 steps make 5e-5 rad.
    """
    for exact in (fov / n, fov / max(n - 1, 1)):
        if abs(exact - step) <= 1e-6:
            return exact
    return step


@lru_cache(maxsize=64)
def _beam_angles(start: float, step: float, n: int) -> FloatArray:
    angles = np.asarray(start + step * np.arange(n), dtype=np.float64)
    angles.flags.writeable = False  # all scans of one scanner share it
    return angles


def _stamp(ipc: str, host: str, logger: str) -> float:
    """The time of the message [s]; the logger's clock where the message has none (0)."""
    ipc_stamp = time(ipc, f"the timestamp beside host {host!r}")
    logger_stamp = time(logger, f"the logger timestamp beside host {host!r}")
    return ipc_stamp or logger_stamp
