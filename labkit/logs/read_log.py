"""One door for all logs: the format is told from what a file holds, not from its name."""

from __future__ import annotations

import os
from pathlib import Path

from numpy.typing import ArrayLike

from labkit.arrays import check_range
from labkit.errors import LogError
from labkit.logs.carmen import CARMEN_WORDS, read_carmen
from labkit.logs.g2o import G2O_WORDS, read_g2o
from labkit.logs.killian import KILLIAN, killian_archive
from labkit.logs.lines import DamageReport, split_lines
from labkit.logs.log import Log
from labkit.logs.points import is_points, parse_points
from labkit.logs.poses import as_offset
from labkit.logs.rosbag import is_bag, read_bag
from labkit.logs.unpack import load

FORMATS = (
    "CARMEN text (FLASER, ROBOTLASER1), g2o with ROBOTLASER1, ROS 1 and ROS 2 bags, "
    "points as rows `x,y` or `scan,x,y`"
)
SUFFIXES = frozenset({".gz", ".zip", ".log", ".clf", ".g2o", ".csv", ".txt", ".bag"})


def read_log(
    path: str | os.PathLike[str],
    *,
    strict: bool = False,
    range_max: float | None = None,
    laser_offset: ArrayLike = (0.0, 0.0, 0.0),
    topic: str | None = None,
    odometry_topic: str | None = None,
) -> Log:
    r"""Read a log of 2D laser scans in any format that labkit knows.

    The formats are CARMEN text, g2o with ``ROBOTLASER1`` lines, tables of points, each of
    them plain, in gzip or in zip, and ROS 1 and ROS 2 bags.

    Parameters
    ----------
    path : path-like
        The file, or the directory of a ROS 2 bag. The string ``"killian"`` is the built-in
        run of the package rtb-data; a file of that name is ``"./killian"``.
    strict : bool
        Raise at the first damaged line instead of skipping it into `Log.skipped`.
    range_max : float, optional
        Beams at or beyond it [m] make no point, whatever the log declares. By default the
        declared maximum counts, or the known no-return codes where there is none.
    laser_offset : array_like, shape (3,)
        The scanner's place on the robot, ``T_robot_laser`` as (x [m], y [m], θ [rad]), for
        a log that does not declare it itself: ``T_w_laser = T_w_robot @ T_robot_laser``.
    topic, odometry_topic : str, optional
        In a bag: the topic of the scans and of the odometry, where there are several. No
        other log has topics, and is refused if one is given.

    Returns
    -------
    Log
        `odometry` and `reference` are poses of the *scanner*. In a CARMEN log the odometry
        is the laser's triple of each line, with `laser_offset` where laser and robot
        coincide; where the laser's triple drifts away from the robot's, it is a corrected
        pose: then it is the reference, and the robot's triple the odometry. In a g2o graph
        the vertices are the reference. A line whose poses contradict almost all others
        (at least 98 %) is damaged.

    Raises
    ------
    LogError
        If there is nothing to read at `path`, its format is not known, it holds no scan,
        it does not have the topic, or (under `strict`) a line is damaged; the message names
        file and line.
    InvalidParameterError
        If `range_max` or `laser_offset` makes no sense.

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
    if range_max is not None:
        check_range(range_max, "range_max", above=0.0, unit="m")
    offset = as_offset(laser_offset)
    source = killian_archive() if path == KILLIAN else Path(path)
    name = _run_name(source)
    report = DamageReport(os.fspath(source), strict=strict)
    if is_bag(source):
        return read_bag(
            source,
            report,
            name=name,
            range_max=range_max,
            laser_offset=offset,
            topic=topic,
            odometry_topic=odometry_topic,
        )
    content = load(source)
    _refuse_topics(report.file, topic=topic, odometry_topic=odometry_topic)
    lines = split_lines(content.data)
    if content.damage:
        report.skip(len(lines), content.damage)
    words = {word for line in lines for word in line.split(maxsplit=1)[:1]}
    if words & G2O_WORDS:
        return read_g2o(lines, report, name=name, range_max=range_max, laser_offset=offset)
    if words & CARMEN_WORDS:
        return read_carmen(lines, report, name=name, range_max=range_max, laser_offset=offset)
    if is_points(lines):
        return parse_points(lines, report, name=name)
    found = "binary data" if b"\0" in content.data else f"{lines[0][:40]!r}"
    raise LogError(
        f"{report.file}: unknown format, the file begins with {found}; labkit reads {FORMATS}"
    )


def read_killian() -> Log:
    """Read the built-in run, MIT Killian Court: the same as ``read_log("killian")``.

    3,873 scans of 180 beams (−90° … +89°, up to 50 m) over 1.9 km, with the vertices of an
    optimised pose graph as `Log.reference`. It holds no raw odometry.

    Raises
    ------
    LogError
        If the package rtb-data is not installed: ``pip install "labkit[killian]"``.
    """
    return read_log(KILLIAN)


def _refuse_topics(file: str, **topics: str | None) -> None:
    for parameter, wanted in topics.items():
        if wanted is not None:
            raise LogError(
                f"{file}: `{parameter}` is {wanted!r}, but the file is no ROS bag and has no "
                f"topics; leave it out"
            )


def _run_name(source: Path) -> str:
    """The file's name without the suffixes of logs and of their packing."""
    name = Path(source.name)
    while name.suffix.lower() in SUFFIXES:
        name = name.with_suffix("")
    return name.name
