"""JSON, one object a line with the ranges of a scan, as bridges of ROS and web tools write it.

The names are those of a table's titles: ``ranges``, ``stamp``, ``angle_min`` and the other fields
of ROS's ``LaserScan``, at any depth.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from labkit.logs.columns import parse_title
from labkit.logs.lines import DamagedLine
from labkit.logs.log import Content
from labkit.logs.ranges import READER as RANGES
from labkit.logs.ranges import expect_directions, is_known, layout_of, parse_sweep
from labkit.logs.reader import Reader, Reading, Source, Sweep

Fields = dict[str, str]


def read(source: Source) -> Reading:
    """Read a sweep of each line; an object lends its names to those below it."""
    names = _fields(json.loads(source.first_line))
    columns = [parse_title(name) for name in names]
    known = [column for column in columns if is_known(column)]
    layout = layout_of(known, source.report.file)
    expect_directions(layout, [names[column.title] for column in known], source)
    titles = [column.title for column in known]

    def parse(number: int, text: str) -> Sweep | None:
        if not text.strip():
            return None
        try:
            fields = _fields(json.loads(text))
        except (ValueError, RecursionError) as error:
            raise DamagedLine(f"no JSON: {error}") from None
        row = [fields.get(title, "") for title in titles]
        return parse_sweep(number, row, layout=layout, scanner=source.scanner)

    sweeps = source.sweeps(source.parse(parse, source.lines()))
    contents = [
        Content(column.title, "field", "read" if column in known else column.harmless)
        for column in columns
    ]
    is_named = any(known[k].unit for k, _ in layout.clocks)
    return Reading(sweeps=sweeps, clock_is_named=is_named, contents=contents)


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
