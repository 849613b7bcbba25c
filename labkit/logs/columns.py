"""Rows of a table as fields, and titles of columns as what they mean, with their units.

A title may carry the path of a message (``field.header.stamp``, ``/scan/ranges[0]``), the number
of a beam (``r0``, ``ranges[0]``, ``ranges_0``) and a unit (``range_mm``, ``angle [deg]``,
``stamp.nsecs``).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from labkit.logs.lines import is_number

METRES = {"m": 1.0, "metres": 1.0, "meters": 1.0, "cm": 1e-2, "mm": 1e-3}
DEGREES = dict.fromkeys(("deg", "degree", "degrees", "°"), math.radians(1.0))
RADIANS = {"rad": 1.0, "radians": 1.0, **DEGREES}
SECONDS = {
    **dict.fromkeys(("s", "sec", "secs", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "µs", "usec", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"), 1e-9),
}
UNITS = METRES | RADIANS | SECONDS
ANGLE = ("angle", "angles", "theta", "bearing", "azimuth", "alpha", "phi")
RANGE = ("range", "ranges", "distance", "distances", "dist", "r", "rho", "l")
CLOCK = ("stamp", "timestamp", "time", "rosbagtimestamp")  # the first is the scanner's own
OTHER_CLOCKS = "stamps timestamps times time_stamp time_stamps receivetime receive_time log_time"
CLOCKS = (*CLOCK, *OTHER_CLOCKS.split())
NUMBERS_OF_SCANS = [
    f"{name}{ending}"
    for name in ("scan", "sweep", "frame")
    for ending in ("", "_number", "_no", "_index", "_idx")
]
SCAN = (*NUMBERS_OF_SCANS, "scan_id", "sweep_id")  # `frame_id` is the name of an axes' frame
MEANINGS = {  # by the name: what a column holds, and the units that it may have
    "x": ("x", METRES),
    "y": ("y", METRES),
    **dict.fromkeys(ANGLE, ("angle", RADIANS)),
    **dict.fromkeys(RANGE, ("range", METRES)),
    **dict.fromkeys(CLOCKS, ("clock", SECONDS)),
    **dict.fromkeys(SCAN, ("scan", {})),
}
GEOMETRY = ("angle_min", "angle_max", "angle_increment")  # fields of ROS's LaserScan
DECLARED = (*GEOMETRY, "time_increment", "range_min", "range_max")
IN_ONE_WORD = {name.replace("_", ""): name for name in DECLARED}  # `AngleMin`, as MATLAB writes
HARMLESS = frozenset(  # change no answer
    {"", "seq", "topic", "scan_time", "intensities", "intensity", "quality", "remission", "id"}
)
XY, POLAR = ("x", "y"), ("angle", "range")
PATH = frozenset({"field", "header", "msg", "message", "data", ""})  # in front of a name
UNIT_IN_BRACKETS = re.compile(r"(.+?)[\s_]*[\[(]\s*([a-zµ°]+)\s*[\])]")
UNIT_BEHIND = re.compile(r"(.+)[\s_.]([a-zµ°]+)")
NUMBERED = re.compile(r"(.*?)[\s_.]?[\[(]?([0-9]+)[\])]?")
GROUPED = re.compile(r'"[^"]*"|\[[^\]]*\]|\([^)]*\)')  # separators inside part no fields
NUMBER = r"[-+]?(?:[0-9]+,[0-9]+(?:e[-+]?[0-9]+)?|[0-9]+|nan|inf)"  # with a comma for a point
DECIMAL_COMMAS = re.compile(rf"{NUMBER}(?:\s+{NUMBER})+", re.IGNORECASE)
QUOTED_DECIMALS = re.compile(rf'"{NUMBER}"(?:,"{NUMBER}")+', re.IGNORECASE)
INSIDE = "\x1f"  # stands for them
FEWEST_NUMBERED = 4  # a row 0, 1, 2 may be a point
BRACKETS = {"[": "]", "(": ")", "{": "}"}


class Column(NamedTuple):
    """A column of a table by its title."""

    title: str
    name: str  # without path, number and unit
    number: int | None  # of a beam
    unit: str

    @property
    def meaning(self) -> str:
        """x, y, angle, range, clock, scan, or nothing that is known."""
        meaning, units = MEANINGS.get(self.name, ("", {}))
        return meaning if self.unit in {"", *units} else ""

    @property
    def harmless(self) -> str:
        """A word for a column that changes no answer; nothing for one that might."""
        return "left aside" if self.name in HARMLESS else ""

    @property
    def scale(self) -> float:
        """Factor from the column's unit to metres, radians or seconds."""
        return UNITS.get(self.unit, 1.0)


def parse_title(title: str) -> Column:
    """Take the title of a column apart."""
    parts = title.strip("\"' %#_").lower().rpartition("/")[2].split(".")
    while len(parts) > 1 and parts[0] in PATH:
        del parts[0]
    name, unit = ".".join(parts), ""
    found = UNIT_IN_BRACKETS.fullmatch(name) or UNIT_BEHIND.fullmatch(name)
    if found and found[2] in UNITS:
        name, unit = found[1], found[2]
    if name in SECONDS and len(name) > 2:  # secs, nsecs: a stamp in two columns
        name, unit = CLOCK[0], name
    if numbered := NUMBERED.fullmatch(name):
        name, number = numbered[1], int(numbered[2])
        found = UNIT_BEHIND.fullmatch(name)
        if found and found[2] in METRES:  # `range_mm_0`, `ranges_mm[0]`
            name, unit = found[1], found[2]
        return Column(title, name, number, unit)
    return Column(title, name, None, unit)


def split_row(line: str) -> list[str]:
    """The fields of a row; none in a blank line or a comment.

    They stand between semicolons, commas or white space; a comma may be the decimal point where
    it does not separate. What is in quotes or brackets is one field; a row that is one list is its
    numbers.
    """
    text = line.partition("#")[0].strip()
    if text.endswith(("],", "),")):  # of a list of lists
        text = text[:-1]
    if is_list(text):
        return list_fields(text)
    is_grouped = '"' in text or "[" in text or "(" in text
    outside = GROUPED.sub("", text) if is_grouped else text
    separator = ";" if ";" in outside else ","
    if separator not in outside:
        return text.split()
    if not is_grouped:
        if separator == "," and DECIMAL_COMMAS.fullmatch(text):
            return text.replace(",", ".").split()
        fields = [field.strip() for field in text.split(separator)]
    else:
        masked = GROUPED.sub(lambda group: group[0].replace(separator, INSIDE), text)
        split = (field.replace(INSIDE, separator) for field in masked.split(separator))
        fields = [field.strip(" \t\"'") for field in split]
    if separator == ";" or (is_grouped and QUOTED_DECIMALS.fullmatch(text)):
        return [field if " " in field else field.replace(",", ".") for field in fields]
    return fields


def is_list(field: str) -> bool:
    """Recognise several fields in one pair of brackets."""
    is_bracketed = len(field) > 1 and BRACKETS.get(field[0]) == field[-1]
    return is_bracketed and len(list_fields(field)) > 1


def list_fields(field: str) -> list[str]:
    """The fields of a list between commas, semicolons or white space, in brackets or bare."""
    return re.split(r"[\s,;]+", field.strip(" \t,;[](){}"))


def read_header(head: Sequence[str]) -> tuple[list[Column], int]:
    """Columns by the titles in a table's first row, and the number of lines before its rows.

    Titles may stand in a comment right above the first row, as numpy writes them. No columns
    where there are no titles.
    """
    for k, line in enumerate(head):
        row = split_row(line)
        if not row or line.startswith("sep="):  # Excel's word on its separator
            continue
        if are_titles(row):
            return list(map(parse_title, row)), k + 1
        titles = split_row(head[k - 1].strip().removeprefix("#")) if k else []
        columns = list(map(parse_title, titles)) if len(titles) == len(row) else []
        are_known = all(column.meaning or column.number is not None for column in columns)
        meanings = {column.meaning for column in columns}
        is_table_of_points = any(meanings.issuperset(pair) for pair in (XY, POLAR))
        return columns if columns and (are_known or is_table_of_points) else [], k
    return [], len(head)


def are_titles(row: Sequence[str]) -> bool:
    """Recognise a row of titles: its numbers, if it has any, count columns."""
    filled = [field for field in row if field]
    numbers = [field for field in filled if is_number(field)]
    if any(map(is_list, filled)) or not filled:
        return False
    first = int(numbers[0] == "1") if numbers else 0
    return numbers == [str(number) for number in range(first, first + len(numbers))] and (
        len(numbers) < len(filled) or len(numbers) >= FEWEST_NUMBERED
    )


def choose_clocks(columns: Sequence[Column]) -> list[tuple[int, float]]:
    """Columns of the clock and their units [s], which add up.

    The scanner's own clock goes before others; seconds and nanoseconds make one stamp.
    """
    clocks = [column for column in columns if column.meaning == "clock" and column.number is None]
    own = sorted(clocks, key=lambda column: CLOCKS.index(column.name))
    chosen = own[:1]
    if chosen and chosen[0].unit:
        rest = (c for c in own[1:] if c.name == chosen[0].name and c.scale != chosen[0].scale)
        chosen += [c for c in rest if {c.scale, chosen[0].scale} == {1.0, SECONDS["ns"]}][:1]
    return [(columns.index(column), column.scale) for column in chosen]
