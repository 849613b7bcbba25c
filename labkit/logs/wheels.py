"""The wheels of a robot from a file beside its log: a table of poses in any of its spellings.

Titles name clock, x, y and a heading or a quaternion, as ``stamp,x,y,theta`` or as
``rostopic echo -p /odom`` prints them. Without titles, eight columns are TUM's, seven the same
without a clock, four are time, x, y and θ, and three are x, y and θ.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np

from labkit.logs.clocks import parse_stamp, settle_clock
from labkit.logs.columns import RADIANS, Column, choose_clocks, parse_title, split_row
from labkit.logs.lines import (
    DamagedLine,
    expect_fields,
    expect_near,
    parse_finite,
    planar_heading,
)
from labkit.logs.reader import Source
from labkit.support.arrays import FloatArray
from labkit.support.errors import LogError

UNTITLED = {
    8: "stamp,x,y,z,qx,qy,qz,qw",
    7: "x,y,z,qx,qy,qz,qw",
    4: "stamp,x,y,theta",
    3: "x,y,theta",
}
X, Y = ("x", "tx", "px"), ("y", "ty", "py")
HEADING = ("theta", "yaw", "heading", "psi", "phi", "th", "angle")
QUATERNION = ("qx", "qy", "qz", "qw")
ROTATIONS = frozenset({"orientation", "rotation", "quaternion", "quat", "q"})
NO_POSES = frozenset({"twist", "linear", "angular", "covariance", "vel", "velocity"})


def read_table(source: Source, columns: Sequence[Column] = ()) -> FloatArray:
    """Rows (t [s], x [m], y [m], θ [rad]) of a table of poses; t is NaN without a clock."""
    track, is_named = read_poses(source, columns)
    if not np.isnan(track[:, 0]).any():
        report = source.report
        track[:, 0] = settle_clock(track[:, 0], report.file, report, is_named=is_named)
    return track


def read_poses(source: Source, columns: Sequence[Column] = ()) -> tuple[FloatArray, bool]:
    """The rows as they stand, by the columns or else their titles, and whether these name a unit.

    A table with a damaged line is refused as a whole, since a gap in it would go unseen.
    """
    file, table = source.report.file, source.table
    columns = columns or table.columns
    rows = list[tuple[float, float, float, float]]()
    places: Mapping[str, int] = {}
    for number, text in source.lines(table.begin):
        row = split_row(text)
        if not row:
            continue
        if not places:
            columns = columns or _usual_columns(row, file)
            places = _places(columns, file)
            clocks = choose_clocks(columns)
        try:
            expect_fields(row, len(columns), f"`{','.join(each.title for each in columns[:9])}`")
            stamps = [parse_stamp(row[k], unit) for k, unit in clocks]
            rows.append((sum(stamps) if stamps else math.nan, *_pose(row, places, columns)))
        except DamagedLine as damage:
            raise LogError(f"{file}:{number}: {damage}") from None
    if not rows:
        raise LogError(f"{file}: a trajectory without any pose")
    return np.array(rows), any(columns[k].unit for k, _ in clocks)


def _usual_columns(row: Sequence[str], file: str) -> list[Column]:
    if len(row) not in UNTITLED:
        raise LogError(
            f"{file}: {len(row)} columns without titles; poses have "
            f"{', '.join(f'{count} (`{titles}`)' for count, titles in UNTITLED.items())}, or "
            f"titles that say what they hold"
        )
    return titled(UNTITLED[len(row)])


def titled(titles: str) -> list[Column]:
    """Columns by their titles between commas."""
    return [*map(parse_title, titles.split(","))]


def _meaning(column: Column) -> str:
    """x, y, theta, or a part of a quaternion, or nothing that is known."""
    *path, last = re.split(r"[._\s]+", column.name)
    if column.number is not None or NO_POSES.intersection(path) or column.meaning == "clock":
        return ""
    if ROTATIONS.intersection(path) or last in QUATERNION:
        return f"q{last[-1]}"
    if last in X:
        return "x"
    if last in Y:
        return "y"
    return "theta" if last in HEADING else ""


def _places(columns: Sequence[Column], file: str) -> dict[str, int]:
    """The column of each part of a pose; `LogError` where they tell no pose."""
    places = dict[str, int]()
    for k, column in enumerate(columns):
        meaning = _meaning(column)
        if meaning:
            places.setdefault(meaning, k)
    turns = {"qz", "qw"} <= places.keys() or "theta" in places
    if not ({"x", "y"} <= places.keys() and turns):
        titles = ", ".join(column.title for column in columns[:12])
        raise LogError(
            f"{file}: the columns are {titles}; poses need `x`, `y` and `theta`, or a quaternion "
            f"(`qz`, `qw`), beside a clock (`stamp`)"
        )
    return places


def _pose(
    row: Sequence[str], places: Mapping[str, int], columns: Sequence[Column]
) -> tuple[float, float, float]:
    value = {name: parse_finite(row[k], columns[k].title) for name, k in places.items()}
    scale = {name: columns[k].scale for name, k in places.items()}
    x, y = scale["x"] * value["x"], scale["y"] * value["y"]
    expect_near(x, y, "the position")
    if "qw" in value:
        return x, y, planar_heading(*(value.get(name, 0.0) for name in QUATERNION))
    unit = RADIANS.get(columns[places["theta"]].unit, 1.0)
    return x, y, unit * value["theta"]
