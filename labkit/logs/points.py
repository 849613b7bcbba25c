"""Tables of points, one a row: x and y, or angle and range, in columns with titles.

Titles stand in any order, with units as ``range_mm``; columns of other names are left out. Without
titles the columns are ``x,y`` or ``scan,x,y``. A scan is the rows of one number in a column
``scan``, ``sweep`` or ``frame``, or else of one stamp. Without both, all rows are one scan; where
the angles of a polar table start anew, so does a scan.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from labkit.logs.clocks import parse_stamp
from labkit.logs.columns import POLAR, XY, Column, parse_title, split_row
from labkit.logs.doubts import MAX_USUAL_RANGE
from labkit.logs.lines import (
    DamagedLine,
    DamageReport,
    expect_fields,
    expect_near,
    parse_finite,
    parse_numbers,
)
from labkit.logs.reader import Reader, Reading, Source, Sweep, holds_values
from labkit.scan import check_angles
from labkit.support.arrays import FloatArray, IntArray
from labkit.support.errors import InvalidParameterError, LogError

UNTITLED = {count: [*map(parse_title, ("scan", *XY)[-count:])] for count in (2, 3)}
MANY_ROWS = 20  # from here on it is no chance that a column rises in every row


def coordinates_of(columns: Sequence[Column]) -> tuple[str, str] | None:
    """The coordinates that the columns of a table name: x and y, or angle and range."""
    named = {column.meaning for column in columns if column.number is None}
    return next((pair for pair in (XY, POLAR) if named.issuperset(pair)), None)


def read(source: Source) -> Reading:
    """Read rows of points; scans come in the order in which their number is first met."""
    report, scanner = source.report, source.scanner
    columns = source.table.columns
    pair = coordinates_of(columns) or XY
    lines = source.lines(source.table.begin)
    line_numbers, rows, places = _read_rows(lines, report, columns, pair)
    if not len(rows):
        return Reading()
    if not columns:
        _suspect_angles(rows[:, 2:], report)
    if pair == POLAR:
        _expect_radians(rows[:, 2], places["angle"], report.file)
    groups = _scans(rows, places, pair, report)
    if pair == XY:
        _suspect_millimetres(rows[groups[0], 2:], report)
    sweeps = []
    for group in source.part(groups):
        line = line_numbers[group][0]
        stamp = float(rows[group][0, 1])
        points = rows[group, 2:]
        if pair == XY:
            sweeps.append(Sweep(int(line), scanner.scan_of_points(points, stamp)))
        else:
            angles, ranges = points.T
            directions = -angles if scanner.mirrored else angles
            scan = scanner.scan(ranges, directions, report, stamp=stamp)
            sweeps.append(Sweep(int(line), scan))
    return Reading(sweeps=sweeps)


def _read_rows(
    lines: Iterable[tuple[int, str]],
    report: DamageReport,
    columns: Sequence[Column],
    pair: tuple[str, str],
) -> tuple[IntArray, FloatArray, dict[str, tuple[int, Column]]]:
    """Lines of the good rows, the rows (scan, stamp, two coordinates), and the columns' places."""
    line_numbers = array("q")
    table = array("d")
    places: dict[str, tuple[int, Column]] = {}
    for number, text in lines:
        row = split_row(text)
        if not row:
            continue
        if not places:
            columns = columns or UNTITLED.get(len(row), UNTITLED[2])
            places = _places(columns, report.file)
        try:
            expect_fields(row, len(columns), "a row of points")
            table.extend(_parse_point(places, pair, row))
            line_numbers.append(number)
        except DamagedLine as damage:
            report.skip(number, damage)
    rows = np.frombuffer(table).reshape(-1, 4)  # no copy: a long table is not held twice
    return np.frombuffer(line_numbers, dtype=np.int64), rows, places


def _places(columns: Sequence[Column], file: str) -> dict[str, tuple[int, Column]]:
    """The column of each meaning; `LogError` where two columns claim one."""
    places: dict[str, tuple[int, Column]] = {}
    for k, column in enumerate(columns):
        meaning = column.meaning if column.number is None else ""
        if meaning in places and meaning != "clock":
            raise LogError(
                f"{file}: the columns {places[meaning][1].title!r} and {column.title!r} are both "
                f"taken for {meaning}; rename one of them, or take it out"
            )
        if meaning:
            places.setdefault(meaning, (k, column))
    return places


def _parse_point(
    places: dict[str, tuple[int, Column]], pair: tuple[str, str], row: Sequence[str]
) -> tuple[float, float, float, float]:
    """Number of the scan, stamp [s] and the two coordinates [m, rad] of one row."""
    scan, stamp = 0.0, math.nan
    if "scan" in places:
        scan = parse_finite(row[places["scan"][0]], "scan")
        if not scan.is_integer():
            raise DamagedLine(
                f"scan is {scan:g}, expected a whole number; if the columns mean something else, "
                f"name them in a header, as `x,y,intensity`"
            )
    if "clock" in places:
        k, clock = places["clock"]
        stamp = parse_stamp(row[k], clock.scale)
    (k, first), (m, second) = (places[meaning] for meaning in pair)
    if pair == POLAR:
        angle = first.scale * parse_finite(row[k], "angle")
        return scan, stamp, angle, second.scale * parse_numbers([row[m] or "nan"], "range")[0]
    x, y = first.scale * parse_finite(row[k], "x"), second.scale * parse_finite(row[m], "y")
    expect_near(x, y, "the point")
    return scan, stamp, x, y


def _scans(
    rows: FloatArray,
    places: dict[str, tuple[int, Column]],
    pair: tuple[str, str],
    report: DamageReport,
) -> Sequence[IntArray | slice]:
    """Rows of each scan, in the order of their first rows: a slice, or indices if they scatter."""
    if "scan" in places:
        numbers = rows[:, 0]
    else:
        numbers = rows[:, 1]  # the stamps
        if "clock" in places and len(np.unique(numbers)) > 0.5 * len(rows):
            rows[:, 1] = np.nan  # of single points
            report.remarks.append(
                f"the column {places['clock'][1].title!r} gives each point its own time, which "
                f"tells no scan; a column `scan` would"
            )
        if np.isnan(numbers).all():
            numbers = _turns(rows[:, 2], report) if pair == POLAR else np.zeros(len(rows))
    starts = np.flatnonzero(np.diff(numbers)) + 1
    if len(starts) < len(np.unique(numbers)):  # each number in one piece
        return [slice(a, b) for a, b in pairwise([0, *starts.tolist(), len(numbers)])]
    order = np.argsort(numbers, kind="stable")
    starts = np.flatnonzero(np.diff(numbers[order])) + 1
    return sorted(np.split(order, starts), key=lambda group: int(group[0]))


def _turns(angles: FloatArray, report: DamageReport) -> FloatArray:
    """Number of the turn of each row: one begins where the angles jump back to their start."""
    steps, span = np.diff(angles), np.ptp(angles)
    direction = np.sign(np.median(steps[steps != 0.0])) if steps.any() else 1.0
    jumps = direction * steps < -0.5 * span
    if jumps.any() and span > 0.0:
        report.remarks.append(
            f"no column numbers the scans: one begins where the angles start anew, "
            f"{np.count_nonzero(jumps) + 1} in all"
        )
    return np.concatenate([[0.0], np.cumsum(jumps)])


def _expect_radians(angles: FloatArray, place: tuple[int, Column], file: str) -> None:
    try:
        check_angles(angles, "")
    except InvalidParameterError as error:
        title = place[1].title
        raise LogError(
            f"{file}: the column {title!r} {error.problem}; the title `angle_deg` says degrees"
        ) from None


def _suspect_angles(pairs: FloatArray, report: DamageReport) -> None:
    """Remark on two columns without titles that look like angles and ranges."""
    first, second = pairs.T
    steps = np.diff(first)
    is_sweep = len(first) >= MANY_ROWS and ((steps > 0.0).all() or (steps < 0.0).all())
    if is_sweep and np.ptp(first) <= 360.0 and (second >= 0.0).all() and np.ptp(first) > 1.0:
        report.remarks.append(
            "the first column runs one way and the second is never negative: if they are angles "
            "and ranges, say so in a header, as `angle,range` or `angle_deg,range_mm`"
        )


def _suspect_millimetres(points: FloatArray, report: DamageReport) -> None:
    if not len(points):
        return
    extent = float(np.median(np.hypot(*(points - np.median(points, axis=0)).T)))
    if extent > MAX_USUAL_RANGE:
        report.remarks.append(
            f"half of the points lie more than {extent:.4g} m from their middle: are they "
            f"millimetres? labkit reads metres"
        )


def _are_points(source: Source) -> bool:
    """Recognise titles of coordinates, or two or three numbers a row without titles."""
    table = source.table
    first = next(filter(holds_values, table.rows), [])
    is_pair = len([field for field in first if field]) > 1 and not table.has_unknown_titles
    return coordinates_of(table.columns) == XY or (is_pair and not coordinates_of(table.columns))


READERS = (
    Reader(
        name="polar",
        files="points as rows `scan,angle,range`",
        recognises=lambda source: coordinates_of(source.table.columns) == POLAR,
        uses=("no_return", "time_increment"),
        read=read,
    ),
    Reader(
        name="points", files="points as rows `x,y` or `scan,x,y`", recognises=_are_points, read=read
    ),
)
