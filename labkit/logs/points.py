"""Bare points as text: rows ``x,y`` of one scan, or ``scan,x,y`` of several, in metres."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import as_points
from labkit.errors import LogError
from labkit.files import atomic_write
from labkit.logs.lines import DamagedLine, DamageReport, expect_near, finite, split_lines
from labkit.logs.log import Log
from labkit.logs.unpack import load
from labkit.scan import Scan, as_scan

HEADERS = {("x", "y"): 2, ("scan", "x", "y"): 3}
"""The headers that may stand above the rows, and how many fields they announce."""

Row = tuple[str, float, float]


def is_points(lines: Sequence[str]) -> bool:
    """Whether one of the first five rows is a header or a row of 2 or 3 numbers."""
    rows = [fields for fields in map(_split, lines[:50]) if fields][:5]
    return any(_columns(fields) is not None for fields in rows)


def parse_points(lines: Sequence[str], report: DamageReport, *, name: str) -> Log:
    """Read rows of points, separated by commas or white space; see `labkit.logs.read_log`.

    The header, or without one the first good row, says whether the rows are ``x,y`` or
    ``scan,x,y``. Scans come in the order in which their number is first met; there is no
    beam order, no time and no pose. ``#`` begins a comment. A point beyond 1e9 m is damaged.
    """
    rows: list[Row] = []
    columns: int | None = None
    for number, line in enumerate(lines, start=1):
        fields = _split(line)
        if not fields:
            continue
        if columns is None:
            columns = _columns(fields)
            if tuple(map(str.lower, fields)) in HEADERS:
                continue
        try:
            row = _parse_row(fields, columns)
            expect_near(*row[1:], "the point")
            rows.append(row)
        except DamagedLine as damage:
            report.skip(number, damage)
    if not rows:
        raise LogError(
            f"{report.file}: a table without any point, expected rows `x,y` or `scan,x,y`"
            f"{report.summary()}"
        )
    return Log(scans=_group(rows), name=name, format="points", skipped=report.skipped)


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
    content = load(path)
    lines = split_lines(content.data)
    report = DamageReport(content.file, strict=True)
    if content.damage:
        report.skip(len(lines), content.damage)
    if not is_points(lines):
        raise LogError(f"{content.file}: not a table of points, expected rows `x,y` in metres")
    log = parse_points(lines, report, name=content.file)
    if len(log) != 1:
        raise LogError(
            f"{content.file}: {len(log)} scans, expected one; keep the rows of a single scan"
        )
    return log.scans[0]


def write_points(path: str | os.PathLike[str], scan: Scan | ArrayLike) -> None:
    """Write the points of one scan as rows ``x,y`` below that header.

    Numbers are written with all their digits: `read_points` gives them back bit for bit,
    but refuses a point beyond 1e9 m.

    Parameters
    ----------
    path : path-like
        The file, written whole or not at all.
    scan : Scan or array_like, shape (N, 2)
        At least one point, in metres.

    Raises
    ------
    InvalidPointsError
        If there is no point, or one that is not finite.
    WriteError
        If the file cannot be written.
    """
    points = as_points(as_scan(scan).points, "scan")
    with atomic_write(path) as file:
        file.write("x,y\n")
        for x, y in points.tolist():
            file.write(f"{x!r},{y!r}\n")


def _split(line: str) -> list[str]:
    text = line.partition("#")[0].strip()
    return [field.strip() for field in text.split(",")] if "," in text else text.split()


def _columns(fields: Sequence[str]) -> int | None:
    """How many columns a header or a good row announces; None for any other row."""
    header = HEADERS.get(tuple(map(str.lower, fields)))
    if header is not None:
        return header
    try:
        _parse_row(fields, None)
    except DamagedLine:
        return None
    return len(fields)


def _parse_row(fields: Sequence[str], columns: int | None) -> Row:
    if len(fields) not in ({2, 3} if columns is None else {columns}):
        expected = "2 (x,y) or 3 (scan,x,y)" if columns is None else str(columns)
        raise DamagedLine(f"{len(fields)} fields, expected {expected}")
    *scan, x, y = fields
    if scan:
        finite(scan[0], "the scan number")
    return "".join(scan), finite(x, "x"), finite(y, "y")


def _group(rows: Sequence[Row]) -> tuple[Scan, ...]:
    grouped: dict[str, list[tuple[float, float]]] = {}
    for scan, x, y in rows:
        grouped.setdefault(scan, []).append((x, y))
    return tuple(Scan.from_points(np.array(points)) for points in grouped.values())
