"""Tables: rows of points ``x,y`` or ``scan,x,y``, and rows of ranges, one scan a row.

Fields stand between commas, semicolons (then a comma may be the decimal point) or white
space; ``#`` begins a comment. A header names the columns of points in any order; others are
left out. In a table of ranges it may name a column ``stamp``, ``time`` or ``timestamp`` [s]; the
others are beams by number, as ``r0,r1,r2``.
"""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterable, Sequence

import numpy as np

from labkit.logs.lines import (
    DamagedLine,
    DamageReport,
    expect_fields,
    expect_near,
    is_number,
    parse_finite,
    parse_numbers,
)
from labkit.logs.sweeps import MILLIMETRES, Sweep
from labkit.scan import Scan
from labkit.support.arrays import FloatArray
from labkit.support.errors import LogError

CLOCKS = ("stamp", "time", "timestamp")
POINT = ("x", "y")
NUMBERED = re.compile(r"(.*?)[\[(]?[0-9]+[\])]?")  # r0, ranges[0]
FEWEST_BEAMS = 4


def split_row(line: str) -> list[str]:
    """The fields of a row; none in a blank line or a comment."""
    text = line.partition("#")[0].strip()
    if ";" in text:
        return [field.strip().replace(",", ".") for field in text.split(";")]
    return [field.strip() for field in text.split(",")] if "," in text else text.split()


def table_kind(lines: Sequence[str]) -> str:
    """``"points"``, ``"ranges"`` or ``""`` by the first five rows of a file."""
    rows = [row for row in map(split_row, lines[:50]) if row][:5]
    kinds = ("points" if _columns(row) else "ranges" * _is_row_of_ranges(row) for row in rows)
    return next(filter(None, kinds), "")


def read_points_table(lines: Iterable[tuple[int, str]], report: DamageReport) -> tuple[Scan, ...]:
    """Read rows of points; scans come in the order in which their number is first met."""
    names: list[str] = []
    found: dict[float, array[float]] = {}
    for number, text in lines:
        row = split_row(text)
        if not names:
            names = _columns(row)
            if names and not _is_number_row(row):
                continue
        try:
            if row:
                scan, x, y = _parse_point(names or POINT, row)
                found.setdefault(scan, array("d")).extend((x, y))
        except DamagedLine as damage:
            report.skip(number, damage)
    scans = tuple(Scan.from_points(np.array(points).reshape(-1, 2)) for points in found.values())
    if scans:
        first = scans[0].points
        extent = float(np.median(np.hypot(*(first - np.median(first, axis=0)).T)))
        if extent > MILLIMETRES:
            report.remarks.append(
                f"half of the points lie more than {extent:.4g} m from their middle: are they "
                f"millimetres? labkit reads metres"
            )
    return scans


def _parse_point(names: Sequence[str], row: Sequence[str]) -> tuple[float, float, float]:
    """Number of the scan, x and y of one row."""
    expect_fields(row, len(names), "a row of points")
    named = {"scan": "0"} | dict(zip(names, row, strict=True))
    scan, x, y = (parse_finite(named[name], name) for name in ("scan", *POINT))
    expect_near(x, y, "the point")
    if not scan.is_integer():
        raise DamagedLine(
            f"scan is {scan:g}, expected a whole number; if the columns mean something else, name "
            f"them in a header, as `x,y,intensity`"
        )
    return scan, x, y


def read_ranges_table(
    lines: Iterable[tuple[int, str]], report: DamageReport, angles: FloatArray | None
) -> list[Sweep]:
    """Read a sweep from each row of ranges; an empty field is no return."""
    rows = [(number, row) for number, text in lines if (row := split_row(text))]
    if not any(row[-1] for _, row in rows):  # each row ends in a comma
        rows = [(number, row[:-1]) for number, row in rows]
    is_numbered = _is_numbered(rows[0][1])  # as pandas does, and the rows where it says so
    header = rows.pop(0)[1] if is_numbered or not _is_row_of_ranges(rows[0][1]) else []
    if is_numbered and not header[0]:  # the number of a row is no beam
        header, rows = header[1:], [(number, row[1:]) for number, row in rows]
    clock = _clock_column(header, report.file) if header and not is_numbered else None
    count = len(header or rows[0][1]) - (clock is not None)
    if angles is None:
        raise LogError(
            f"{report.file}: rows of {count} numbers; if they are ranges, name the first and the "
            f"last beam's direction [rad], as `angles=(-2.356, 2.356)`, for `labkit odometry` as "
            f"`--angles -2.356 2.356`"
        )
    beams, sweeps = np.linspace(angles[0], angles[1], count), []
    for number, row in rows:
        try:
            expect_fields(row, count + (clock is not None), f"{count} beams")
            stamp = np.nan if clock is None else parse_finite(row.pop(clock), "the stamp")
            ranges = parse_numbers([field or "nan" for field in row], "range")
            sweeps.append(Sweep(number, Scan.from_ranges(ranges, beams, stamp=stamp)))
        except DamagedLine as damage:
            report.skip(number, damage)
    firsts = np.array([np.asarray(sweep.scan.ranges)[0] for sweep in sweeps])
    if not header and len(sweeps) > FEWEST_BEAMS and np.all(firsts[1:] > firsts[:-1]):
        report.remarks.append(
            "the first column rises in every row: if it is a clock and no beam, say so in a "
            "header, as `stamp,r0,r1,r2`"
        )
    return sweeps


def _clock_column(row: Sequence[str], file: str) -> int | None:
    """The column of the clock by a header of ranges; all others must be beams of one name."""
    names = [field.strip("\"' %").lower() for field in row]
    stems = [found[1] if (found := NUMBERED.fullmatch(name)) else "" for name in names]
    beam = max(stems, key=stems.count)
    for name, stem in zip(names, stems, strict=True):
        if name not in CLOCKS and (stem != beam or not beam):
            raise LogError(
                f"{file}: the column {name!r} is neither a clock ({', '.join(CLOCKS)}) nor a "
                f"numbered beam (r0, r1, ...); rename it, take it out, or begin a title with #"
            )
    return next((k for k, name in enumerate(names) if name in CLOCKS), None)


def _columns(row: Sequence[str]) -> list[str]:
    """Names of the columns by a header or a good row of points; none by any other row."""
    names = [field.strip("\"' ").lower() for field in row]
    if names.count("x") == names.count("y") == 1 and names.count("scan") <= 1:
        return names
    if len(row) in {2, 3} and _is_number_row(row):
        return ["scan", *POINT][-len(row) :]
    return []


def _is_number_row(row: Sequence[str]) -> bool:
    return all(is_number(field) and math.isfinite(float(field)) for field in row)


def _is_numbered(row: Sequence[str]) -> bool:
    """Recognise a header that counts the columns from 0, but for one of row numbers before them."""
    names = list(row if row[0] else row[1:])
    return names == [str(number) for number in range(len(names))]


def _is_row_of_ranges(row: Sequence[str]) -> bool:
    """Recognise a row of ranges: four numbers or more, some of which may be missing."""
    return len(row) >= FEWEST_BEAMS and all(is_number(field) for field in row if field)
