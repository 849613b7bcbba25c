"""Files of numpy: ``.npy`` with ranges (K, B), one scan a row, or ``.npz`` with names.

In an ``.npz`` the array ``ranges`` may stand beside ``angles`` (B,) [rad] and a clock (K,), named
as in a table: ``stamp``, ``stamp_ms``.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from labkit.logs.columns import parse_title
from labkit.logs.lines import shorten
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
    except LabkitError as error:
        raise LogError(f"{report.file}: {error}") from None
    rows = zip(ranges, stamps.tolist(), strict=True)
    reading.sweeps = source.part(source.progress(_sweeps(rows, angles, source)))
    return reading


def _sweeps(
    rows: Iterable[tuple[FloatArray, float]], angles: FloatArray, source: Source
) -> Iterator[Sweep]:
    for number, (ranges, stamp) in enumerate(rows, 1):
        try:
            yield Sweep(number, source.scanner.scan(ranges, angles, source.report, stamp=stamp))
        except LabkitError as damage:
            source.report.skip(number, damage)


def _take_apart(
    arrays: Mapping[str, Any], reading: Reading, source: Source
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ranges (K, B) [m], angles (B,) [rad] and stamps (K,) by the names of the arrays."""
    scanner = source.scanner
    named = {name: parse_title(name) for name in arrays}
    if len(arrays) == 1:
        named = {name: parse_title("ranges") for name in arrays}
    by_meaning = {column.meaning: name for name, column in named.items() if column.meaning}
    if "range" not in by_meaning:
        raise LogError(f"no array `ranges` among {', '.join(arrays)}")
    name = by_meaning["range"]
    ranges = as_floats(arrays[name], name, "ranges go one scan a row", ("K", "B"))
    if ranges.shape[1] < FEWEST_BEAMS:
        raise LogError(
            f"`{name}` has shape {ranges.shape}, expected ranges, one scan of at least "
            f"{FEWEST_BEAMS} beams a row; points go through `Scan.from_points`"
        )
    ranges = ranges * scanner.metres(named[name].scale)
    count = ranges.shape[1]
    if "angle" in by_meaning and scanner.angles is None:
        name = by_meaning["angle"]
        angles = as_finite(as_floats(arrays[name], name, "one per beam", (count,)), name)
        angles = angles * scanner.radians(named[name].scale) * (-1.0 if scanner.mirrored else 1.0)
        check_angles(angles, name)
    elif scanner.angles is not None:
        angles = scanner.beams(count, 0.0, 0.0, source.report)
    else:
        raise LogError(
            f"{len(ranges)} rows of {count} numbers; name the first and the last beam's direction "
            f"[rad], as `angles=(-2.356, 2.356)`, for `labkit odometry` as "
            f"`--angles -2.356 2.356`, or in an array `angles`"
        )
    stamps = np.full(len(ranges), math.nan)
    if "clock" in by_meaning:
        name = by_meaning["clock"]
        reading.clock_is_named = bool(named[name].unit)
        stamps = as_floats(arrays[name], name, "one per scan", (len(ranges),)) * named[name].scale
    return ranges, angles, stamps


READER = Reader(
    name="ranges",
    files="arrays of numpy, one scan a row",
    recognises=_is_array_file,
    uses=("angles", "no_return", "time_increment", "angle_unit", "blind_beams"),
    read=read,
)
