"""CARMEN logs: ``FLASER`` and ``ROBOTLASER1`` scans, each with the odometry at its time.

``ODOM x y theta tv rv accel ipc_timestamp host logger_timestamp`` lines are checked and
passed over, since every scan brings its own pose; ``PARAM``, ``NEFF``, ``#``,
``RAWLASER…``, ``TRUEPOS`` and all other first words are passed over unread.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labkit.arrays import FloatArray
from labkit.errors import LogError
from labkit.logs.laser_lines import LASER_WORDS, parse_laser_line
from labkit.logs.laser_scans import LaserScans
from labkit.logs.lines import DamagedLine, DamageReport, expect_fields, pose, time
from labkit.logs.log import LogStream
from labkit.logs.poses import PoseTable, agree_on_mounting, move_to_scanner, refuse_second_offset
from labkit.logs.source import TextSource

CARMEN_WORDS = LASER_WORDS | {"ODOM", "PARAM", "NEFF", "TRUEPOS", "RAWLASER1"}
"""First words of a line that tell a CARMEN log."""


def read_carmen(
    source: TextSource,
    report: DamageReport,
    scans: LaserScans,
    *,
    name: str,
    laser_offset: FloatArray,
) -> LogStream:
    """Read a CARMEN log; see `labkit.logs.read_log` for the parameters.

    The odometry is the pose of the *scanner*. Which pose of the line that is, the two
    triples tell: where both are equal, the log does not say where the scanner sits, and
    `laser_offset` is composed on; where they differ by one fixed mounting, it is the
    laser's triple; where their difference changes along the run, the laser's triple is
    no odometry but a corrected pose: it becomes the reference, and the odometry is the
    robot's triple with `laser_offset`. A few lines that contradict the others decide
    nothing: their poses are damaged, and they are skipped.
    """
    sick = False
    for number, text in source.lines(report):
        fields = text.split()
        try:
            if fields and fields[0] in LASER_WORDS:
                scans.add(number, parse_laser_line(fields))
                sick = sick or fields[0] == "FLASER"
            elif fields and fields[0] == "ODOM":
                _check_odom(fields)
        except DamagedLine as damage:
            report.skip(number, damage)
    if not len(scans):
        raise LogError(
            f"{report.file}: a CARMEN log without any scan, expected FLASER or ROBOTLASER1 "
            f"lines{report.summary()}"
        )
    table, mount = agree_on_mounting(scans.table(), report)
    odometry, reference = _scanner_poses(table, mount, laser_offset, report.file)
    return LogStream(
        scans=scans.stream(source, table, report, sick=sick),
        stamps=table.stamps,
        odometry=odometry,
        reference=reference,
        name=name,
        format="carmen",
        skipped=report.skipped,
        remarks=report.remarks,
    )


def _check_odom(fields: Sequence[str]) -> None:
    expect_fields(fields, 10, "ODOM")
    pose(fields[1:4], "the robot pose")
    time(fields[7], "the timestamp")


def _scanner_poses(
    table: PoseTable, mount: FloatArray | None, laser_offset: FloatArray, file: str
) -> tuple[FloatArray, FloatArray | None]:
    """The scanner's odometry and, in a corrected log, its reference."""
    laser = move_to_scanner(table.laser, np.zeros(3))
    if mount is None:
        return move_to_scanner(table.robot, laser_offset), laser
    if not mount.any():
        return move_to_scanner(table.robot, laser_offset), None
    refuse_second_offset(laser_offset, mount, file)
    return laser, None
