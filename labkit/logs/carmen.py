"""CARMEN logs: text with laser lines ``FLASER`` and ``ROBOTLASER1``.

::

    FLASER n r1 … rn x y theta odom_x odom_y odom_theta ipc_timestamp host logger_timestamp

    ROBOTLASER1 type start fov res maxrange accuracy remission_mode n r1 … rn m rem1 … remm
                laser_x laser_y laser_th robot_x robot_y robot_th
                tv rv forward_safety side_safety turn_axis timestamp host logger_timestamp

An ``FLASER`` line says nothing of its beams. By convention the first one looks to −90°,
and the step is π/n for an even count, π/(n − 1) for an odd one (180 or 181 beams); from 81.8 m
on, its scanner reports no return.
Every scan brings its own pose, so ``ODOM`` and all other first words are passed over unread.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from labkit.logs.lines import (
    DamagedLine,
    expect_fields,
    parse_count,
    parse_finite,
    parse_numbers,
    parse_pose,
)
from labkit.logs.log import Content
from labkit.logs.reader import Reader, Reading, Source, Sweep
from labkit.scan import scanner_poses
from labkit.se2 import matrices_of, relative, to_xytheta, wrap
from labkit.support.arrays import FloatArray
from labkit.support.errors import LogError

WORDS = frozenset({"FLASER", "ROBOTLASER1", "ODOM", "PARAM", "NEFF", "TRUEPOS"})
USES = ("angles", "no_return", "laser_offset", "time_increment", "angle_unit", "blind_beams")
FLASER_MAXIMUM = 81.8  # [m]
MAX_MOUNT_DIFFERENCE = 0.1  # [m, rad]: largest difference of two lines that tell one mounting
PRINTED_PRECISION = 1e-4  # [m, rad]: difference of two poses by their printed decimals alone
Pose = tuple[float, float, float]
RobotPose = tuple[float, float, float, float]  # with its time [s] first


class LaserLine(NamedTuple):
    """A sweep, and the poses that its line tells."""

    sweep: Sweep
    laser: Pose
    robot: Pose


def read(source: Source) -> Reading:
    """Read the laser lines; where they say it, the laser's poses are its odometry."""
    words = Counter[str]()

    def parse(number: int, text: str) -> LaserLine | None:
        words.update(text[:16].split(maxsplit=1)[:1])
        return _parse_line(number, text, source)

    lines = source.part(source.parse(parse, source.lines()))
    contents = [Content(word, f"{count} lines", _use(word)) for word, count in words.items()]
    if not lines:
        return Reading(contents=contents)
    mount, is_rigid = find_mount(lines)
    odometry, reference = scanner_trajectories(lines, mount, is_rigid, source)
    sweeps = [line.sweep for line in lines]
    return Reading(
        sweeps=sweeps,
        odometry=odometry,
        reference=reference,
        offset=mount if mount.any() else None,
        contents=contents,
    )


def _use(word: str) -> str:
    """The use of lines of a first word; none for those of another scanner."""
    if word in {"FLASER", "ROBOTLASER1"}:
        return "scans"
    return "" if "LASER" in word else "left aside"


def _parse_line(number: int, text: str, source: Source) -> LaserLine | None:
    """A laser line; None for a line of another first word."""
    word = text[:16].split(maxsplit=1)[:1]
    if word == ["FLASER"]:
        return _parse_flaser(number, text.split(), source)
    if word == ["ROBOTLASER1"]:
        return parse_robotlaser(number, text.split(), source)
    return None


def scanner_trajectories(
    lines: Sequence[LaserLine], mount: FloatArray, is_rigid: bool, source: Source
) -> tuple[FloatArray, FloatArray | None]:
    """Choose odometry and reference from the poses of the lines, as poses of the scanner.

    Where the laser's triple and the robot's tell one mounting for the whole log, the laser's
    triple is the odometry; where the `mount` is zero, the log does not say it, and `laser_offset`
    is composed on. Where it is not rigid, the laser's triple is a corrected pose: it
    becomes the reference, and the odometry is the robot's triple with `laser_offset`.
    """
    laser = np.array([line.laser for line in lines])
    robot = np.array([line.robot for line in lines])
    laser_offset = source.options.offset
    laser[:, 2] = wrap(laser[:, 2])
    if expect_one_mount(mount, laser_offset, source.report.file):
        return laser, None
    return scanner_poses(robot, laser_offset), None if is_rigid else laser


def find_mount(lines: Sequence[LaserLine]) -> tuple[FloatArray, bool]:
    """T_robot_laser (3,) by the two poses of each line, and whether it is one for all lines.

    Zero where it is none, or where the lines do not say it.
    """
    laser = matrices_of(np.array([line.laser for line in lines]))
    robot = matrices_of(np.array([line.robot for line in lines]))
    mounts = to_xytheta(relative(robot, laser))
    x, y, theta = mounts.T
    cosine, sine = np.median(np.cos(theta)), np.median(np.sin(theta))  # where ±π are one
    mount = np.array([np.median(x), np.median(y), np.arctan2(sine, cosine)])
    differences = np.abs(to_xytheta(relative(matrices_of(mount), matrices_of(mounts))))
    is_rigid = largest_usual(differences.max(axis=1)) <= MAX_MOUNT_DIFFERENCE
    is_told = is_rigid and bool(np.abs(mount).max() > PRINTED_PRECISION)
    return (mount if is_told else np.zeros(3)), is_rigid


def expect_one_mount(mount: FloatArray, laser_offset: FloatArray, file: str) -> bool:
    """True if the log tells the scanner's place; `LogError` if the caller does so, too."""
    if not mount.any():
        return False
    if laser_offset.any():
        raise LogError(
            f"{file}: the log itself says where the scanner sits on the robot, at "
            f"{mount.round(4).tolist()} (m, m, rad); leave `laser_offset` out"
        )
    return True


def _parse_flaser(number: int, fields: Sequence[str], source: Source) -> LaserLine:
    n = parse_count(fields, 1, "beams", at_least=2)
    expect_fields(fields, n + 11, f"FLASER with {n} beams")
    step = math.pi / (n if n % 2 == 0 else n - 1)
    angles = source.scanner.beams(n, -math.pi / 2, step)
    ranges = parse_numbers(fields[2 : n + 2], "range")
    stamp = parse_stamps(*fields[-3:])
    scan = source.scanner.scan(ranges, angles, stamp=stamp, band=(0.0, FLASER_MAXIMUM))
    return LaserLine(
        Sweep(number, scan),
        laser=parse_pose(fields[n + 2 : n + 5], "the laser pose"),
        robot=parse_pose(fields[n + 5 : n + 8], "the robot pose"),
    )


def parse_robotlaser(number: int, fields: Sequence[str], source: Source) -> LaserLine:
    """Read a line ``ROBOTLASER1``; `LabkitError` names what is damaged."""
    sweep, poses = parse_beams(number, fields, 14, source)
    return LaserLine(
        sweep,
        laser=parse_pose(poses[:3], "the laser pose"),
        robot=parse_pose(poses[3:6], "the robot pose"),
    )


def parse_beams(
    number: int, fields: Sequence[str], rest: int, source: Source
) -> tuple[Sweep, Sequence[str]]:
    """The sweep of a line with a scanner's configuration, and the `rest` of its fields."""
    n = parse_count(fields, 8, "beams", at_least=1)
    m = parse_count(fields, n + 9, "remissions", at_least=0)
    expect_fields(fields, n + m + 10 + rest, f"{fields[0]} with {n} beams and {m} remissions")
    names = ("start angle", "field of view", "angular step", "maximum range")
    start, fov, step, longest = map(parse_finite, fields[2:6], names)
    if step <= 0.0:
        raise DamagedLine(f"the angular step is {step:g}, expected a positive number")
    # 0.017453 is short of one degree by 3e-7 rad, which 179 steps make 5e-5 rad.
    exact = (each for each in (fov / n, fov / max(n - 1, 1)) if abs(each - step) <= 1e-6)
    declared = {
        "angle_min": (start, 1.0),
        "angle_increment": (next(exact, step), 1.0),
        "range_max": (longest, 1.0),
    }
    ranges = parse_numbers(fields[9 : n + 9], "range")
    scan = source.scanner.sweep(ranges, declared, stamp=parse_stamps(*fields[-3:]))
    return Sweep(number, scan), fields[n + m + 10 :]


def parse_stamps(ipc: str, host: str, logger: str) -> float:
    """Time of the message [s]; the logger's clock if the message has none (0)."""
    ipc_stamp = parse_finite(ipc, f"the timestamp beside host {host[:30]!r}")
    return ipc_stamp or parse_finite(logger, f"the logger timestamp beside host {host[:30]!r}")


def largest_usual(gaps: FloatArray) -> float:
    """Largest gap without the worst tenth of the lines, or one of three lines."""
    few = max(min(1, len(gaps) // 3), len(gaps) // 10)
    return float(np.sort(gaps)[-1 - few])


def read_wheels(source: Source) -> FloatArray:
    """The robot's poses of ``ODOM`` lines, or else of laser lines, rows (t, x, y, θ)."""
    odom = list[RobotPose]()

    def parse(number: int, text: str) -> RobotPose | None:
        fields = text.split()
        if fields[:1] == ["ODOM"]:
            odom.append(parse_odom(fields))
        line = _parse_line(number, text, source)
        return None if line is None else (line.sweep.scan.stamp, *line.robot)

    laser = list(source.parse(parse, source.lines()))
    if not odom and not laser:
        raise LogError(f"{source.report.file}: a carmen log without a pose of the robot")
    return np.array(odom or laser)


def parse_odom(fields: Sequence[str]) -> RobotPose:
    """Time, x, y and θ of the robot by a line ``ODOM``."""
    expect_fields(fields, 10, "ODOM")
    return parse_stamps(*fields[-3:]), *parse_pose(fields[1:4], "the robot")


def _is_carmen(source: Source) -> bool:
    return bool(source.words & WORDS)


READER = Reader(
    name="carmen",
    files="CARMEN text (FLASER, ROBOTLASER1)",
    recognises=_is_carmen,
    uses=USES,
    read=read,
    read_wheels=read_wheels,
)
