"""What RPLIDAR's `ultra_simple` prints: a line a beam, clockwise, in degrees and millimetres.

::

    S  theta: 359.98 Dist: 01234.50 Q: 47     (S: a turn begins here)
       theta: 0.72 Dist: 00000.00 Q: 0
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from labkit.logs.columns import parse_title
from labkit.logs.points import read_rows
from labkit.logs.reader import Reader, Reading, Source

BEAM = re.compile(r"\s*S?\s*theta:\s*(\S+)\s+Dist:\s*(\S+)\s+Q:\s*\S+\s*")
COLUMNS = [*map(parse_title, ("scan", "angle_deg", "range_mm"))]


def read(source: Source) -> Reading:
    """Read the turns; the words of other lines, such as a banner's, are passed over."""
    return read_rows(_rows(source), COLUMNS, source)


def _rows(source: Source) -> Iterator[tuple[int, str]]:
    """Each beam as a row of a table, counter-clockwise."""
    turn = 0
    for number, text in source.lines():
        if "theta:" not in text:
            continue
        turn += text.lstrip().startswith("S")
        beam = BEAM.fullmatch(text)
        if beam:
            yield number, f"{turn},-{beam[1]},{beam[2]}"
        else:
            found = repr(text.strip())
            source.report.skip(number, f"{found:.60}, expected `theta: … Dist: … Q: …`")


def _is_rplidar(source: Source) -> bool:
    return any(map(BEAM.fullmatch, source.head))


READER = Reader(
    name="rplidar",
    files="what RPLIDAR's `ultra_simple` prints",
    recognises=_is_rplidar,
    uses=("no_return", "time_increment", "angle_unit", "blind_beams"),
    read=read,
)
