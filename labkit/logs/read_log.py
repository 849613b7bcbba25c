"""One function for all logs: it recognises the format by the content."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.util import find_spec
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from labkit.logs.array_files import is_array_file, read_array_file
from labkit.logs.columns import POLAR, Column, is_list, list_fields, read_header, split_row
from labkit.logs.laser_lines import CARMEN_WORDS, G2O_WORDS, read_laser_lines, scanner_trajectories
from labkit.logs.lines import DamageReport, is_number, read_lines
from labkit.logs.log import Log
from labkit.logs.points import coordinates_of, read_points_table
from labkit.logs.ranges import FEWEST_BEAMS, read_ranges_table
from labkit.logs.rosbag import bag_kind, read_bag
from labkit.logs.scanner import Scanner
from labkit.logs.sweeps import Sweep, make_scans
from labkit.logs.trajectories import odd_steps, read_tum, scanner_track
from labkit.scan import check_angles
from labkit.support.arrays import (
    FloatArray,
    as_numbers,
    as_poses,
    as_stamps,
    check_count,
    check_function,
    check_kind,
)
from labkit.support.errors import InvalidParameterError, LogError
from labkit.support.extras import MissingExtraError

FORMATS = (
    "CARMEN text (FLASER, ROBOTLASER1), g2o with ROBOTLASER1, ROS 1 and ROS 2 bags, points as "
    "rows `x,y`, `scan,x,y` or `scan,angle,range`, and ranges, one scan a row; for others "
    "`Scan.from_ranges` makes scans of arrays"
)
FOREIGN = {  # beginnings of files that others write, and the way out
    "header:": "is it printed by `rostopic echo`? labkit reads its tables (`-p`), and bags",
    "version https://git-lfs": "it stands for a file of Git LFS, which `git lfs pull` fetches",
    "{": "is it JSON? write its ranges as a table, a scan a row",
    "[{": "is it JSON? write its ranges as a table, a scan a row",
    "[[": "is it a list of lists? write each of them in a row of its own",
    "[": "does a list go on in the next line? write each scan in a row of its own",
}
KILLIAN = "killian"  # the built-in run: MIT Killian Court, 3,873 scans over 1.9 km
HEAD_LINES = 1000  # lines that tell the format
OF_TEXT = ("angles", "no_return", "laser_offset", "time_increment")
USABLE = {  # arguments that not every format can use
    "ros": (*OF_TEXT, "topic", "odometry_topic"),
    "carmen": OF_TEXT,
    "g2o": OF_TEXT,
    "ranges": ("angles", "no_return", "time_increment"),
    "polar": ("no_return", "time_increment"),
    "points": (),
}

Part = Callable[[Iterable[Sweep]], Iterable[Sweep]]
Odometry = str | os.PathLike[str] | tuple[ArrayLike, ArrayLike]
Progress = Callable[[Iterable[Any]], Iterable[Any]]
SUFFIXES = frozenset(
    {".gz", ".bz2", ".xz", ".zip"}
    | {".log", ".clf", ".g2o", ".csv", ".tsv", ".txt", ".bag", ".db3", ".mcap", ".npy", ".npz"}
)


def read_log(
    path: str | os.PathLike[str],
    *,
    strict: bool = False,
    scans: int | None = None,
    start: int = 0,
    angles: ArrayLike | None = None,
    range_min: float | None = None,
    range_max: float | None = None,
    mirrored: bool | None = None,
    time_increment: float | None = None,
    no_return: ArrayLike | None = None,
    laser_offset: ArrayLike | None = None,
    odometry: Odometry | None = None,
    topic: str | None = None,
    odometry_topic: str | None = None,
    progress: Progress = iter,
) -> Log:
    r"""Read a log: CARMEN, g2o with ``ROBOTLASER1``, a ROS bag, a table or an array.

    What you say of the scanner goes before what the file says. An argument that the format of
    the file cannot use is refused.

    Parameters
    ----------
    path : path-like
        The file, or the directory of a ROS 2 bag. The string ``"killian"`` is the built-in
        run of the package rtb-data; a file of that name is ``"./killian"``.
    strict : bool
        Raise at the first damaged line instead of skipping it into `Log.skipped`.
    scans, start : int, optional
        Read so many scans (default all), from this one on, counted from 0. No more of the file
        is read than they need, but of a table of points.
    angles : array_like, shape (2,), optional
        Directions [rad] of the first and the last beam; the others lie between them at one step.
        A table of ranges needs them, unless its columns tell them.
    range_min, range_max : float, optional
        The band in which a range makes a point [m].
    mirrored : bool, optional
        The scanner hangs upside down, or counts its angles clockwise: they change their sign. By
        default as ``/tf_static`` of a bag says, else false.
    time_increment : float, optional
        Time from one beam to the next [s]; 0 if all beams count as measured at once.
    no_return : array_like, optional
        Ranges [m] that mean "nothing came back", to 1.5 mm; ``()`` for none. By default the
        known code with which a log's ranges end, named in `Log.remarks`.
    laser_offset : array_like, shape (3,), optional
        Pose of the scanner on the robot, ``T_robot_laser`` as (x [m], y [m], θ [rad]), for
        a text that does not declare it itself: ``T_w_laser = T_w_robot @ T_robot_laser``. By
        default as ``/tf_static`` of a bag says, else zero.
    odometry : path-like or tuple (times, poses), optional
        Wheel odometry of the robot in place of the log's own: a file in the format TUM, or times
        [s], shape (M,), with poses, shape (M, 3). They are joined by the stamps of the scans.
    topic, odometry_topic : str, optional
        In a bag: the topic of the scans and of the odometry, where there are several.
    progress : callable
        Wraps what is read line by line or scan by scan, e.g. ``tqdm.tqdm``.

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
    ...     _ = table.write_text("angle_deg,range_mm\n0,1000\n90,2000\nmud\n")
    ...     log = read_log(table)
    >>> log.format, log.scans[0].points.round(9).tolist(), log.skipped[0].line
    ('points', [[1.0, 0.0], [0.0, 2.0]], 4)
    """
    for name, value in (("topic", topic), ("odometry_topic", odometry_topic)):
        check_kind(value, name, str, type(None))
    check_function(progress, "progress")
    offset = as_numbers(np.zeros(3) if laser_offset is None else laser_offset, "laser_offset")
    check_angles(offset[2:], "laser_offset")
    directions = _as_directions(angles)
    scanner = Scanner(
        angles=directions,
        range_min=range_min,
        range_max=range_max,
        time_increment=time_increment,
        mirrored=mirrored,
    )
    part = _part(start, scans)
    is_killian = isinstance(path, str) and path == KILLIAN
    report = DamageReport(killian_archive() if is_killian else path, strict=strict)
    file = Path(report.file)
    own = reference = track = None
    if bag_kind(file):
        format, report.clock_is_named = "ros", True
        topics = {"topic": topic, "odometry_topic": odometry_topic}
        sweeps, track, place = read_bag(file, report, scanner, part, progress, **topics)
        if laser_offset is None and place is not None:
            offset = place
    else:
        given = {"angles": angles, "no_return": no_return, "laser_offset": laser_offset}
        given |= {"time_increment": time_increment}
        if odometry is not None:  # has a use for the place of the scanner
            del given["laser_offset"]
        given |= {"topic": topic, "odometry_topic": odometry_topic}
        format, sweeps = _read_file(
            file, report, scanner, part=part, progress=progress, given=given
        )
        if sweeps and format in {"carmen", "g2o"}:
            own, reference = scanner_trajectories(sweeps, offset, report.file)
    if not sweeps:
        lacking = f"a {format} log without any scan{report.summary()}; labkit reads {FORMATS}"
        if start and not report.skipped:
            lacking = (
                f"a {format} log of no more than {start} scans; choose a smaller `start` "
                f"(`--start`)"
            )
        raise LogError(f"{report.file}: {lacking}")
    all_scans = make_scans(sweeps, report, no_return)
    if odometry is not None or track is not None:
        if np.isnan(all_scans.stamps).any():
            raise LogError(
                f"{report.file}: holds no times, which `odometry` (`--odometry`) needs; give its "
                f"table a column `stamp` in seconds"
            )
        wheels, name = _wheels(odometry, track, report.file)
        own, gaps = scanner_track(all_scans, name, *wheels, offset)
        report.remarks.extend(gaps)
    if own is not None:
        report.remarks.extend(odd_steps(own, all_scans))
    return Log(
        scans=all_scans,
        odometry=own,
        reference=reference,
        name=_run_name(file),
        format=format,
        skipped=tuple(report.skipped),
        remarks=report.all_remarks(len(all_scans)),
    )


def _read_file(
    file: Path,
    report: DamageReport,
    scanner: Scanner,
    *,
    part: Part,
    progress: Progress,
    given: Mapping[str, Any],
) -> tuple[str, list[Sweep]]:
    """Format and sweeps of an array or a text; `given` are arguments that not all can use."""
    if is_array_file(file):
        _refuse_unusable(given, "ranges", report.file)
        return "ranges", list(part(progress(read_array_file(file, report, scanner))))
    lines = iter(progress(read_lines(report)))
    head = list(islice(lines, HEAD_LINES))
    format, columns, begin = _format([text for _, text in head], report.file)
    is_polar = format == "points" and coordinates_of(columns) == POLAR
    _refuse_unusable(given, "polar" if is_polar else format, report.file)
    rows = chain(head[begin:], lines)
    if format == "points":
        return format, list(part(read_points_table(rows, report, columns, scanner)))
    if format == "ranges":
        return format, list(part(read_ranges_table(rows, report, columns, scanner)))
    is_graph = format == "g2o"
    return format, list(part(read_laser_lines(rows, report, scanner, graph=is_graph)))


def _part(start: int, scans: int | None) -> Part:
    """Take the scans of a part of the log, and read no further."""
    check_count(start, "start", at_least=0, at_most=sys.maxsize)
    if scans is not None:
        check_count(scans, "scans", at_least=1, at_most=sys.maxsize)
    end = None if scans is None else min(start + scans, sys.maxsize)
    return lambda sweeps: islice(sweeps, start, end)


def killian_archive() -> Path:
    """Path of ``killian.g2o.zip`` of the package rtb-data in this Python environment."""
    spec = find_spec("rtbdata")
    if spec is None or not spec.submodule_search_locations:
        purpose = f'the built-in run "{KILLIAN}" (a file of that name is "./{KILLIAN}")'
        raise MissingExtraError(purpose, "rtb-data", "killian")
    return Path(spec.submodule_search_locations[0]) / "data" / "killian.g2o.zip"


def _format(head: Sequence[str], file: str) -> tuple[str, list[Column], int]:
    """The format by the first lines, the columns of a table, and the number of lines above it."""
    words = {word for text in head for word in text[:16].split(maxsplit=1)[:1]}
    if words & G2O_WORDS:
        return "g2o", [], 0
    if words & CARMEN_WORDS:
        return "carmen", [], 0
    first_line = next((line.strip() for line in head if line.strip()), "")
    columns, begin = read_header(head)
    rows = [row for row in map(split_row, head[begin:]) if row][:5]
    is_foreign = first_line.startswith(tuple(FOREIGN)) and not _holds_values(split_row(first_line))
    if not is_foreign:
        if _are_ranges(columns, rows):
            return "ranges", columns, begin
        if coordinates_of(columns):
            return "points", columns, begin
        _expect_no_titles(columns, rows, file)
        for row in filter(_holds_values, rows):
            if len(row) >= FEWEST_BEAMS:
                return "ranges", columns, begin
            if len([field for field in row if field]) > 1:
                return "points", [], begin
    raise LogError(
        f"{file}: unknown format, the file begins with {first_line[:40]!r}"
        f"{_way_out(first_line, rows)}; labkit reads {FORMATS}"
    )


def _expect_no_titles(columns: Sequence[Column], rows: Sequence[Sequence[str]], file: str) -> None:
    """Raise `LogError` for titles above values, none of which says what is known."""
    if len(columns) > 1 and any(any(map(_is_value, row)) for row in rows):
        titles = ", ".join(column.title for column in columns[:12])
        raise LogError(
            f"{file}: the columns are {titles}; points need columns `x` and `y`, or `angle` and "
            f"`range`, and ranges need numbered beams (`r0`, `r1`, ...); rename them, or begin a "
            f"title with #"
        )


def _way_out(first_line: str, rows: Sequence[Sequence[str]]) -> str:
    """A clause on what a file of no known format seems to be, and how it can be read; or none."""
    for beginning, way_out in FOREIGN.items():
        if first_line.startswith(beginning):
            return f": {way_out}"
    row = rows[0] if rows else []
    words = [field for field in row if field and not _is_value(field)]
    if len(words) < len(row) - FEWEST_BEAMS:
        return f", and {words[0]!r:.30} stands among its numbers: name the columns in a first row"
    return ""


def _is_value(field: str) -> bool:
    return is_number(field) or is_list(field)


def _holds_values(row: Sequence[str]) -> bool:
    """Recognise a row without words; fields may be empty."""
    return all(_is_value(field) for field in row if field)


def _are_ranges(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> bool:
    """Recognise columns of ranges: numbered beams, or one with a list of them."""
    numbered = sum(column.number is not None for column in columns)
    lists = [k for k, column in enumerate(columns) if column.meaning == "range"]
    counts = [len(list_fields(row[k])) for row in rows for k in lists if k < len(row)]
    return numbered >= FEWEST_BEAMS or max(counts, default=0) >= FEWEST_BEAMS


def _wheels(
    given: Odometry | None, track: FloatArray | None, file: str
) -> tuple[tuple[FloatArray, FloatArray], str]:
    """Times and poses of the robot by the caller or by the bag, and a name for messages."""
    if given is None and track is not None:
        return (track[:, 0], track[:, 1:]), file
    if isinstance(given, str | os.PathLike):
        return read_tum(given), os.fspath(given)
    if not isinstance(given, Sequence) or len(given) != 2:
        raise InvalidParameterError(
            f"must be a file in the format TUM, or (times, poses), got {given!r:.80}",
            parameter="odometry",
        )
    poses = as_poses(given[1], "odometry")
    return (as_stamps(given[0], "odometry", len(poses)), poses), "`odometry`"


def _as_directions(angles: ArrayLike | None) -> tuple[float, float] | None:
    """Directions of the first and the last beam [rad]."""
    if angles is None:
        return None
    first, last = as_numbers(angles, "angles", "first, last [rad]")
    check_angles(np.array([first, last]), "angles")
    return float(first), float(last)


def _refuse_unusable(given: Mapping[str, Any], format: str, file: str) -> None:
    """Raise `InvalidParameterError` for an argument that the format cannot use."""
    for name, value in given.items():
        if value is not None and name not in USABLE[format]:
            formats = ", ".join(each for each, names in USABLE.items() if name in names)
            raise InvalidParameterError(
                f"cannot be used for {file}, a log of the format `{format}` (only for {formats}): "
                f"leave it out",
                parameter=name,
            )


def _run_name(source: Path) -> str:
    """The file's name without the suffixes of logs and of their packing."""
    name = Path(source.name)
    while name.suffix.lower() in SUFFIXES:
        name = name.with_suffix("")
    return name.name
