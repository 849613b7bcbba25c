"""CARMEN logs and g2o graphs: text with laser lines ``FLASER`` and ``ROBOTLASER1``.

::

    FLASER n r1 … rn x y theta odom_x odom_y odom_theta ipc_timestamp host logger_timestamp

    ROBOTLASER1 type start fov res maxrange accuracy remission_mode n r1 … rn m rem1 … remm
                laser_x laser_y laser_th robot_x robot_y robot_th
                tv rv forward_safety side_safety turn_axis timestamp host logger_timestamp

    VERTEX_SE2 id x y theta            (g2o: the pose of the ROBOTLASER1 line below it)

An ``FLASER`` line says nothing of its beams. By convention the first one looks to −90°,
and the step is π/n for an even count, π/(n − 1) for an odd one (180 or 181 beams); from 81.8 m
on, its scanner reports no return.
Every scan brings its own pose, so ``ODOM`` and all other first words are passed over unread.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from labkit.logs.lines import (
    DamagedLine,
    DamageReport,
    expect_fields,
    parse_count,
    parse_finite,
    parse_numbers,
    parse_pose,
)
from labkit.logs.scanner import Scanner
from labkit.logs.sweeps import Pose, Sweep
from labkit.scan import scanner_poses
from labkit.se2 import matrices_of, relative, to_xytheta, wrap
from labkit.support.arrays import FloatArray
from labkit.support.errors import LabkitError, LogError

G2O_WORDS = frozenset({"VERTEX_SE2", "EDGE_SE2"})
CARMEN_WORDS = frozenset({"FLASER", "ROBOTLASER1", "ODOM", "PARAM", "NEFF", "TRUEPOS", "RAWLASER1"})

FLASER_MAXIMUM = 81.8  # [m]
MAX_MOUNT_DIFFERENCE = 0.1  # [m, rad]: largest difference of two lines that tell one mounting
PRINTED_PRECISION = 1e-4  # [m, rad]: difference of two poses by their printed decimals alone


def read_laser_lines(
    lines: Iterable[tuple[int, str]], report: DamageReport, scanner: Scanner, *, graph: bool
) -> Iterator[Sweep]:
    """Yield a sweep for each laser line; in a graph, only where a vertex stands above it."""
    vertex: Pose | None = None
    for number, text in lines:
        word = text[:16].split(maxsplit=1)[:1]
        try:
            if word == ["VERTEX_SE2"]:
                vertex = None
                fields = text.split()
                expect_fields(fields, 5, "VERTEX_SE2")
                vertex = parse_pose(fields[2:5], "the vertex")
            elif word == ["FLASER"] and not graph:
                yield _parse_flaser(number, text.split(), report, scanner)
            elif word == ["ROBOTLASER1"]:
                if graph and vertex is None:
                    raise DamagedLine("a scan without a vertex, expected a VERTEX_SE2 above it")
                above, vertex = vertex, None
                yield _parse_robotlaser(number, text.split(), above, report, scanner)
        except LabkitError as damage:
            report.skip(number, damage)


def scanner_trajectories(
    sweeps: Sequence[Sweep], laser_offset: FloatArray, file: str
) -> tuple[FloatArray | None, FloatArray | None]:
    """Choose odometry and reference from the poses of the lines, as poses of the scanner.

    The laser's triple T_w_laser and the robot's T_w_robot of a line tell the mounting
    T_robot_laser. Where it is one for the whole log, the laser's triple is the odometry;
    where it is zero, the log does not say it, and `laser_offset` is composed on. Where it
    changes along the run, the laser's triple is a corrected pose: it becomes the reference,
    and the odometry is the robot's triple with `laser_offset`. In a graph the vertices are the
    reference, and a robot's triple that merely repeats its vertex is no odometry.
    """
    laser = np.array([sweep.laser for sweep in sweeps])
    robot = np.array([sweep.robot for sweep in sweeps])
    mounts = to_xytheta(relative(matrices_of(robot), matrices_of(laser)))
    x, y, theta = mounts.T
    cosine, sine = np.median(np.cos(theta)), np.median(np.sin(theta))  # where ±π are one
    mount = np.array([np.median(x), np.median(y), np.arctan2(sine, cosine)])
    differences = np.abs(to_xytheta(relative(matrices_of(mount), matrices_of(mounts))))
    is_rigid = _largest_usual(differences.max(axis=1)) <= MAX_MOUNT_DIFFERENCE
    is_declared = is_rigid and bool(np.abs(mount).max() > PRINTED_PRECISION)
    if is_declared and laser_offset.any():
        raise LogError(
            f"{file}: the log itself says where the scanner sits on the robot, at "
            f"{mount.round(4).tolist()} (m, m, rad); leave `laser_offset` out"
        )
    offset = mount if is_declared else laser_offset
    vertices = np.array([sweep.vertex for sweep in sweeps if sweep.vertex is not None])
    if len(vertices):
        gaps = np.abs(to_xytheta(relative(matrices_of(vertices), matrices_of(robot))))
        is_repeated = _largest_usual(gaps.max(axis=1)) <= PRINTED_PRECISION
        return None if is_repeated else scanner_poses(robot, offset), scanner_poses(
            vertices, offset
        )
    laser = np.column_stack([laser[:, :2], wrap(laser[:, 2])])
    if is_declared:
        return laser, None
    return scanner_poses(robot, offset), None if is_rigid else laser


def _parse_flaser(
    number: int, fields: Sequence[str], report: DamageReport, scanner: Scanner
) -> Sweep:
    n = parse_count(fields, 1, "beams", at_least=2)
    expect_fields(fields, n + 11, f"FLASER with {n} beams")
    step = math.pi / (n if n % 2 == 0 else n - 1)
    angles = scanner.beams(n, -math.pi / 2, step, report)
    ranges = parse_numbers(fields[2 : n + 2], "range")
    stamp = _parse_stamp(*fields[-3:])
    return Sweep(
        number,
        scanner.scan(ranges, angles, report, stamp=stamp, band=(0.0, FLASER_MAXIMUM)),
        laser=parse_pose(fields[n + 2 : n + 5], "the laser pose"),
        robot=parse_pose(fields[n + 5 : n + 8], "the robot pose"),
    )


def _parse_robotlaser(
    number: int,
    fields: Sequence[str],
    vertex: Pose | None,
    report: DamageReport,
    scanner: Scanner,
) -> Sweep:
    n = parse_count(fields, 8, "beams", at_least=1)
    m = parse_count(fields, n + 9, "remissions", at_least=0)
    expect_fields(fields, n + m + 24, f"ROBOTLASER1 with {n} beams and {m} remissions")
    names = ("start angle", "field of view", "angular step", "maximum range")
    start, fov, step, declared = map(parse_finite, fields[2:6], names)
    if step <= 0.0:
        raise DamagedLine(f"the angular step is {step:g}, expected a positive number")
    # 0.017453 is short of one degree by 3e-7 rad, which 179 steps make 5e-5 rad.
    exact = (each for each in (fov / n, fov / max(n - 1, 1)) if abs(each - step) <= 1e-6)
    angles = scanner.beams(n, start, next(exact, step), report)
    ranges = parse_numbers(fields[9 : n + 9], "range")
    stamp = _parse_stamp(*fields[-3:])
    first = n + m + 10
    return Sweep(
        number,
        scanner.scan(ranges, angles, report, stamp=stamp, band=(0.0, declared)),
        laser=parse_pose(fields[first : first + 3], "the laser pose"),
        robot=parse_pose(fields[first + 3 : first + 6], "the robot pose"),
        vertex=vertex,
    )


def _parse_stamp(ipc: str, host: str, logger: str) -> float:
    """Time of the message [s]; the logger's clock if the message has none (0)."""
    ipc_stamp = parse_finite(ipc, f"the timestamp beside host {host[:30]!r}")
    return ipc_stamp or parse_finite(logger, f"the logger timestamp beside host {host[:30]!r}")


def _largest_usual(gaps: FloatArray) -> float:
    """Largest gap without the worst tenth of the lines, or one of three lines."""
    few = max(min(1, len(gaps) // 3), len(gaps) // 10)
    return float(np.sort(gaps)[-1 - few])
