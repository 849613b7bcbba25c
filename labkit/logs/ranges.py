"""Tables of ranges, one scan a row, and numpy's arrays of them.

The columns are beams by number, as ``r0,r1,r2``, or one list of them, ``ranges``. Beside them a
clock may stand, and the other fields of ROS's ``LaserScan``: ``rostopic echo -p`` and its like
write such tables.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from labkit.logs.clocks import parse_stamp
from labkit.logs.columns import (
    CLOCK,
    DECLARED,
    HARMLESS,
    IN_ONE_WORD,
    Column,
    choose_clocks,
    list_fields,
    split_row,
)
from labkit.logs.lines import (
    DamageReport,
    expect_fields,
    is_number,
    parse_finite,
    parse_numbers,
)
from labkit.logs.log import Content
from labkit.logs.reader import Reader, Reading, Source, Sweep, Table, holds_values
from labkit.logs.scanner import Scanner
from labkit.support.errors import LogError

FEWEST_BEAMS = 4
MAX_UNEVENNESS = 0.5  # of a step: directions may be rounded
MANY_BEAMS = 9  # whose ranges hardly ever run evenly
LEFT_OUT = HARMLESS | {"frame_id"}
ENDS = (0, 1, 2, 3, -4, -3, -2, -1)  # columns in which a clock or a pose may stand
OTHER_COLUMNS = (
    "a first or a last column rises in every row, or holds negative numbers: if it is a clock or a "
    "pose and no beam, say so in a header, as `stamp,r0,r1,r2`"
)


@dataclass(frozen=True, kw_only=True)
class Layout:
    """The columns of a table of ranges by what they hold."""

    width: int
    beams: Sequence[int]  # their columns in the order of their numbers, or the one of a list
    scale: float  # of the ranges, to metres
    clocks: Sequence[tuple[int, float]]  # columns and units [s], which add up
    declared: Mapping[str, tuple[int, float]]  # columns and units of the fields in `DECLARED`
    frame: int | None = None  # the column of the scanner's frame


def is_known(column: Column) -> bool:
    """True for a clock, ranges, a number of the scan, and what a LaserScan declares."""
    is_field = IN_ONE_WORD.get(column.name, column.name) in {*DECLARED, "frame_id"}
    return is_field or column.meaning in {"clock", "range", "scan"}


def layout_of(columns: Sequence[Column], file: str) -> Layout:
    """Recognise each column of a table of ranges, or refuse it by its title."""
    numbered = [column.name for column in columns if column.number is not None]
    of_ranges = [name for name in numbered if name not in LEFT_OUT - {""}]
    beam = max(of_ranges, key=of_ranges.count) if of_ranges else None
    beams = list[Column]()
    declared = dict[str, tuple[int, float]]()
    for k, column in enumerate(columns):
        is_beam = column.name == beam and column.number is not None
        if is_beam or (beam is None and column.meaning == "range"):
            beams.append(column)
        elif column.meaning == "clock":
            continue
        elif (name := IN_ONE_WORD.get(column.name, column.name)) in DECLARED:
            declared[name] = k, column.scale
        elif column.meaning != "scan" and (
            column.name not in LEFT_OUT or (column.number is not None and not column.name)
        ):
            raise LogError(
                f"{file}: the column {column.title!r} is neither a clock ({', '.join(CLOCK[:3])}) "
                f"nor a numbered beam (r0, r1, ...); rename it, take it out, or begin a title "
                f"with #"
            )
    return Layout(
        width=len(columns),
        beams=_order_beams(beams, columns, file),
        scale=beams[0].scale,
        clocks=choose_clocks(columns),
        declared=declared,
        frame=next((k for k, column in enumerate(columns) if column.name == "frame_id"), None),
    )


def _order_beams(beams: Sequence[Column], columns: Sequence[Column], file: str) -> list[int]:
    """Columns of the beams in the order of their numbers, which must have no gap."""
    ordered = sorted(beams, key=lambda column: column.number or 0)
    numbers = [column.number or 0 for column in ordered]
    for number, expected in zip(numbers, range(numbers[0], numbers[0] + len(numbers)), strict=True):
        if number != expected:
            trouble = "one number twice" if number < expected else "a gap"
            raise LogError(
                f"{file}: the beams {ordered[0].title!r} to {ordered[-1].title!r} are numbered "
                f"with {trouble}, at {expected}"
            )
    units = {column.unit for column in ordered}
    if len(units) > 1:
        raise LogError(f"{file}: the beams have units of their own, {', '.join(sorted(units))}")
    return [columns.index(column) for column in ordered]


def are_ranges(table: Table) -> bool:
    """Recognise columns of ranges: numbered beams, one with a list of them, or many numbers."""
    numbered = sum(column.number is not None for column in table.columns)
    lists = [k for k, column in enumerate(table.columns) if column.meaning == "range"]
    counts = [len(list_fields(row[k])) for row in table.rows for k in lists if k < len(row)]
    if numbered >= FEWEST_BEAMS or max(counts, default=0) >= FEWEST_BEAMS:
        return True
    first = next(filter(holds_values, table.rows), [])
    return not table.has_unknown_titles and len(first) >= FEWEST_BEAMS


def read(source: Source) -> Reading:
    """Read a sweep of each row of ranges; an empty field is no return."""
    report, table = source.report, source.table
    if not table.rows:
        return Reading()
    if table.columns:
        layout = layout_of(table.columns, report.file)
    else:
        _refuse_directions(table, report.file)
        ends_in_comma = not any(row[-1] for row in table.rows)
        width = len(table.rows[0])
        beams = range(width - ends_in_comma)
        layout = Layout(width=width, beams=beams, scale=1.0, clocks=(), declared={})
    expect_directions(layout, table.rows[0], source)

    def parse(number: int, text: str) -> Sweep | None:
        row = split_row(text)
        return parse_sweep(number, row, layout=layout, scanner=source.scanner) if row else None

    sweeps = source.sweeps(source.parse(parse, source.lines(table.begin)))
    is_named = any(table.columns[k].unit for k, _ in layout.clocks)
    if not table.columns:
        _suspect_other_columns(sweeps, report)
    contents = _contents(table.columns, layout)
    return Reading(sweeps=sweeps, clock_is_named=is_named, contents=contents)


def _contents(columns: Sequence[Column], layout: Layout) -> list[Content]:
    """The columns of a table of ranges, and what they are read as."""
    held = [Content(f"{len(layout.beams)} columns", "ranges of beams", "ranges")]
    for k, column in enumerate(columns):
        if k not in layout.beams:
            held.append(
                Content(column.title, "column", "read" if is_known(column) else "left aside")
            )
    return held


def _suspect_other_columns(sweeps: Sequence[Sweep], report: DamageReport) -> None:
    """Remark on columns at the ends of a table without titles that hold no ranges.

    A clock rises in every row, and the poses of wheels are negative here or there.
    """
    if len(sweeps) <= FEWEST_BEAMS:
        return
    rows = np.array([np.asarray(sweep.scan.ranges)[[*ENDS]] for sweep in sweeps])
    rises = (rows[1:] > rows[:-1]).all(axis=0)
    is_negative = np.array([len(np.unique(column[column < 0.0])) > 2 for column in rows.T])
    if (rises | is_negative).any():
        report.remarks.append(OTHER_COLUMNS)


def _refuse_directions(table: Table, file: str) -> None:
    """Raise `LogError` for a first row that alone runs evenly, as directions of beams do."""
    row, *others = table.rows
    if others and _runs_evenly(row) and not _runs_evenly(others[0]):
        raise LogError(
            f"{file}:{table.line}: the numbers run evenly from {row[0]} to {row[-1]}, as "
            f"directions of beams do, and ranges do not; take the row out, and pass its ends as "
            f"`angles` in radians (`--angles`)"
        )


def _runs_evenly(row: Sequence[str]) -> bool:
    """True if the numbers of a row rise or fall by one step, but for rounding."""
    if len(row) < MANY_BEAMS or not all(map(is_number, row)) or row[0] == row[-1]:
        return False
    numbers = np.array(row, dtype=np.float64)
    if not np.isfinite(numbers).all():
        return False
    even = np.linspace(numbers[0], numbers[-1], len(numbers))
    step = abs(even[1] - even[0])
    return bool((np.abs(numbers - even) <= MAX_UNEVENNESS * step).all())


def tells_directions(declared: Collection[str]) -> bool:
    """True if fields of a LaserScan tell the first beam, and the step or the last one."""
    return "angle_min" in declared and ("angle_max" in declared or "angle_increment" in declared)


def expect_directions(layout: Layout, row: Sequence[str], source: Source) -> None:
    """Raise `LogError` unless the caller or the columns tell where the beams look."""
    if source.options.directions is not None or tells_directions(layout.declared):
        return
    count = len(layout.beams)
    if count == 1:
        count = len(list_fields(row[layout.beams[0]]))
    raise LogError(
        f"{source.report.file}: rows of {count} numbers; if they are ranges, name the first and "
        f"the last beam's direction [rad], as `angles=(-2.356, 2.356)`, for `labkit odometry` as "
        f"`--angles -2.356 2.356`, or in columns `angle_min` and `angle_increment`"
    )


def parse_sweep(number: int, row: Sequence[str], *, layout: Layout, scanner: Scanner) -> Sweep:
    """The sweep of one row of a table of ranges; `LabkitError` names what is damaged."""
    expect_fields(row, layout.width, f"{len(layout.beams)} beams")
    fields = [row[k] for k in layout.beams]
    if len(fields) == 1:
        fields = list_fields(fields[0])
    ranges = parse_numbers([field or "nan" for field in fields], "range")
    stamps = [parse_stamp(row[k], unit) for k, unit in layout.clocks]
    declared = {
        name: (_parse_declared(row[k], name), unit) for name, (k, unit) in layout.declared.items()
    }
    stamp = sum(stamps) if stamps else math.nan
    scan = scanner.sweep(ranges, declared, scale=layout.scale, stamp=stamp)
    return Sweep(number, scan, "" if layout.frame is None else row[layout.frame])


def _parse_declared(field: str, name: str) -> float:
    """A field of the message; only a range may be infinite."""
    if name.startswith("range"):
        return parse_numbers([field], name)[0]
    return parse_finite(field, name)


READER = Reader(
    name="ranges",
    files="tables of ranges, one scan a row",
    recognises=lambda source: are_ranges(source.table),
    uses=("angles", "no_return", "time_increment", "angle_unit", "blind_beams", "frame"),
    read=read,
)
