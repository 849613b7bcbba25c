"""JSON, one object a line with the ranges of a scan, as bridges of ROS and web tools write it.

The names are those of a table's titles: ``ranges``, ``stamp``, ``angle_min`` and the other fields
of ROS's ``LaserScan``, at any depth.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from labkit.logs.columns import parse_title
from labkit.logs.log import Content
from labkit.logs.ranges import READER as RANGES
from labkit.logs.ranges import expect_directions, is_known, layout_of, sweeps_of_rows
from labkit.logs.reader import Reader, Reading, Source

Fields = dict[str, str]


def read(source: Source) -> Reading:
    """Read a sweep of each line; an object lends its names to those below it."""
    names = _fields(json.loads(source.first_line))
    columns = [parse_title(name) for name in names]
    known = [column for column in columns if is_known(column)]
    layout = layout_of(known, source.report.file)
    expect_directions(layout, [names[column.title] for column in known], source)
    rows = _rows([column.title for column in known], source)
    sweeps = source.sweeps(sweeps_of_rows(rows, layout, source))
    contents = [
        Content(column.title, "field", "read" if column in known else column.harmless)
        for column in columns
    ]
    is_named = any(known[k].unit for k, _ in layout.clocks)
    return Reading(sweeps=sweeps, clock_is_named=is_named, contents=contents)


def _rows(names: Sequence[str], source: Source) -> Iterator[tuple[int, list[str]]]:
    """Each line as a row of a table."""
    for number, text in source.lines():
        try:
            fields = _fields(json.loads(text)) if text.strip() else None
        except (ValueError, RecursionError) as error:
            source.report.skip(number, f"no JSON: {error}")
        else:
            if fields is not None:
                yield number, [fields.get(name, "") for name in names]


def _fields(value: Any, path: str = "") -> Fields:
    """The fields of an object by their names, ``header.stamp``; a list of numbers is one field."""
    if isinstance(value, Mapping):
        found = Fields()
        for name, part in value.items():
            found |= _fields(part, f"{path}.{name}" if path else str(name))
        return found
    if isinstance(value, list):
        value = f"[{', '.join('nan' if part is None else str(part) for part in value)}]"
    return {path: "nan" if value is None else str(value)}


def _is_json(source: Source) -> bool:
    """Recognise an object in the first line that holds ranges."""
    if not source.first_line.startswith("{"):
        return False
    try:
        names = _fields(json.loads(source.first_line))
    except (ValueError, RecursionError):
        return False
    return any(parse_title(name).meaning == "range" for name in names)


READER = Reader(
    name="json",
    files="JSON, an object with `ranges` a line",
    recognises=_is_json,
    uses=RANGES.uses,
    read=read,
)
