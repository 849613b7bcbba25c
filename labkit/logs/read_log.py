"""One function for all logs: it recognises the format by the content, a bag by its suffix."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from numpy.typing import ArrayLike

from labkit.logs.laser_lines import CARMEN_WORDS, G2O_WORDS, read_laser_lines, scanner_trajectories
from labkit.logs.lines import DamageReport, read_lines
from labkit.logs.log import Log
from labkit.logs.points import read_points_table, read_ranges_table, table_kind
from labkit.logs.rosbag import is_bag, read_bag
from labkit.logs.sweeps import Sweep, make_scans
from labkit.logs.trajectories import odd_steps
from labkit.scan import Scan, check_angles
from labkit.support.arrays import as_numbers
from labkit.support.errors import LogError
from labkit.support.extras import MissingExtraError

FORMATS = (
    "CARMEN text (FLASER, ROBOTLASER1), g2o with ROBOTLASER1, ROS 1 and ROS 2 bags, points as "
    "rows `x,y` or `scan,x,y`, and ranges, one scan a row; for others `Scan.from_ranges` makes "
    "scans of arrays"
)
KILLIAN = "killian"  # the built-in run: MIT Killian Court, 3,873 scans over 1.9 km
HEAD = 1000  # lines that tell the format
SUFFIXES = frozenset({".gz", ".zip", ".log", ".clf", ".g2o", ".csv", ".txt", ".bag"})


def read_log(
    path: str | os.PathLike[str],
    *,
    strict: bool = False,
    no_return: ArrayLike | None = None,
    laser_offset: ArrayLike = (0.0, 0.0, 0.0),
    angles: ArrayLike | None = None,
    topic: str | None = None,
    odometry_topic: str | None = None,
) -> Log:
    r"""Read a log: CARMEN, g2o with ``ROBOTLASER1``, a ROS bag, a table of points or of ranges.

    Parameters
    ----------
    path : path-like
        The file, or the directory of a ROS 2 bag. The string ``"killian"`` is the built-in
        run of the package rtb-data; a file of that name is ``"./killian"``.
    strict : bool
        Raise at the first damaged line instead of skipping it into `Log.skipped`.
    no_return : array_like, optional
        Ranges [m] that mean "nothing came back", to 1.5 mm; ``()`` for none. By default the
        known code with which a log's ranges end, named in `Log.remarks`.
    laser_offset : array_like, shape (3,)
        Pose of the scanner on the robot, ``T_robot_laser`` as (x [m], y [m], θ [rad]), for
        a log that does not declare it itself: ``T_w_laser = T_w_robot @ T_robot_laser``.
    angles : array_like, shape (2,), optional
        Directions [rad] of the first and the last beam; needed for a table of ranges, and
        used for nothing else.
    topic, odometry_topic : str, optional
        In a bag: the topic of the scans and of the odometry, where there are several.

    Returns
    -------
    Log
        With poses of the *scanner*. The vertices of a graph are its `reference`, and so are
        laser poses that were corrected, in a CARMEN log.

    Raises
    ------
    LogError
        If there is no scan to read, or (under `strict`) a line is damaged; the message names
        file and line.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder) / "corner.csv"
    ...     _ = table.write_text("x,y\n1.0,0.0\n0.0,1.0\nmud\n")
    ...     log = read_log(table)
    >>> log.format, len(log), log.scans[0].points.tolist(), log.skipped[0].line
    ('points', 1, [[1.0, 0.0], [0.0, 1.0]], 4)
    """
    offset = as_numbers(laser_offset, "laser_offset", "x, y, θ")
    check_angles(offset[2:], "laser_offset")
    beams = None if angles is None else as_numbers(angles, "angles", "first, last [rad]")
    if beams is not None:
        check_angles(beams, "angles")
    is_killian = isinstance(path, str) and path == KILLIAN
    report = DamageReport(killian_archive() if is_killian else path, strict=strict)
    file = Path(report.file)
    scans: tuple[Scan, ...] = ()
    sweeps: Sequence[Sweep] = ()
    odometry = reference = None
    if is_bag(file):
        format = "ros"
        sweeps, odometry = read_bag(
            file, report, laser_offset=offset, topic=topic, odometry_topic=odometry_topic
        )
    else:
        lines = read_lines(report)
        format = _format([text for _, text in lines[:HEAD]], report.file)
        if format == "points":
            scans = read_points_table(lines, report)
        elif format == "ranges":
            sweeps = read_ranges_table(lines, report, beams)
        elif sweeps := list(read_laser_lines(lines, report, graph=format == "g2o")):
            odometry, reference = scanner_trajectories(sweeps, offset, report.file)
    if sweeps:
        scans = make_scans(sweeps, report, no_return)
    if odometry is not None:
        report.remarks.extend(odd_steps(odometry, scans))
    if not scans:
        lacking = f"a {format} log without any scan{report.summary()}; labkit reads {FORMATS}"
        raise LogError(f"{report.file}: {lacking}")
    return Log(
        scans=scans,
        odometry=odometry,
        reference=reference,
        name=_run_name(file),
        format=format,
        skipped=tuple(report.skipped),
        remarks=tuple(report.remarks),
    )


def killian_archive() -> Path:
    """Path of ``killian.g2o.zip`` of the package rtb-data in this Python environment."""
    spec = find_spec("rtbdata")
    if spec is None or not spec.submodule_search_locations:
        purpose = f'the built-in run "{KILLIAN}" (a file of that name is "./{KILLIAN}")'
        raise MissingExtraError(purpose, "rtb-data", "killian")
    return Path(spec.submodule_search_locations[0]) / "data" / "killian.g2o.zip"


def _format(head: Sequence[str], file: str) -> str:
    """The format by the first words of the first lines; `LogError` if none is known."""
    words = {word for text in head for word in text[:16].split(maxsplit=1)[:1]}
    if words & G2O_WORDS:
        return "g2o"
    if words & CARMEN_WORDS:
        return "carmen"
    if kind := table_kind(head):
        return kind
    begin = repr("".join(head[:1])[:40])
    raise LogError(f"{file}: unknown format, the file begins with {begin}; labkit reads {FORMATS}")


def _run_name(source: Path) -> str:
    """The file's name without the suffixes of logs and of their packing."""
    name = Path(source.name)
    while name.suffix.lower() in SUFFIXES:
        name = name.with_suffix("")
    return name.name
