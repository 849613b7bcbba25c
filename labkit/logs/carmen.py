"""CARMEN logs: ``FLASER`` and ``ROBOTLASER1`` scans, each with the odometry at its time.

``ODOM x y theta tv rv accel ipc_timestamp host logger_timestamp`` lines are checked and
passed over, since every scan brings its own pose; ``PARAM``, ``NEFF``, ``#``,
``RAWLASER…``, ``TRUEPOS`` and all other first words are passed over unread.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from labkit.arrays import FloatArray
from labkit.errors import LogError
from labkit.logs.laser_lines import LASER_WORDS, LaserLine, parse_laser_line, timed_scans
from labkit.logs.lines import DamagedLine, DamageReport, expect_fields, pose, time
from labkit.logs.log import Log
from labkit.logs.poses import agree_on_mounting, move_to_scanner, refuse_second_offset

CARMEN_WORDS = LASER_WORDS | {"ODOM", "PARAM", "NEFF", "TRUEPOS", "RAWLASER1"}
"""First words of a line that tell a CARMEN log."""


def read_carmen(
    lines: Sequence[str],
    report: DamageReport,
    *,
    name: str,
    range_max: float | None,
    laser_offset: FloatArray,
) -> Log:
    """Read the lines of a CARMEN log; see `labkit.logs.read_log` for the parameters.

    The odometry is the pose of the *scanner*. Which pose of the line that is, the two
    triples tell: where both are equal, the log does not say where the scanner sits, and
    `laser_offset` is composed on; where they differ by one fixed mounting, it is the
    laser's triple; where their difference changes along the run, the laser's triple is
    no odometry but a corrected pose: it becomes the reference, and the odometry is the
    robot's triple with `laser_offset`. A few lines that contradict the others decide
    nothing: their poses are damaged, and they are skipped.
    """
    found: dict[int, LaserLine] = {}
    for number, line in enumerate(lines, start=1):
        fields = line.split()
        try:
            if fields and fields[0] in LASER_WORDS:
                found[number] = parse_laser_line(fields, range_max)
            elif fields and fields[0] == "ODOM":
                _check_odom(fields)
        except DamagedLine as damage:
            report.skip(number, damage)
    if not found:
        raise LogError(
            f"{report.file}: a CARMEN log without any scan, expected FLASER or ROBOTLASER1 "
            f"lines{report.summary()}"
        )
    found, mount = agree_on_mounting(found, report)
    odometry, reference = _scanner_poses(found.values(), mount, laser_offset, report.file)
    return Log(
        scans=timed_scans(found.values()),
        odometry=odometry,
        reference=reference,
        name=name,
        format="carmen",
        skipped=report.skipped,
    )


def _check_odom(fields: Sequence[str]) -> None:
    expect_fields(fields, 10, "ODOM")
    pose(fields[1:4], "the robot pose")
    time(fields[7], "the timestamp")


def _scanner_poses(
    found: Collection[LaserLine], mount: FloatArray | None, laser_offset: FloatArray, file: str
) -> tuple[FloatArray, FloatArray | None]:
    """The scanner's odometry and, in a corrected log, its reference."""
    laser = move_to_scanner(np.array([line.laser for line in found]), np.zeros(3))
    robot = np.array([line.robot for line in found])
    if mount is None:
        return move_to_scanner(robot, laser_offset), laser
    if not mount.any():
        return move_to_scanner(robot, laser_offset), None
    refuse_second_offset(laser_offset, mount, file)
    return laser, None
