"""Lines that RPLIDAR's `ultra_simple` prints: a beam each, clockwise, in degrees and millimetres.

::

    S  theta: 359.98 Dist: 01234.50 Q: 47     (S: a turn begins here)
       theta: 0.72 Dist: 00000.00 Q: 0
"""

from __future__ import annotations

import re

from labkit.logs.columns import parse_title
from labkit.logs.lines import DamagedLine
from labkit.logs.points import read_rows
from labkit.logs.reader import Reader, Reading, Source

BEAM = re.compile(r"\s*S?\s*theta:\s*(\S+)\s+Dist:\s*(\S+)\s+Q:\s*\S+\s*")
COLUMNS = [*map(parse_title, ("scan", "angle_deg", "range_mm"))]


def read(source: Source) -> Reading:
    """Read the turns; the words of other lines, such as a banner's, are passed over."""
    turn = 0

    def parse(number: int, text: str) -> tuple[int, str] | None:
        """A beam as a row of a table, counter-clockwise."""
        nonlocal turn
        if "theta:" not in text:
            return None
        turn += text.lstrip().startswith("S")
        beam = BEAM.fullmatch(text)
        if beam is None:
            raise DamagedLine(f"{text.strip()!r:.60}, expected `theta: … Dist: … Q: …`")
        return number, f"{turn},-{beam[1]},{beam[2]}"

    return read_rows(source.parse(parse, source.lines()), COLUMNS, source)


def _is_rplidar(source: Source) -> bool:
    return any(map(BEAM.fullmatch, source.head))


READER = Reader(
    name="rplidar",
    files="what RPLIDAR's `ultra_simple` prints",
    recognises=_is_rplidar,
    uses=("no_return", "time_increment", "angle_unit", "blind_beams"),
    read=read,
)
