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
from typing import NamedTuple

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
from labkit.logs.log import Content
from labkit.logs.reader import Reader, Reading, Source, Sweep, holds_values
from labkit.logs.stored import StoredScan
from labkit.scan import MOST_TURN, Scan, check_angles
from labkit.support.arrays import FloatArray, IntArray
from labkit.support.errors import InvalidParameterError, LogError

Places = dict[str, tuple[int, Column]]  # of each meaning, the column that holds it
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


class Rows(NamedTuple):
    """The rows of one scan: its first line and stamp, and their coordinates as in the file."""

    line: int
    stamp: float
    first: FloatArray  # x, or the angle [rad]
    second: FloatArray  # y, or the range


def read(source: Source) -> Reading:
    """Read a table of points."""
    return read_rows(source.lines(source.table.begin), source.table.columns, source)


def read_rows(
    lines: Iterable[tuple[int, str]], titles: Sequence[Column], source: Source
) -> Reading:
    """Read rows of points; scans come in the order in which their number is first met."""
    scanner = source.scanner
    columns = titles or UNTITLED.get(len(next(iter(source.table.rows), [])), UNTITLED[2])
    places = _places(columns, source.report.file)
    pair, scans = _part_scans(lines, columns, places, source, has_titles=bool(titles))
    scale = places["range"][1].scale if "range" in places else 1.0
    sweeps = []
    for rows in source.part(scans):
        scan: StoredScan | Scan
        if pair == XY:
            points = np.column_stack([rows.first, rows.second])
            scan = scanner.scan_of_points(points, rows.stamp)
        else:
            angles = -rows.first if scanner.mirrored else rows.first.copy()
            scan = scanner.scan(rows.second, angles, scale=scale, stamp=rows.stamp)
        sweeps.append(Sweep(rows.line, scan))
    is_named = "clock" in places and bool(places["clock"][1].unit)
    return Reading(sweeps=sweeps, clock_is_named=is_named, contents=contents_of(titles, places))


def _part_scans(
    lines: Iterable[tuple[int, str]],
    columns: Sequence[Column],
    places: Places,
    source: Source,
    *,
    has_titles: bool,
) -> tuple[tuple[str, str], list[Rows]]:
    """Which coordinates a table holds, and its rows scan by scan."""
    report, scanner = source.report, source.scanner
    pair = coordinates_of(columns) or XY
    read = {name: places[name] for name in ("scan", "clock", *pair) if name in places}
    line_numbers, values = _parse_rows(lines, read, len(columns), source)
    if not len(line_numbers):
        return pair, []
    x, y = (values[meaning] for meaning in pair)
    first, second = (places[meaning][1] for meaning in pair)
    numbers, stamps = values.get("scan"), values.get("clock")
    if not has_titles and (unit := _unit_of_directions(numbers, x, y, report)):
        pair = POLAR
        first = parse_title(f"angle [{unit}]")
    if pair == POLAR:
        x *= scanner.radians(first.scale)
        _expect_radians(x, first.title, report.file)
        directions = x
    else:
        x *= scanner.metres(first.scale)
        y *= scanner.metres(second.scale)
        directions = np.arctan2(y, x)
    if numbers is not None:
        numbers = _with_restarts(numbers, report)
    else:
        title = places["clock"][1].title if "clock" in places else ""
        numbers, stamps = _number_scans(stamps, title, directions, pair, report)
    groups = _without_cut_ends(_groups_of(numbers), directions, report)
    if pair == XY:
        _suspect_millimetres(x[groups[0]], y[groups[0]], report)
    return pair, [
        Rows(
            int(line_numbers[group][0]),
            math.nan if stamps is None else float(stamps[group][0]),
            x[group],
            y[group],
        )
        for group in groups
    ]


def contents_of(columns: Sequence[Column], places: Places) -> list[Content]:
    """The columns of a table of points, and what they are read as."""
    uses = {k: meaning for meaning, (k, _) in places.items()}
    return [
        Content(column.title, "column", uses.get(k, column.harmless))
        for k, column in enumerate(columns)
    ]


def _parse_rows(
    lines: Iterable[tuple[int, str]],
    places: Places,
    width: int,
    source: Source,
) -> tuple[IntArray, dict[str, FloatArray]]:
    """Lines of the good rows, and what each column holds; a table may have millions of rows."""
    line_numbers = array("q")
    columns = {meaning: array("d") for meaning in places}

    def parse(number: int, text: str) -> tuple[int, list[float]] | None:
        row = split_row(text)
        if not row:
            return None
        expect_fields(row, width, "a row of points")
        fields = [_parse_field(row, places[meaning], meaning) for meaning in columns]
        if "x" in columns:
            expect_near(fields[-2], fields[-1], "the point")
        return number, fields

    for number, fields in source.parse(parse, lines):
        line_numbers.append(number)
        for column, value in zip(columns.values(), fields, strict=True):
            column.append(value)
    values = {meaning: np.frombuffer(column) for meaning, column in columns.items()}  # no copies
    return np.frombuffer(line_numbers, dtype=np.int64), values


def _places(columns: Sequence[Column], file: str) -> Places:
    """The column of each meaning; `LogError` where two columns claim one."""
    places: Places = {}
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


def _parse_field(row: Sequence[str], place: tuple[int, Column], meaning: str) -> float:
    """One number of a row: whole of a scan, in seconds of a clock."""
    field = row[place[0]]
    if meaning == "clock":
        return parse_stamp(field, place[1].scale)
    if meaning == "range":  # which may be missed
        return parse_numbers([field or "nan"], "range")[0]
    value = parse_finite(field, meaning)
    if meaning == "scan" and not value.is_integer():
        raise DamagedLine(
            f"scan is {value:g}, expected a whole number; if the columns mean something else, "
            f"name them in a header, as `x,y,intensity`"
        )
    return value


def _groups_of(numbers: FloatArray) -> Sequence[IntArray | slice]:
    """Rows of each scan, in the order of their first rows: a slice, or indices if they scatter."""
    starts = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist()]
    if len(np.unique(numbers[starts])) == len(starts):  # each number in one piece
        return [slice(a, b) for a, b in pairwise([*starts, len(numbers)])]
    order = np.argsort(numbers, kind="stable")
    ends = np.flatnonzero(np.diff(numbers[order])) + 1
    return sorted(np.split(order, ends), key=lambda group: int(group[0]))


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


def _number_scans(
    stamps: FloatArray | None,
    title: str,
    directions: FloatArray,
    pair: tuple[str, str],
    report: DamageReport,
) -> tuple[FloatArray, FloatArray | None]:
    """Number of the scan of each row by the stamps, or by the turns where those tell more.

    The stamps come back, or None where they tell no scan.
    """
    turns = _turns(directions)
    turn_count = int(turns[-1]) + 1
    stamp_count = 1 if stamps is None else len(np.unique(stamps))
    is_of_points = stamp_count > 0.5 * len(turns)
    has_more_turns = turn_count > 1 and (is_of_points or turn_count > MIN_TURNS * stamp_count)
    if pair == POLAR and has_more_turns:
        report.remarks.append(
            f"no column numbers the scans: one begins where the angles start anew, {turn_count} "
            f"in all"
        )
        return turns, stamps
    if stamps is None or stamp_count == 1:
        return np.zeros(len(turns)), stamps
    if is_of_points:
        report.remarks.append(
            f"the column {title!r} gives each point its own time, which tells no scan; a column "
            f"`scan` would"
        )
        return np.zeros(len(turns)), None
    if has_more_turns and (np.diff(np.unique(stamps)) % 1.0 == 0.0).all():
        report.remarks.append(
            f"the clock counts whole seconds, and the points of one stamp go round "
            f"{turn_count / stamp_count:.1f} times: several sweeps count as one scan; a column "
            f"`scan` would part them"
        )
    return stamps, stamps


def _turns(angles: FloatArray) -> FloatArray:
    """Number of the turn of each row: one begins where the angles jump back to their start."""
    steps, span = np.diff(angles), np.ptp(angles)
    direction = np.sign(np.median(steps[steps != 0.0])) if steps.any() else 1.0
    jumps = (direction * steps < -0.5 * span) & (span > 0.0)
    return np.concatenate([[0.0], np.cumsum(jumps)])


def _without_cut_ends(
    groups: Sequence[IntArray | slice], directions: FloatArray, report: DamageReport
) -> Sequence[IntArray | slice]:
    """The scans without a first and a last one whose view is narrower than the usual.

    A recording may begin and end in mid-turn.
    """
    if len(groups) < FEWEST_TURNS:
        return groups
    views = np.array([_view(directions[group]) for group in groups])
    usual = float(np.median(views))
    ends = {0: "first", len(groups) - 1: "last"}
    cut = [k for k in ends if views[k] < FULL_VIEW * usual]
    for k in cut:
        report.remarks.append(
            f"the {ends[k]} scan covers {np.degrees(views[k]):.0f} degrees and the others "
            f"{np.degrees(usual):.0f}: its turn was cut, and it is left out"
        )
    return [group for k, group in enumerate(groups) if k not in cut]


def _view(directions: FloatArray) -> float:
    """Angle [rad] that the points of a scan cover: a turn without its widest gap."""
    around = np.sort(directions % (2.0 * math.pi))
    gaps = np.diff(around, append=around[:1] + 2.0 * math.pi)
    return 2.0 * math.pi - float(gaps.max())


def _expect_radians(angles: FloatArray, title: str, file: str) -> None:
    try:
        check_angles(angles, "")
    except InvalidParameterError as error:
        raise LogError(
            f"{file}: the column {title!r} {error.problem}; the title `angle_deg` says degrees, "
            f"and so does `angle_unit` (`--angle-unit deg`)"
        ) from None


def _unit_of_directions(
    numbers: FloatArray | None, first: FloatArray, second: FloatArray, report: DamageReport
) -> str | None:
    """Unit of a first column without a title that holds directions, or None.

    Directions run evenly; coordinates of walls do not. A remark tells of a column that runs one
    way and not evenly.
    """
    steps = np.diff(first)
    if numbers is not None:
        steps = steps[np.diff(numbers) == 0.0]
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
    return unit


def _suspect_millimetres(x: FloatArray, y: FloatArray, report: DamageReport) -> None:
    extent = float(np.median(np.hypot(x - np.median(x), y - np.median(y))))
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
