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
from labkit.logs.columns import POLAR, RADIANS, XY, Column, parse_title, split_row
from labkit.logs.doubts import MAX_USUAL_RANGE
from labkit.logs.lines import (
    DamagedLine,
    DamageReport,
    expect_fields,
    expect_near,
    parse_finite,
    parse_numbers,
)
from labkit.logs.log import Content
from labkit.logs.reader import Reader, Reading, Source, Sweep, holds_values
from labkit.logs.scanner import Scanner
from labkit.scan import MOST_TURN, check_angles
from labkit.support.arrays import FloatArray, IntArray
from labkit.support.errors import InvalidParameterError, LogError

UNTITLED = {count: [*map(parse_title, ("scan", *XY)[-count:])] for count in (2, 3)}
MANY_ROWS = 20  # from here on it is no chance that a column runs one way
MAX_UNEVENNESS = 0.2  # of a step: directions are rounded
MIN_TURNS = 1.5  # turns a stamp: more, and the stamps do not part the scans
FEWEST_TURNS = 3  # tell what a usual view is
FULL_VIEW = 0.9  # of the usual view: a first or last scan that covers less was cut


def coordinates_of(columns: Sequence[Column]) -> tuple[str, str] | None:
    """The coordinates that the columns of a table name: x and y, or angle and range."""
    named = {column.meaning for column in columns if column.number is None}
    return next((pair for pair in (XY, POLAR) if named.issuperset(pair)), None)


def read(source: Source) -> Reading:
    """Read a table of points."""
    return read_rows(source.lines(source.table.begin), source.table.columns, source)


def read_rows(
    lines: Iterable[tuple[int, str]], columns: Sequence[Column], source: Source
) -> Reading:
    """Read rows of points; scans come in the order in which their number is first met."""
    report, scanner = source.report, source.scanner
    pair = coordinates_of(columns) or XY
    line_numbers, rows, places = _read_rows(lines, report, columns, pair)
    if not len(rows):
        return Reading()
    units = [_unit(places[meaning][1], meaning, scanner) for meaning in pair]
    if not columns and (degrees := _unit_of_directions(rows, report)):
        pair, units = POLAR, [scanner.radians(degrees), scanner.metres()]
    coordinates = rows[:, 2:]
    coordinates *= units
    if pair == POLAR:
        _expect_radians(coordinates[:, 0], places.get("angle"), report.file)
    groups = _without_cut_ends(_scans(rows, places, pair, report), coordinates, pair, report)
    if pair == XY:
        _suspect_millimetres(coordinates[groups[0]], report)
    sweeps = []
    for group in source.part(groups):
        line = line_numbers[group][0]
        stamp = float(rows[group][0, 1])
        points = coordinates[group]
        if pair == XY:
            sweeps.append(Sweep(int(line), scanner.scan_of_points(points, stamp)))
        else:
            angles, ranges = points.T
            directions = -angles if scanner.mirrored else angles
            scan = scanner.scan(ranges / units[1], directions, scale=units[1], stamp=stamp)
            sweeps.append(Sweep(int(line), scan))
    is_named = "clock" in places and bool(places["clock"][1].unit)
    return Reading(sweeps=sweeps, clock_is_named=is_named, contents=contents_of(columns, places))


def contents_of(columns: Sequence[Column], places: dict[str, tuple[int, Column]]) -> list[Content]:
    """The columns of a table of points, and what they are read as."""
    uses = {k: meaning for meaning, (k, _) in places.items()}
    return [
        Content(column.title, "column", uses.get(k, column.harmless))
        for k, column in enumerate(columns)
    ]


def _unit(column: Column, meaning: str, scanner: Scanner) -> float:
    """Factor of a coordinate to metres or radians."""
    return scanner.radians(column.scale) if meaning == "angle" else scanner.metres(column.scale)


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
    (k, _), (m, _) = (places[meaning] for meaning in pair)
    if pair == POLAR:
        angle = parse_finite(row[k], "angle")
        return scan, stamp, angle, parse_numbers([row[m] or "nan"], "range")[0]
    x, y = parse_finite(row[k], "x"), parse_finite(row[m], "y")
    expect_near(x, y, "the point")
    return scan, stamp, x, y


def _scans(
    rows: FloatArray,
    places: dict[str, tuple[int, Column]],
    pair: tuple[str, str],
    report: DamageReport,
) -> Sequence[IntArray | slice]:
    """Rows of each scan, in the order of their first rows: a slice, or indices if they scatter."""
    numbers, stamps = rows[:, 0], rows[:, 1]
    if "scan" in places:
        numbers = _with_restarts(numbers, report)
    else:
        numbers = _numbers_without_column(rows, pair, report)
        is_of_points = len(np.unique(stamps)) > 0.5 * len(rows)
        if "clock" in places and is_of_points and pair == XY:
            rows[:, 1] = np.nan
            report.remarks.append(
                f"the column {places['clock'][1].title!r} gives each point its own time, which "
                f"tells no scan; a column `scan` would"
            )
    starts = np.flatnonzero(np.diff(numbers)) + 1
    if len(starts) < len(np.unique(numbers)):  # each number in one piece
        return [slice(a, b) for a, b in pairwise([0, *starts.tolist(), len(numbers)])]
    order = np.argsort(numbers, kind="stable")
    starts = np.flatnonzero(np.diff(numbers[order])) + 1
    return sorted(np.split(order, starts), key=lambda group: int(group[0]))


def _with_restarts(numbers: FloatArray, report: DamageReport) -> FloatArray:
    """Numbers of scans that go on where a second recording in one file starts them anew."""
    restarts = np.flatnonzero(np.diff(numbers) < 0.0) + 1
    epochs = np.split(numbers, restarts)
    if not len(restarts) or min(len(np.unique(epoch)) for epoch in epochs) < FEWEST_TURNS:
        return numbers  # the rows of a scan scatter
    report.remarks.append(
        f"the numbers of the scans start anew {len(restarts)} times: are these several recordings? "
        f"What lies between two of them counts as one step"
    )
    return np.cumsum(np.diff(numbers, prepend=numbers[0]) != 0.0).astype(np.float64)


def _numbers_without_column(
    rows: FloatArray, pair: tuple[str, str], report: DamageReport
) -> FloatArray:
    """Number of the scan of each row: by the stamps, or by the turns where those tell more."""
    stamps = rows[:, 1]
    stamp_count = 1 if np.isnan(stamps).all() else len(np.unique(stamps))
    are_of_points = stamp_count > 0.5 * len(rows)
    directions = rows[:, 2] if pair == POLAR else np.arctan2(rows[:, 3], rows[:, 2])
    turns = _turns(directions)
    turn_count = int(turns[-1]) + 1
    has_more_turns = are_of_points or turn_count > MIN_TURNS * stamp_count
    if pair == POLAR and has_more_turns and turn_count > 1:
        report.remarks.append(
            f"no column numbers the scans: one begins where the angles start anew, {turn_count} "
            f"in all"
        )
        return turns
    if are_of_points or stamp_count == 1:
        return np.zeros(len(rows))
    whole = (np.diff(np.unique(stamps)) % 1.0 == 0.0).all()
    if whole and turn_count > MIN_TURNS * stamp_count:
        report.remarks.append(
            f"the clock counts whole seconds, and the points of one stamp go round "
            f"{turn_count / stamp_count:.1f} times: several sweeps count as one scan; a column "
            f"`scan` would part them"
        )
    return stamps


def _turns(angles: FloatArray) -> FloatArray:
    """Number of the turn of each row: one begins where the angles jump back to their start."""
    steps, span = np.diff(angles), np.ptp(angles)
    direction = np.sign(np.median(steps[steps != 0.0])) if steps.any() else 1.0
    jumps = (direction * steps < -0.5 * span) & (span > 0.0)
    return np.concatenate([[0.0], np.cumsum(jumps)])


def _without_cut_ends(
    groups: Sequence[IntArray | slice],
    coordinates: FloatArray,
    pair: tuple[str, str],
    report: DamageReport,
) -> Sequence[IntArray | slice]:
    """The scans without a first and a last one whose view is narrower than the usual.

    A recording may begin and end in mid-turn.
    """
    if len(groups) < FEWEST_TURNS:
        return groups
    ends = {0: "first", len(groups) - 1: "last"}
    views = np.array([_view(coordinates[group], pair) for group in groups])
    usual = float(np.median(views))
    is_cut = views < FULL_VIEW * usual
    cut = [k for k in ends if is_cut[k]]
    for k in cut:
        report.remarks.append(
            f"the {ends[k]} scan covers {np.degrees(views[k]):.0f} degrees and the others "
            f"{np.degrees(usual):.0f}: its turn was cut, and it is left out"
        )
    return [group for k, group in enumerate(groups) if k not in cut]


def _view(points: FloatArray, pair: tuple[str, str]) -> float:
    """Angle [rad] that the points of a scan cover: a turn without its widest gap."""
    directions = points[:, 0] if pair == POLAR else np.arctan2(points[:, 1], points[:, 0])
    around = np.sort(directions % (2.0 * math.pi))
    gaps = np.diff(around, append=around[:1] + 2.0 * math.pi)
    return 2.0 * math.pi - float(gaps.max())


def _expect_radians(angles: FloatArray, place: tuple[int, Column] | None, file: str) -> None:
    try:
        check_angles(angles, "")
    except InvalidParameterError as error:
        title = "" if place is None else place[1].title
        raise LogError(
            f"{file}: the column {title!r} {error.problem}; the title `angle_deg` says degrees, "
            f"and so does `angle_unit` (`--angle-unit deg`)"
        ) from None


def _unit_of_directions(rows: FloatArray, report: DamageReport) -> float | None:
    """Unit [rad] of a first column without a title that holds directions, or None.

    Directions run evenly; coordinates of walls do not. A remark tells of a column that runs one
    way and not evenly.
    """
    numbers, _, first, second = rows.T
    steps = np.diff(first)[np.diff(numbers) == 0.0]
    if len(first) < MANY_ROWS or (second < 0.0).any() or not 1.0 < np.ptp(first) <= 360.0:
        return None
    usual = float(np.median(steps))
    against = np.count_nonzero(steps * usual <= 0.0)
    if against * MANY_ROWS >= len(steps):
        return None
    is_even = np.count_nonzero(np.abs(steps - usual) <= MAX_UNEVENNESS * abs(usual))
    if is_even + against < len(steps):
        report.remarks.append(
            "the first column runs one way and the second is never negative: if they are angles "
            "and ranges, say so in a header, as `angle,range` or `angle_deg,range_mm`"
        )
        return None
    unit = "radians" if np.abs(first).max() <= MOST_TURN else "degrees"
    report.remarks.append(
        f"the columns have no titles, and one runs evenly, as directions do: they are read as "
        f"angles in {unit} and ranges; titles (`x,y`) say otherwise"
    )
    return RADIANS[unit]


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
        uses=("no_return", "time_increment", "angle_unit", "blind_beams"),
        read=read,
    ),
    Reader(
        name="points", files="points as rows `x,y` or `scan,x,y`", recognises=_are_points, read=read
    ),
)
