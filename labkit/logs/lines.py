"""Lines of a text file, plain, in gzip or in zip; their fields; and the damage found in them."""

from __future__ import annotations

import gzip
import math
import os
import zipfile
from collections.abc import Sequence

from labkit.logs.log import SkippedLine
from labkit.support.arrays import FARTHEST, check_kind
from labkit.support.errors import LabkitError, LogError

MAX_BYTES = 512 << 20  # of a file, unpacked: a small packed one must not fill the memory
MAX_REASON = 180  # characters: with the file's name it stays a message that a terminal shows


class DamagedLine(LabkitError):
    """The defect of one line: what was found, and what its format asks for."""


class DamageReport:
    """Damage and oddities of one file; under `strict` the first damage raises `LogError`."""

    def __init__(self, file: str | os.PathLike[str], *, strict: bool) -> None:
        check_kind(file, "path", str, os.PathLike)
        self.file = os.fspath(file)
        self.strict = strict
        self.skipped: list[SkippedLine] = []
        self.remarks: list[str] = []

    def skip(self, line: int, reason: object) -> None:
        """Leave out a line for a reason, or raise `LogError` ``FILE:LINE: reason``."""
        skipped = SkippedLine(file=self.file, line=line, reason=shorten(str(reason)))
        if self.strict:
            raise LogError(str(skipped))
        self.skipped.append(skipped)

    def summary(self) -> str:
        """Tail of the message about a file without any good line."""
        if not self.skipped:
            return ""
        first = self.skipped[0]
        return f"; {len(self.skipped)} damaged, the first is {first.line}: {first.reason}"


def shorten(text: str, longest: int = MAX_REASON) -> str:
    """Put a text on one line, and cut its end if it is too long for a message."""
    line = " ".join(text.split())
    return line if len(line) <= longest else line[: longest - 3] + "..."


def read_lines(report: DamageReport) -> list[tuple[int, str]]:
    """Read the lines of the report's file with their numbers from 1; `LogError` if there are none.

    gzip and zip are recognised by their first bytes, never by the suffix. Bytes that are not UTF-8
    become U+FFFD and harm their line only.
    """
    data = _unpacked(report.file)
    if len(data) > MAX_BYTES:
        raise LogError(f"{report.file}: more than {MAX_BYTES:,} bytes, unpacked; cut it in pieces")
    if not data.strip():
        raise LogError(f"{report.file}: the file is empty")
    text = data.decode("utf-8", "replace").removeprefix("\ufeff")
    return [(number, line.rstrip("\r")) for number, line in enumerate(text.split("\n"), 1)]


def _unpacked(file: str) -> bytes:
    """Read at most one byte more than a file may have; all that goes wrong is a `LogError`."""
    try:
        with open(file, "rb") as raw:
            magic = raw.peek(2)[:2]
            if magic == b"PK":
                with zipfile.ZipFile(raw) as archive, archive.open(_member(archive)) as unpacked:
                    return unpacked.read(MAX_BYTES + 1)
            return (gzip.open(raw) if magic == b"\x1f\x8b" else raw).read(MAX_BYTES + 1)
    except Exception as error:  # a damaged archive raises errors of many kinds
        reason = shorten(getattr(error, "strerror", None) or str(error) or type(error).__name__)
        raise LogError(f"{file}: cannot be read: {reason}") from None


def _member(archive: zipfile.ZipFile) -> zipfile.ZipInfo:
    """The one file in the archive, beside those that a Mac adds."""
    files = [each for each in archive.infolist() if not each.is_dir()]
    members = [each for each in files if not each.filename.startswith("__MACOSX/")]
    if len(members) != 1:
        raise LogError(f"the archive holds {len(members)} files, expected one log; unpack it")
    return members[0]


def parse_numbers(fields: Sequence[str], what: str) -> list[float]:
    """Convert fields to floats, NaN and infinity included; `DamagedLine` names a bad one."""
    try:
        return [float(field) for field in fields]
    except ValueError:
        index = next(k for k, field in enumerate(fields) if not is_number(field))
    raise DamagedLine(f"{what} {index + 1} is {fields[index]!r:.30}, expected a number")


def parse_finite(field: str, what: str) -> float:
    """Convert a field to a finite float; `DamagedLine` names a bad one."""
    value = float(field) if is_number(field) else math.nan
    if not math.isfinite(value):
        raise DamagedLine(f"{what} is {field!r:.30}, expected a finite number")
    return value


def parse_pose(fields: Sequence[str], what: str) -> tuple[float, float, float]:
    """Convert three fields to a pose (x, y, θ); `DamagedLine` names a bad one."""
    names = (f"{name} of {what}" for name in ("x", "y", "theta"))
    x, y, theta = map(parse_finite, fields, names)
    expect_near(x, y, what)
    return x, y, theta


def parse_count(fields: Sequence[str], index: int, what: str, at_least: int) -> int:
    """Convert the field at `index` to a count; `DamagedLine` if there is none, or too small."""
    field = fields[index] if index < len(fields) else ""
    value = float(field) if is_number(field) else math.nan
    if not (value.is_integer() and value >= at_least):
        raise DamagedLine(
            f"the number of {what} is {field!r:.30}, expected an integer of at least {at_least}"
        )
    return int(value)


def expect_near(x: float, y: float, what: str) -> None:
    """Raise `DamagedLine` for a place beyond `FARTHEST`."""
    if not (abs(x) <= FARTHEST and abs(y) <= FARTHEST):
        raise DamagedLine(f"{what} is ({x:g}, {y:g}), expected to lie within {FARTHEST:g} m")


def expect_fields(fields: Sequence[str], expected: int, what: str) -> None:
    """Raise `DamagedLine` unless the line has the `expected` number of fields."""
    if len(fields) != expected:
        raise DamagedLine(f"{len(fields)} fields, expected {expected} for {what}")


def is_number(field: str) -> bool:
    """Recognise a number, NaN and infinity included."""
    try:
        float(field)
    except ValueError:
        return False
    return True
