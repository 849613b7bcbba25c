"""Reading surveyed relations from a file, in either of two forms.

The SLAM benchmark's own form, one relation per line, fields apart by blanks::

    t1 t2 x y z roll pitch yaw

with two times in seconds, and a table of scan indices, fields apart by commas, with or
without its header::

    i,j,dx,dy,dtheta

In both, what follows a `#` is a comment, lengths are metres and angles radians.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from labkit.arrays import FARTHEST
from labkit.errors import LogError
from labkit.evaluation.relations import Relations

HEADER = ["i", "j", "dx", "dy", "dtheta"]
LAST_INDEX = 999_999_999  # no log has more scans; a number beyond it is a damaged one
OUT_OF_PLANE = 1e-3  # m or rad; more of it is a relation in space, not in the plane


def read_relations(path: str | Path) -> Relations:
    """Read a file of relations; its first line with content tells which form it has.

    Parameters
    ----------
    path : str or Path
        A text file.

    Returns
    -------
    Relations
        In the order of the file.

    Raises
    ------
    LogError
        For a file that cannot be read or holds no relation, and for a damaged line, as
        "FILE:LINE: what is wrong".
    """
    lines = _content(path)
    if lines and _fields(lines[0][1], ",") == HEADER:
        lines = lines[1:]
    if not lines:
        raise LogError(f"{path}: holds no relations")
    if "," in lines[0][1]:
        rows = [_indexed(text, f"{path}:{number}") for number, text in lines]
    else:
        rows = [_timed(text, f"{path}:{number}") for number, text in lines]
    table = np.array(rows)
    return Relations(ends=table[:, :2], by_stamp="," not in lines[0][1], increments=table[:, 2:])


def _content(path: str | Path) -> list[tuple[int, str]]:
    """The lines that say something, each with its number."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from error
    bare = ((number, line.split("#")[0].strip()) for number, line in enumerate(text.split("\n"), 1))
    return [(number, line) for number, line in bare if line]


def _indexed(text: str, place: str) -> list[float]:
    """One line of the table: i, j, dx, dy, dtheta."""
    row = _numbers(_fields(text, ","), len(HEADER), place)
    if any(not 0.0 <= end <= LAST_INDEX or end != int(end) for end in row[:2]):
        raise LogError(
            f"{place}: scan indices must be whole numbers from 0 to {LAST_INDEX}, got {text!r}"
        )
    return _near(row, text, place)


def _timed(text: str, place: str) -> list[float]:
    """One line of the benchmark: t1 t2 x y z roll pitch yaw, without what leaves the plane."""
    t1, t2, x, y, z, roll, pitch, yaw = _numbers(_fields(text), 8, place)
    if max(abs(z), abs(roll), abs(pitch)) > OUT_OF_PLANE:
        raise LogError(f"{place}: z, roll and pitch must be 0 in the plane, got {text!r}")
    return _near([t1, t2, x, y, yaw], text, place)


def _near(row: list[float], text: str, place: str) -> list[float]:
    if max(map(abs, row[2:])) > FARTHEST:
        raise LogError(f"{place}: relations must lie within {FARTHEST:g} m and rad, got {text!r}")
    return row


def _fields(text: str, separator: str | None = None) -> list[str]:
    return [field.strip() for field in text.split(separator)]


def _numbers(fields: list[str], expected: int, place: str) -> list[float]:
    if len(fields) != expected:
        raise LogError(f"{place}: expected {expected} fields, got {len(fields)}: {fields}")
    try:
        row = [float(field) for field in fields]
    except ValueError as error:
        raise LogError(f"{place}: {error}") from None
    if not all(math.isfinite(value) for value in row):
        raise LogError(f"{place}: numbers must be finite, got {fields}")
    return row
