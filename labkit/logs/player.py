"""Logs of Player's driver ``writelog``: each line has a time, the device, and its message.

::

    time host robot laser index 001 001 id first last step longest n r1 intensity1 … rn intensityn

    time host robot laser index 004 001 x y theta length width           (its place on the robot)

    time host robot position2d index 001 001 x y theta vx vy vtheta stall

Player's newer scanners write lines ``ranger``, which hold no directions: they are not read.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from labkit.logs.carmen import Pose, RobotPose
from labkit.logs.lines import expect_fields, parse_count, parse_finite, parse_numbers, parse_pose
from labkit.logs.log import Content
from labkit.logs.ranges import READER as RANGES
from labkit.logs.reader import Reader, Reading, Source, Sweep

HEAD = 7  # fields of a line in front of its message
SCAN, PLACE, WHEELS = "laser 001 001", "laser 004 001", "position2d 001 001"
USE = {"laser": "scans", "position2d": "wheels"}
FIELDS = ("angle_min", "angle_max", "angle_increment", "range_max")


def read(source: Source) -> Reading:
    """Read the scans of the log's scanners, and the wheels between them."""
    track = list[RobotPose]()
    places = dict[str, Pose]()
    interfaces = Counter[str]()

    def parse(number: int, text: str) -> Sweep | None:
        fields = text.split()
        if text.startswith("#") or len(fields) < HEAD:
            return None
        interfaces[fields[3]] += 1
        kind = f"{fields[3]} {fields[5]} {fields[6]}"
        if kind == WHEELS:
            track.append(_parse_wheels(fields))
        if kind == PLACE:
            places[_frame(fields)] = parse_pose(fields[HEAD : HEAD + 3], "the scanner")
        return _parse_scan(number, fields, source) if kind == SCAN else None

    sweeps = source.sweeps(source.parse(parse, source.lines()))
    contents = [
        Content(name, f"{count} lines", USE.get(name, "")) for name, count in interfaces.items()
    ]
    place = places.get(sweeps[0].frame) if sweeps else None
    return Reading(
        sweeps=sweeps,
        offset=None if place is None else np.array(place),
        track=np.array(track) if track else None,
        clock_is_named=True,
        contents=contents,
    )


def _parse_scan(number: int, fields: list[str], source: Source) -> Sweep:
    n = parse_count(fields, HEAD + 5, "beams", at_least=1)
    expect_fields(fields, HEAD + 6 + 2 * n, f"laser with {n} beams")
    values = map(parse_finite, fields[HEAD + 1 : HEAD + 5], FIELDS)
    declared = {name: (value, 1.0) for name, value in zip(FIELDS, values, strict=True)}
    ranges = parse_numbers(fields[HEAD + 6 :: 2], "range")
    scan = source.scanner.sweep(ranges, declared, stamp=parse_finite(fields[0], "the time"))
    return Sweep(number, scan, _frame(fields))


def _frame(fields: list[str]) -> str:
    """Name of a line's scanner, as `frame` chooses it."""
    return f"laser:{fields[4]}"


def _parse_wheels(fields: list[str]) -> RobotPose:
    expect_fields(fields, HEAD + 7, "position2d")
    pose = parse_pose(fields[HEAD : HEAD + 3], "the robot")
    return parse_finite(fields[0], "the time"), *pose


def _is_player(source: Source) -> bool:
    return source.first_line.startswith("## Player version")


READER = Reader(
    name="player",
    files="logs of Player's `writelog`",
    recognises=_is_player,
    uses=(*RANGES.uses, "laser_offset"),
    read=read,
)
