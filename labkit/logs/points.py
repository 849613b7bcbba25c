"""Bare points as text: rows ``x,y`` of one scan, or ``scan,x,y`` of several, in metres.

A header names the columns in any order and may name others, which are left out.
"""

from __future__ import annotations

import os
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from labkit.errors import LogError
from labkit.logs.lines import DamagedLine, DamageReport, expect_near, finite
from labkit.logs.log import Log, LogStream, ScanStream
from labkit.logs.remarks import FAR, tell_extent
from labkit.logs.source import TextSource
from labkit.scan import Scan

WHOLE_SCANS = 0.02
"""No larger share of the rows has a scan number that is none by damage alone."""

SAMPLE = 20_000
"""So many numbers of the first scan tell whether they are millimetres."""

Row = tuple[float | None, float, float]


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Where a row holds what: the places of x, y and the scan's number, of `count` fields."""

    count: int
    x: int
    y: int
    scan: int | None = None
    named: bool = False
    left_out: tuple[str, ...] = ()


PLAIN = Columns(count=2, x=0, y=1)
NUMBERED = Columns(count=3, scan=0, x=1, y=2)


def is_points(lines: Sequence[str]) -> bool:
    """Whether one of the first five rows is a header or a row of 2 or 3 numbers."""
    rows = [fields for fields in map(_split, lines[:50]) if fields][:5]
    return any(_columns(fields) is not None for fields in rows)


def parse_points(source: TextSource, report: DamageReport, *, name: str, keep: bool) -> LogStream:
    """Read rows of points, separated by commas or white space; see `labkit.logs.read_log`.

    The header, or without one the first good row, says which column is which. Scans come in
    the order in which their number is first met; there is no beam order, no time and no pose.
    ``#`` begins a comment. A point beyond 1e9 m is damaged.
    """
    table = _Table(source)
    found: dict[float | None, array[float]] = {}
    last: dict[float | None, int] = {}
    sample = array("d")
    for number, (scan, x, y) in table.rows(report):
        last[scan] = number
        if keep:
            found.setdefault(scan, array("d")).extend((x, y))
        if len(last) == 1 and len(sample) < SAMPLE:
            sample.extend((x, y))
    if not last:
        raise LogError(
            f"{report.file}: a table without any point, expected rows `x,y` or `scan,x,y`"
            f"{report.summary()}"
        )
    table.tell(report)
    first = np.array(sample).reshape(-1, 2)
    distances = np.hypot(*(first - np.median(first, axis=0)).T)
    tell_extent(report, float(np.median(distances)))

    def scans() -> Iterator[Scan]:
        groups = iter(found.values()) if keep else _complete(table, last)
        return (Scan.from_points(np.array(points).reshape(-1, 2)) for points in groups)

    return LogStream(
        scans=ScanStream(len(last), scans),
        stamps=np.full(len(last), np.nan),
        name=name,
        format="points",
        skipped=report.skipped,
        remarks=report.remarks,
    )


def _complete(table: _Table, last: dict[float | None, int]) -> Iterator[array[float]]:
    """The points of each scan, as soon as its last row is read and the scans before are out."""
    open_scans: dict[float | None, array[float]] = {}
    for number, (scan, x, y) in table.rows(None):
        open_scans.setdefault(scan, array("d")).extend((x, y))
        while open_scans and last[first := next(iter(open_scans))] <= number:
            yield open_scans.pop(first)


def read_points(path: str | os.PathLike[str]) -> Scan:
    """Read one scan of bare points: rows ``x,y`` in metres, with or without that header.

    A damaged row raises: a single scan has no other rows to speak for it.

    Parameters
    ----------
    path : path-like
        The file; gzip and zip are unpacked.

    Returns
    -------
    Scan
        With `points` of shape (N, 2) in the order of the file, and no beams.

    Raises
    ------
    LogError
        If the file cannot be read or has a damaged row (``FILE:LINE: …``), or if it holds
        several scans.
    """
    return read_single(path).scans[0]


def read_single(path: str | os.PathLike[str]) -> Log:
    """The same with what is odd about the file."""
    source = TextSource(path)
    report = DamageReport(source.file, strict=True)
    source.verify(report)
    if not is_points([text for _, (_, text) in zip(range(50), source.lines(), strict=False)]):
        raise LogError(f"{source.file}: not a table of points, expected rows `x,y` in metres")
    log = parse_points(source, report, name=source.file, keep=True).load()
    if len(log) != 1:
        raise LogError(
            f"{source.file}: {len(log)} scans, expected one; keep the rows of a single scan"
        )
    return log


class _Table:
    """The rows of a table of points, and what is odd about them."""

    def __init__(self, source: TextSource) -> None:
        self._source = source
        self._columns: Columns | None = None
        self._read = self._fractions = self._far = 0
        self._first_far: tuple[int, float, float] = (0, 0.0, 0.0)

    def rows(self, report: DamageReport | None) -> Iterator[tuple[int, Row]]:
        """The good rows with their line numbers; damage goes into `report`."""
        columns: Columns | None = None
        for number, text in self._source.lines(report):
            fields = _split(text)
            if not fields:
                continue
            if columns is None and (columns := _columns(fields)) is not None:
                self._columns = columns
                if columns.named:
                    continue
            try:
                scan, x, y = _parse_row(fields, columns)
                expect_near(x, y, "the point")
                if report is not None:
                    self._look_at(number, scan, x, y)
                if scan is not None and not scan.is_integer():
                    raise DamagedLine(
                        f"the scan number is {scan:g}, expected a whole number; a header names "
                        f"other columns, as `x,y,intensity`"
                    )
                yield number, (scan, x, y)
            except DamagedLine as damage:
                if report is not None:
                    report.skip(number, damage)

    def _look_at(self, number: int, scan: float | None, x: float, y: float) -> None:
        self._read += 1
        self._fractions += scan is not None and not scan.is_integer()
        if max(abs(x), abs(y)) > FAR:
            if not self._far:
                self._first_far = number, x, y
            self._far += 1

    def tell(self, report: DamageReport) -> None:
        """Say what is odd; raise `LogError` where the first column numbers no scans."""
        if self._fractions > max(1.0, WHOLE_SCANS * self._read):
            raise LogError(
                f"{report.file}: {self._fractions} of {self._read} rows begin with no whole "
                f"number, so that it is no scan's; name the columns in a header, as "
                f"`x,y,intensity`"
            )
        if self._columns is not None and self._columns.left_out:
            names = ", ".join(repr(name[:20]) for name in self._columns.left_out[:5])
            report.remark(f"columns beside x, y and scan are left out: {names}")
        if self._far:
            line, x, y = self._first_far
            report.remark(
                f"{self._far} of {self._read} points lie beyond 100 km, the first in line "
                f"{line}: ({x:g}, {y:g})"
            )


def _split(line: str) -> list[str]:
    text = line.partition("#")[0].strip()
    return [field.strip() for field in text.split(",")] if "," in text else text.split()


def _columns(fields: Sequence[str]) -> Columns | None:
    """The columns that a header or a good row announces; None for any other row."""
    names = [field.strip("\"' ").lower() for field in fields]
    if names.count("x") == names.count("y") == 1 and names.count("scan") <= 1:
        return Columns(
            count=len(names),
            x=names.index("x"),
            y=names.index("y"),
            scan=names.index("scan") if "scan" in names else None,
            named=True,
            left_out=tuple(name for name in names if name not in {"x", "y", "scan"}),
        )
    try:
        _parse_row(fields, None)
    except DamagedLine:
        return None
    return PLAIN if len(fields) == PLAIN.count else NUMBERED


def _parse_row(fields: Sequence[str], columns: Columns | None) -> Row:
    if columns is None:
        if len(fields) not in {PLAIN.count, NUMBERED.count}:
            raise DamagedLine(f"{len(fields)} fields, expected 2 (x,y) or 3 (scan,x,y)")
        columns = PLAIN if len(fields) == PLAIN.count else NUMBERED
    if len(fields) != columns.count:
        raise DamagedLine(f"{len(fields)} fields, expected {columns.count}")
    scan = None if columns.scan is None else finite(fields[columns.scan], "the scan number")
    return scan, finite(fields[columns.x], "x"), finite(fields[columns.y], "y")
