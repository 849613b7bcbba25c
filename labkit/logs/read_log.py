"""One function for all logs: it recognises the format by the content."""

from __future__ import annotations

import os
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from labkit.logs import (
    array_files,
    carmen,
    carmen_raw,
    g2o,
    json_lines,
    player,
    points,
    ranges,
    ros_echo,
    rosbag,
    rplidar,
)
from labkit.logs.doubts import make_scans
from labkit.logs.lines import DamageReport, shorten
from labkit.logs.log import Log
from labkit.logs.options import LogOptions
from labkit.logs.reader import FOREIGN, Progress, Reader, Reading, Source, is_value
from labkit.logs.stored import StoredScans
from labkit.logs.trajectories import odd_steps, scanner_track
from labkit.logs.wheels import read_table
from labkit.scan import scanner_poses
from labkit.support.arrays import FloatArray, as_poses, as_stamps, check_function, check_kind
from labkit.support.errors import InvalidParameterError, LogError
from labkit.support.extras import MissingExtraError

READERS: tuple[Reader, ...] = (  # the first that recognises a file reads it
    rosbag.READER,
    array_files.READER,
    carmen_raw.READER,
    g2o.READER,
    carmen.READER,
    json_lines.READER,
    ros_echo.READER,
    rplidar.READER,
    player.READER,
    ranges.READER,
    *points.READERS,
)
FORMATS = (
    f"{', '.join(reader.files for reader in READERS)}; for others `Scan.from_ranges` makes scans "
    f"of arrays"
)
KILLIAN = "killian"  # the built-in run: MIT Killian Court, 3,873 scans over 1.9 km
SUFFIXES = ".gz .bz2 .xz .zip .log .clf .g2o .csv .tsv .txt .jsonl .bag .db3 .mcap .npy .npz"


def read_log(
    path: str | os.PathLike[str],
    options: LogOptions | None = None,
    *,
    progress: Progress = iter,
    **settings: Any,
) -> Log:
    r"""Read a log: CARMEN, g2o with ``ROBOTLASER1``, a ROS bag, a table or an array.

    Parameters
    ----------
    path : path-like
        The file, or the directory of a ROS 2 bag. The string ``"killian"`` is the built-in
        run of the package rtb-data; a file of that name is ``"./killian"``.
    options : LogOptions, optional
        Your word on the scanner, the wheels and the part to read; it goes before the file's.
    progress : callable
        Wraps what is read line by line or scan by scan, e.g. ``tqdm.tqdm``.
    **settings
        Single options by their names, such as ``angles=(-2.356, 2.356)``.

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
    ('polar', [[1.0, 0.0], [0.0, 2.0]], 4)
    """
    check_kind(options, "options", LogOptions, type(None))
    check_function(progress, "progress")
    given = replace(options or LogOptions(), **settings)
    is_killian = isinstance(path, str) and path == KILLIAN
    file = killian_archive() if is_killian else path
    report = DamageReport(file, strict=given.strict, name=given.name)
    source = Source(report, given, progress)
    reader = find_reader(source)
    refuse_unusable(given, reader, report.file)
    reading = reader.read(source)
    if not reading.sweeps:
        raise LogError(f"{report.file}: {_no_scan(reader, reading, given, report)}")
    scans = make_scans(reading, report, given.no_return)
    odometry = reading.odometry
    place = reading.offset if given.laser_offset is None else given.offset
    if given.odometry is not None or reading.track is not None:
        track = _wheels(given, reading.track, report)
        offset = np.zeros(3) if place is None else place
        odometry, gaps = _poses_of_scanner(track, scans, report.file, given, offset)
        report.remarks.extend(gaps)
    if left_out := [content for content in reading.contents if not content.use]:
        names = ", ".join(f"{content.name!r} ({content.kind})" for content in left_out)
        report.remarks.append(f"not read: {shorten(names)}")
    if odometry is not None:
        report.remarks.extend(odd_steps(odometry, scans))
    return Log(
        scans=scans,
        odometry=odometry,
        reference=reading.reference,
        laser_offset=place,
        name=_run_name(source.path),
        format=reader.name,
        skipped=tuple(report.skipped),
        remarks=report.all_remarks(len(scans)),
        contents=tuple(reading.contents),
    )


def find_reader(source: Source) -> Reader:
    """The first reader that recognises a file; `LogError` if none does."""
    found = next((reader for reader in READERS if reader.recognises(source)), None)
    if found is not None:
        return found
    if source.table.has_unknown_titles:
        titles = ", ".join(column.title for column in source.table.columns[:12])
        raise LogError(
            f"{source.report.file}: the columns are {titles}; points need columns `x` and `y`, or "
            f"`angle` and `range`, and ranges need numbered beams (`r0`, `r1`, ...); rename them, "
            f"or begin a title with #"
        )
    raise LogError(
        f"{source.report.file}: unknown format, the file begins with "
        f"{source.first_line[:40]!r}{_way_out(source)}; labkit reads {FORMATS}"
    )


def _no_scan(reader: Reader, reading: Reading, options: LogOptions, report: DamageReport) -> str:
    """A clause on a log in which no scan was read."""
    if options.start and not report.skipped:
        return (
            f"a {reader.name} log of no more than {options.start} scans; choose a smaller `start` "
            f"(`--start`)"
        )
    held = ", ".join(f"{part.name} ({part.kind})" for part in reading.contents)
    holds = f"; it holds {shorten(held)}" if held else ""
    return f"a {reader.name} log without any scan{report.summary()}{holds}; labkit reads {FORMATS}"


def killian_archive() -> Path:
    """Path of ``killian.g2o.zip`` of the package rtb-data in this Python environment."""
    spec = find_spec("rtbdata")
    if spec is None or not spec.submodule_search_locations:
        purpose = f'the built-in run "{KILLIAN}" (a file of that name is "./{KILLIAN}")'
        raise MissingExtraError(purpose, "rtb-data", "killian")
    return Path(spec.submodule_search_locations[0]) / "data" / "killian.g2o.zip"


def _way_out(source: Source) -> str:
    """A clause on what a file of no known format seems to be, and how it can be read; or none."""
    if source.foreign:
        return f": {FOREIGN[source.foreign]}"
    row = next(iter(source.table.rows), [])
    words = [field for field in row if field and not is_value(field)]
    if len(words) < len(row) - ranges.FEWEST_BEAMS:
        return f", and {words[0]!r:.30} stands among its numbers: name the columns in a first row"
    return ""


def _wheels(options: LogOptions, track: FloatArray | None, report: DamageReport) -> FloatArray:
    """The robot's poses, rows (t [s], x [m], y [m], θ [rad]), by the caller or else the log."""
    if options.odometry is None:
        assert track is not None
        return track
    if isinstance(options.odometry, str | os.PathLike):
        return read_wheels(options.odometry, options, report)
    poses = as_poses(options.odometry[1], "odometry")
    times = as_stamps(options.odometry[0], "odometry", len(poses))
    return np.column_stack([times, poses])


def read_wheels(
    path: str | os.PathLike[str], options: LogOptions, report: DamageReport
) -> FloatArray:
    """Wheels from a file beside the log, by the readers of logs or as a table of poses."""
    own = DamageReport(path, strict=False)
    source = Source(own, LogOptions(odometry_topic=options.odometry_topic))
    found = (each.read_wheels for each in READERS if each.read_wheels and each.recognises(source))
    track = next(found, read_table)(source)
    report.remarks.extend(own.remarks)
    report.skipped.extend(own.skipped)
    return track


def _poses_of_scanner(
    track: FloatArray, scans: StoredScans, file: str, options: LogOptions, offset: FloatArray
) -> tuple[FloatArray, list[str]]:
    """Poses of the scanner at its scans by the robot's track, and remarks on gaps."""
    name = file if options.odometry is None else "`odometry`"
    if isinstance(options.odometry, str | os.PathLike):
        name = os.fspath(options.odometry)
    if not np.isnan(track[:, 0]).any():
        if np.isnan(scans.stamps).any():
            raise LogError(
                f"{file}: holds no times, which `odometry` (`--odometry`) needs; give its table "
                f"a column `stamp` in seconds, or take the clock out of the poses, one a scan"
            )
        return scanner_track(scans, name, track[:, 0], track[:, 1:], offset)
    poses = track[slice(*options.part), 1:] if len(track) != len(scans) else track[:, 1:]
    if len(poses) != len(scans):
        raise LogError(
            f"{name}: {len(track)} poses without a clock for {len(scans)} scans; give both a "
            f"column `stamp`"
        )
    return scanner_poses(poses, offset), []


def refuse_unusable(options: LogOptions, reader: Reader, file: str) -> None:
    """Raise `InvalidParameterError` for an option that others formats use, and this one cannot."""
    for name in dict.fromkeys(name for each in READERS for name in each.uses):
        is_of_wheels = name == "laser_offset" and options.odometry is not None
        if getattr(options, name) is None or name in reader.uses or is_of_wheels:
            continue
        formats = dict.fromkeys(each.name for each in READERS if name in each.uses)
        raise InvalidParameterError(
            f"cannot be used for {file}, a log of the format `{reader.name}` (only for "
            f"{', '.join(formats)}): leave it out",
            parameter=name,
        )


def _run_name(source: Path) -> str:
    """The file's name without the suffixes of logs and of their packing."""
    name = Path(source.name)
    while name.suffix.lower() in SUFFIXES.split():
        name = name.with_suffix("")
    return name.name
