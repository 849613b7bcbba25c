"""Raw CARMEN logs: laser lines without poses, and the wheels in lines of their own.

::

    RAWLASER1 type start fov res maxrange accuracy remission_mode n r1 … rn m rem1 … remm
              timestamp host logger_timestamp

    ODOM x y theta tv rv accel timestamp host logger_timestamp
"""

from __future__ import annotations

import numpy as np

from labkit.logs.carmen import USES, RobotPose, parse_beams, parse_odom, read_wheels
from labkit.logs.log import Content
from labkit.logs.reader import Reader, Reading, Source, Sweep

WITH_POSES = frozenset({"FLASER", "ROBOTLASER1", "VERTEX_SE2"})


def read(source: Source) -> Reading:
    """Read the laser lines, and the wheels between them."""
    track = list[RobotPose]()

    def parse(number: int, text: str) -> Sweep | None:
        fields = text.split()
        if fields[:1] == ["ODOM"]:
            track.append(parse_odom(fields))
        return parse_beams(number, fields, 3, source)[0] if fields[:1] == ["RAWLASER1"] else None

    sweeps = source.part(source.parse(parse, source.lines()))
    contents = [
        Content("RAWLASER1", f"{len(sweeps)} lines", "scans"),
        Content("ODOM", f"{len(track)} lines", "wheels"),
    ]
    return Reading(sweeps=sweeps, track=np.array(track) if track else None, contents=contents)


def _is_raw(source: Source) -> bool:
    return "RAWLASER1" in source.words and not source.words & WITH_POSES


READER = Reader(
    name="carmen_raw",
    files="raw CARMEN text (RAWLASER1 with ODOM)",
    recognises=_is_raw,
    uses=USES,
    read=read,
    read_wheels=read_wheels,
)
