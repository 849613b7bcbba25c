"""Files of numpy: ``.npy`` with ranges (K, B), one scan a row, or ``.npz`` with names.

In an ``.npz`` the array ``ranges`` may stand beside ``angles`` (B,) [rad], a clock (K,) and the
fields of ROS's ``LaserScan``, named as in a table: ``stamp``, ``stamp_ms``, ``angle_min``.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np

from labkit.logs.columns import DECLARED, IN_ONE_WORD, Column, parse_title
from labkit.logs.lines import shorten
from labkit.logs.log import Content
from labkit.logs.ranges import FEWEST_BEAMS, is_known, tells_directions
from labkit.logs.reader import Reader, Reading, Source, Sweep
from labkit.scan import check_angles
from labkit.support.arrays import FloatArray, as_finite, as_floats
from labkit.support.errors import LabkitError, LogError

MAGIC = b"\x93NUMPY"


def _is_array_file(source: Source) -> bool:
    """Recognise an ``.npy`` by its first bytes, an ``.npz`` by the names in its archive."""
    if not source.first_bytes.startswith(b"PK"):
        return source.first_bytes.startswith(MAGIC)
    try:
        names = zipfile.ZipFile(source.path).namelist()
    except (OSError, zipfile.BadZipFile):  # the reader of lines says so
        return False
    return bool(names) and all(name.endswith(".npy") for name in names)


class Arrays(NamedTuple):
    """The arrays of a file, and their names as titles of columns."""

    arrays: Mapping[str, Any]
    columns: Mapping[str, Column]

    def name_of(self, meaning: str) -> str | None:
        """The array that holds ranges, angles or a clock."""
        names = (name for name, column in self.columns.items() if column.meaning == meaning)
        return next(names, None)

    def ranges(self) -> tuple[FloatArray, float]:
        """Ranges (K, B), and their unit [m]."""
        name = self.name_of("range")
        if name is None:
            raise LogError(f"no array `ranges` among {', '.join(self.arrays)}")
        ranges = as_floats(self.arrays[name], name, "ranges go one scan a row", ("K", "B"))
        if ranges.shape[1] < FEWEST_BEAMS:
            raise LogError(
                f"`{name}` has shape {ranges.shape}, expected ranges, one scan of at least "
                f"{FEWEST_BEAMS} beams a row; points go through `Scan.from_points`"
            )
        return ranges, self.columns[name].scale

    def stamps(self, count: int) -> tuple[FloatArray, bool]:
        """Stamps (K,) [s], NaN without a clock, and whether their unit is named."""
        clock = self.name_of("clock")
        if clock is None:
            return np.full(count, math.nan), False
        column = self.columns[clock]
        stamps = as_floats(self.arrays[clock], clock, "one per scan", (count,))
        return stamps * column.scale, bool(column.unit)

    def declared(self) -> dict[str, tuple[float, float]]:
        """The fields of a LaserScan, each with its unit [m, rad, s]."""
        fields = dict[str, tuple[float, float]]()
        for name, column in self.columns.items():
            field = IN_ONE_WORD.get(column.name, column.name)
            if field in DECLARED:
                values = as_floats(self.arrays[name], name, "one number").ravel()
                fields[field] = float(values[0]), column.scale
        return fields

    def contents(self) -> list[Content]:
        """The arrays, each with the use that is made of it."""
        return [
            Content(name, f"array {np.shape(self.arrays[name])}", self._use(column))
            for name, column in self.columns.items()
        ]

    def _use(self, column: Column) -> str:
        return "read" if is_known(column) or column.meaning == "angle" else column.harmless


def read(source: Source) -> Reading:
    """Read a sweep of each row of ranges; a line is the number of the row, from 1."""
    file, scanner = source.report.file, source.scanner
    try:
        loaded: Any = np.load(source.path, allow_pickle=False)
        arrays = dict(loaded) if isinstance(loaded, Mapping) else {"ranges": loaded}
    except Exception as error:  # of damaged archives, and of arrays of objects
        raise LogError(f"{file}: cannot be read: {shorten(str(error))}") from None
    title = "ranges" if len(arrays) == 1 else ""
    found = Arrays(arrays, {name: parse_title(title or name) for name in arrays})
    try:
        ranges, scale = found.ranges()
        stamps, is_named = found.stamps(len(ranges))
        declared = found.declared()
        angles = _angles(found, ranges.shape, declared.keys(), source)
    except LabkitError as error:
        raise LogError(f"{file}: {error}") from None

    def parse(number: int, row: FloatArray) -> Sweep:
        stamp = float(stamps[number - 1])
        scan = scanner.sweep(row, declared, angles=angles, scale=scale, stamp=stamp)
        return Sweep(number, scan)

    rows = enumerate(source.progress(ranges), 1)
    sweeps = source.sweeps(source.parse(parse, rows))
    return Reading(sweeps=sweeps, clock_is_named=is_named, contents=found.contents())


def _angles(
    found: Arrays, shape: tuple[int, ...], declared: Collection[str], source: Source
) -> FloatArray | None:
    """Directions of the beams [rad] by an array; None where the caller or fields tell them."""
    if source.options.directions is not None or tells_directions(declared):
        return None
    name = found.name_of("angle")
    if name is None:
        raise LogError(
            f"{shape[0]} rows of {shape[1]} numbers; name the first and the last beam's direction "
            f"[rad], as `angles=(-2.356, 2.356)`, for `labkit odometry` as "
            f"`--angles -2.356 2.356`, or in an array `angles`"
        )
    angles = as_finite(as_floats(found.arrays[name], name, "one per beam", (shape[1],)), name)
    angles = angles * source.scanner.radians(found.columns[name].scale)
    check_angles(angles, name)
    return -angles if source.scanner.mirrored else angles


READER = Reader(
    name="ranges",
    files="arrays of numpy, one scan a row",
    recognises=_is_array_file,
    uses=("angles", "no_return", "time_increment", "angle_unit", "blind_beams"),
    read=read,
)
