"""One function for all logs: it recognises the format by the content, not by the name."""

from __future__ import annotations

import os
from pathlib import Path

from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, check_range
from labkit.errors import LogError
from labkit.logs.carmen import CARMEN_WORDS, read_carmen
from labkit.logs.g2o import G2O_WORDS, read_g2o
from labkit.logs.killian import KILLIAN, killian_archive
from labkit.logs.laser_scans import LaserScans
from labkit.logs.lines import DamageReport
from labkit.logs.log import Log, LogStream
from labkit.logs.no_return import ScanSettings, as_codes
from labkit.logs.points import is_points, parse_points
from labkit.logs.poses import as_offset
from labkit.logs.rosbag import is_bag, read_bag
from labkit.logs.source import Progress, ReadLimits, TextSource

FORMATS = (
    "CARMEN text (FLASER, ROBOTLASER1), g2o with ROBOTLASER1, ROS 1 and ROS 2 bags, "
    "points as rows `x,y` or `scan,x,y`"
)
HEAD = 1000
"""So many lines tell the format of a file, where they are not all of another's words."""

STREAMED = ReadLimits(max_bytes=64 << 30)
"""A stream needs no memory for what it reads, only time."""

SUFFIXES = frozenset({".gz", ".zip", ".log", ".clf", ".g2o", ".csv", ".txt", ".bag"})


def read_log(
    path: str | os.PathLike[str],
    *,
    strict: bool = False,
    range_max: float | None = None,
    no_return: ArrayLike | None = None,
    laser_offset: ArrayLike = (0.0, 0.0, 0.0),
    topic: str | None = None,
    odometry_topic: str | None = None,
    limits: ReadLimits | None = None,
    progress: Progress | None = None,
) -> Log:
    r"""Read a log of 2D laser scans in any format that labkit knows.

    The formats are CARMEN text, g2o with ``ROBOTLASER1`` lines and tables of points (each
    plain, in gzip or in zip), and ROS 1 and ROS 2 bags.

    Parameters
    ----------
    path : path-like
        The file, or the directory of a ROS 2 bag. The string ``"killian"`` is the built-in
        run of the package rtb-data; a file of that name is ``"./killian"``.
    strict : bool
        Raise at the first damaged line instead of skipping it into `Log.skipped`.
    range_max : float, optional
        Beams at or beyond it [m] make no point, whatever the log declares. By default the
        declared maximum counts, and what `no_return` says.
    no_return : array_like, optional
        Ranges [m] that mean "nothing came back" though they lie below the maximum, to 1.5 mm;
        ``()`` for none. By default they are told by how the log's ranges are spread: a value
        that repeats at the top of the range where a wall would be spread. `Log.remarks` says
        which were found. A `range_max` takes the place of these.
    laser_offset : array_like, shape (3,)
        The scanner's place on the robot, ``T_robot_laser`` as (x [m], y [m], θ [rad]), for
        a log that does not declare it itself: ``T_w_laser = T_w_robot @ T_robot_laser``.
    topic, odometry_topic : str, optional
        In a bag: the topic of the scans and of the odometry, where there are several. No
        other log has topics, and is refused if one is given.
    limits : ReadLimits, optional
        How long a text file and its lines may be, unpacked (512 MiB and 4 MiB).
    progress : callable, optional
        Called with the bytes read and the bytes of the file, as a text log is read.

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
        If there is nothing to read at `path`, its format is not known, it holds no scan or
        more than its limits allow, it does not have the topic, or (under `strict`) a line is
        damaged; the message names file and line.
    InvalidParameterError
        If `range_max`, `no_return` or `laser_offset` makes no sense.

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
    door = _Door(path, strict=strict, limits=limits or ReadLimits(), progress=progress)
    return door.read(
        _settings(range_max, no_return, keep=True),
        laser_offset=as_offset(laser_offset),
        topic=topic,
        odometry_topic=odometry_topic,
    ).load()


def stream_log(
    path: str | os.PathLike[str],
    *,
    strict: bool = False,
    range_max: float | None = None,
    no_return: ArrayLike | None = None,
    laser_offset: ArrayLike = (0.0, 0.0, 0.0),
    topic: str | None = None,
    odometry_topic: str | None = None,
    limits: ReadLimits = STREAMED,
    progress: Progress | None = None,
) -> LogStream:
    r"""Open a log of any length: its poses now, its scans one by one, at constant memory.

    The file is read once for what only all of it can tell: format, poses, mounting, codes for
    no return. That takes 80 bytes a scan. Each loop over `LogStream.scans` reads it again.

    Parameters, errors and what is read are those of `read_log`, but the file may hold 64 GiB.

    Returns
    -------
    LogStream
        With the same scans, poses, skipped lines and remarks as `read_log` gives.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder) / "corners.csv"
    ...     _ = table.write_text("scan,x,y\n0,1.0,0.0\n1,0.9,0.0\n1,0.8,0.5\n")
    ...     log = stream_log(table)
    ...     len(log), [len(scan) for scan in log.scans]
    (2, [1, 2])
    """
    door = _Door(path, strict=strict, limits=limits, progress=progress)
    return door.read(
        _settings(range_max, no_return, keep=False),
        laser_offset=as_offset(laser_offset),
        topic=topic,
        odometry_topic=odometry_topic,
    )


def _settings(range_max: float | None, no_return: ArrayLike | None, *, keep: bool) -> ScanSettings:
    if range_max is not None:
        check_range(range_max, "range_max", above=0.0, unit="m")
    codes = None if no_return is None else as_codes(no_return)
    return ScanSettings(range_max=range_max, no_return=codes, keep=keep)


class _Door:
    """One file, before its format is known."""

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        strict: bool,
        limits: ReadLimits,
        progress: Progress | None,
    ) -> None:
        self.path = killian_archive() if path == KILLIAN else Path(path)
        self.report = DamageReport(os.fspath(self.path), strict=strict)
        self.limits = limits
        self.progress = progress

    def read(
        self,
        settings: ScanSettings,
        *,
        laser_offset: FloatArray,
        topic: str | None,
        odometry_topic: str | None,
    ) -> LogStream:
        """Tell the format and read it."""
        report, name = self.report, _run_name(self.path)
        if is_bag(self.path):
            return read_bag(
                self.path,
                report,
                settings,
                name=name,
                laser_offset=laser_offset,
                topic=topic,
                odometry_topic=odometry_topic,
            )
        source = TextSource(self.path, self.limits, self.progress)
        _refuse_topics(report.file, topic=topic, odometry_topic=odometry_topic)
        if report.strict:
            source.verify(report)
        format = _format(source)
        if format == "points":
            return parse_points(source, report, name=name, keep=settings.keep)
        reader = read_g2o if format == "g2o" else read_carmen
        return reader(source, report, LaserScans(settings), name=name, laser_offset=laser_offset)


def _format(source: TextSource) -> str:
    """The format by the first words of the lines, or by rows of points; else a `LogError`."""
    head: list[str] = []
    carmen_since = 0
    for number, text in source.lines():
        if len(head) < HEAD:
            head.append(text)
        words = text.split(maxsplit=1)[:1]
        if words and words[0] in G2O_WORDS:
            return "g2o"
        if not carmen_since and words and words[0] in CARMEN_WORDS:
            carmen_since = number
        if carmen_since and number - carmen_since > HEAD:
            return "carmen"
        if not carmen_since and number > HEAD and is_points(head):
            return "points"
    if carmen_since:
        return "carmen"
    if is_points(head):
        return "points"
    if not head:
        raise LogError(
            f"{source.file}: no line of up to {source.limits.max_line_bytes:,} bytes; if it is "
            f"what you expect, raise `max_line_bytes`"
        )
    binary = any(not line.replace("\t", " ").isprintable() for line in head[:5])
    found = "binary data" if binary else f"{head[0][:40]!r}"
    raise LogError(
        f"{source.file}: unknown format, the file begins with {found}; labkit reads {FORMATS}"
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
