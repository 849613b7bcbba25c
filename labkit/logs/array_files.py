"""Files of numpy: ``.npy`` with ranges (K, B), one scan a row, or ``.npz`` with names.

In an ``.npz`` the array ``ranges`` may stand beside ``angles`` (B,) [rad], a clock (K,) and the
fields of ROS's ``LaserScan``, named as in a table: ``stamp``, ``stamp_ms``, ``angle_min``.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from labkit.logs.columns import DECLARED, IN_ONE_WORD, Column, parse_title
from labkit.logs.lines import shorten
from labkit.logs.log import Content
from labkit.logs.ranges import is_known
from labkit.logs.reader import Reader, Reading, Source, Sweep
from labkit.scan import check_angles
from labkit.support.arrays import FloatArray, as_finite, as_floats
from labkit.support.errors import LabkitError, LogError

MAGIC = b"\x93NUMPY"
FEWEST_BEAMS = 4


def _is_array_file(source: Source) -> bool:
    """Recognise an ``.npy`` by its first bytes, an ``.npz`` by the names in its archive."""
    if not source.first_bytes.startswith(b"PK"):
        return source.first_bytes.startswith(MAGIC)
    try:
        names = zipfile.ZipFile(source.path).namelist()
    except (OSError, zipfile.BadZipFile):  # the reader of lines says so
        return False
    return bool(names) and all(name.endswith(".npy") for name in names)


def read(source: Source) -> Reading:
    """Read a sweep of each row of ranges; a line is the number of the row, from 1."""
    report = source.report
    try:
        loaded: Any = np.load(source.path, allow_pickle=False)
        arrays = dict(loaded) if isinstance(loaded, Mapping) else {"ranges": loaded}
    except Exception as error:  # of damaged archives, and of arrays of objects
        raise LogError(f"{report.file}: cannot be read: {shorten(str(error))}") from None
    reading = Reading()
    try:
        ranges, angles, stamps = _take_apart(arrays, reading, source)
        declared = Arrays(arrays, {name: parse_title(name) for name in arrays}).declared()
    except LabkitError as error:
        raise LogError(f"{report.file}: {error}") from None
    rows = zip(ranges, stamps.tolist(), strict=True)
    reading.sweeps = source.sweeps(source.progress(_sweeps(rows, angles, declared, source)))
    return reading


def _sweeps(
    rows: Iterable[tuple[FloatArray, float]],
    angles: FloatArray,
    declared: Mapping[str, float],
    source: Source,
) -> Iterator[Sweep]:
    band = declared.get("range_min", 0.0), declared.get("range_max", math.inf)
    beam_time = declared.get("time_increment", 0.0)
    for number, (ranges, stamp) in enumerate(rows, 1):
        try:
            scan = source.scanner.scan(
                ranges, angles, source.report, stamp=stamp, band=band, time_increment=beam_time
            )
            yield Sweep(number, scan)
        except LabkitError as damage:
            source.report.skip(number, damage)


class Arrays(NamedTuple):
    """The arrays of a file, and their names as titles of columns."""

    arrays: Mapping[str, Any]
    columns: Mapping[str, Column]

    def name_of(self, meaning: str) -> str | None:
        """The array that holds ranges, angles or a clock."""
        names = (name for name, column in self.columns.items() if column.meaning == meaning)
        return next(names, None)

    def declared(self) -> dict[str, float]:
        """The fields of a LaserScan [m, rad, s]."""
        fields = dict[str, float]()
        for name, column in self.columns.items():
            field = IN_ONE_WORD.get(column.name, column.name)
            if field in DECLARED:
                values = as_floats(self.arrays[name], name, "one number").ravel()
                fields[field] = float(values[0]) * column.scale
        return fields

    def contents(self) -> list[Content]:
        """The arrays, each with the use that is made of it."""
        return [
            Content(name, f"array {np.shape(self.arrays[name])}", self._use(column))
            for name, column in self.columns.items()
        ]

    def _use(self, column: Column) -> str:
        return "read" if is_known(column) or column.meaning == "angle" else column.harmless


def _take_apart(
    arrays: Mapping[str, Any], reading: Reading, source: Source
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ranges (K, B) [m], angles (B,) [rad] and stamps (K,) by the names of the arrays."""
    title = "ranges" if len(arrays) == 1 else ""
    found = Arrays(arrays, {name: parse_title(title or name) for name in arrays})
    name = found.name_of("range")
    if name is None:
        raise LogError(f"no array `ranges` among {', '.join(arrays)}")
    ranges = as_floats(arrays[name], name, "ranges go one scan a row", ("K", "B"))
    if ranges.shape[1] < FEWEST_BEAMS:
        raise LogError(
            f"`{name}` has shape {ranges.shape}, expected ranges, one scan of at least "
            f"{FEWEST_BEAMS} beams a row; points go through `Scan.from_points`"
        )
    ranges = ranges * source.scanner.metres(found.columns[name].scale)
    stamps = np.full(len(ranges), math.nan)
    clock = found.name_of("clock")
    if clock is not None:
        column = found.columns[clock]
        reading.clock_is_named = bool(column.unit)
        stamps = as_floats(arrays[clock], clock, "one per scan", (len(ranges),)) * column.scale
    reading.contents = found.contents()
    return ranges, _angles(found, ranges.shape, source), stamps


def _angles(found: Arrays, shape: tuple[int, ...], source: Source) -> FloatArray:
    """Directions of the beams [rad] by the caller, an array, or the fields of a LaserScan."""
    scanner, count, declared = source.scanner, shape[1], found.declared()
    unit = scanner.radians()
    first, last = declared.get("angle_min", math.nan), declared.get("angle_max", math.nan)
    step = declared.get("angle_increment", math.nan)
    is_told = math.isfinite(first) and (math.isfinite(step) or math.isfinite(last))
    if scanner.angles is not None or is_told:
        return scanner.beams(count, unit * first, unit * step, source.report, unit * last)
    name = found.name_of("angle")
    if name is None:
        raise LogError(
            f"{shape[0]} rows of {count} numbers; name the first and the last beam's direction "
            f"[rad], as `angles=(-2.356, 2.356)`, for `labkit odometry` as "
            f"`--angles -2.356 2.356`, or in an array `angles`"
        )
    angles = as_finite(as_floats(found.arrays[name], name, "one per beam", (count,)), name)
    angles = angles * scanner.radians(found.columns[name].scale)
    check_angles(angles, name)
    return -angles if scanner.mirrored else angles


READER = Reader(
    name="ranges",
    files="arrays of numpy, one scan a row",
    recognises=_is_array_file,
    uses=("angles", "no_return", "time_increment", "angle_unit", "blind_beams"),
    read=read,
)
