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
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from labkit.arrays import FloatArray
from labkit.logs.lines import DamagedLine, count, expect_fields, finite, numbers, pose, time
from labkit.logs.no_return import Beams, declared_maximum

LASER_WORDS = frozenset({"FLASER", "ROBOTLASER1"})

Pose = tuple[float, float, float]


@dataclass(frozen=True, eq=False, kw_only=True)
class LaserLine:
    """What one laser line says: the sweep, and the poses (x, y, θ) of laser and robot."""

    beams: Beams
    laser: Pose
    robot: Pose


def parse_laser_line(fields: Sequence[str]) -> LaserLine:
    """Read the fields of an ``FLASER`` or ``ROBOTLASER1`` line, first word included.

    Raises
    ------
    DamagedLine
        If a count does not match, or a field is not the number it should be.
    """
    return _flaser(fields) if fields[0] == "FLASER" else _robotlaser(fields)


def _flaser(fields: Sequence[str]) -> LaserLine:
    n = count(fields, 1, "beams", at_least=2)
    expect_fields(fields, n + 11, f"FLASER with {n} beams")
    step = math.pi / (n if n % 2 == 0 else n - 1)
    beams = Beams(
        ranges=np.array(numbers(fields[2 : n + 2], "range")),
        angles=beam_angles(-math.pi / 2, step, n),
        stamp=_stamp(*fields[n + 8 :]),
    )
    laser = pose(fields[n + 2 : n + 5], "the laser pose")
    return LaserLine(beams=beams, laser=laser, robot=pose(fields[n + 5 : n + 8], "the robot pose"))


def _robotlaser(fields: Sequence[str]) -> LaserLine:
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
    beams = Beams(
        ranges=np.array(numbers(fields[9 : n + 9], "range")),
        angles=beam_angles(start, _refine(step, fov, n), n),
        stamp=_stamp(*fields[-3:]),
        range_max=declared_maximum(declared),
    )
    first = n + m + 10
    laser = pose(fields[first : first + 3], "the laser pose")
    robot = pose(fields[first + 3 : first + 6], "the robot pose")
    return LaserLine(beams=beams, laser=laser, robot=robot)


def _refine(step: float, fov: float, n: int) -> float:
    """The step as a fraction of the field of view, where that agrees with its six decimals.

    0.017453 is short of one degree by 3e-7 rad, which 179 steps make 5e-5 rad.
    """
    for exact in (fov / n, fov / max(n - 1, 1)):
        if abs(exact - step) <= 1e-6:
            return exact
    return step


@lru_cache(maxsize=64)
def beam_angles(start: float, step: float, n: int) -> FloatArray:
    """Directions of n beams [rad], read-only: all scans of one scanner share them."""
    angles = np.asarray(start + step * np.arange(n), dtype=np.float64)
    angles.flags.writeable = False
    return angles


def _stamp(ipc: str, host: str, logger: str) -> float:
    """The time of the message [s]; the logger's clock where the message has none (0)."""
    ipc_stamp = time(ipc, f"the timestamp beside host {host[:30]!r}")
    logger_stamp = time(logger, f"the logger timestamp beside host {host[:30]!r}")
    return ipc_stamp or logger_stamp
