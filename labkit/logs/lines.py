"""Lines of a text file, plain or packed; their fields; and the damage found in them."""

from __future__ import annotations

import bz2
import codecs
import gzip
import io
import lzma
import math
import os
import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import cast

from labkit.logs.log import SkippedLine
from labkit.se2 import wrap
from labkit.support.arrays import MAX_DISTANCE, check_kind
from labkit.support.errors import LabkitError, LogError

MAX_BYTES = 512 << 20  # of a file, unpacked: a small packed one must not fill the memory
ZSTD = b"\x28\xb5\x2f\xfd"
TAR, TAR_PLACE, TAR_BLOCK = b"ustar", 257, 512  # its mark, where it stands, and in how many bytes
MAX_SILENT_DAMAGE = 0.1  # share of damaged lines; a larger one is remarked on
QUATERNION_TOLERANCE = 0.01  # its length differs from 1 by its printed digits: two decimals
MAX_LEAN = math.radians(30.0)  # of a robot or a scanner that is taken as level
MAX_REASON = 180  # characters: with the file's name it stays a message that a terminal shows


class DamagedLine(LabkitError):
    """The defect of one line: what was found, and what its format asks for."""


class DamageReport:
    """Damage and oddities of one file; under `strict` the first damage raises `LogError`.

    Messages call the file by `name`, if there is one.
    """

    def __init__(
        self, path: str | os.PathLike[str], *, strict: bool, name: str | None = None
    ) -> None:
        check_kind(path, "path", str, os.PathLike)
        check_kind(strict, "strict", bool)
        self.path = os.fspath(path)
        self.file = name or self.path
        self.strict = strict
        self.skipped: list[SkippedLine] = []
        self.remarks: list[str] = []
        self._oddities: Counter[str] = Counter()

    def skip(self, line: int, reason: object) -> None:
        """Leave out a line for a reason, or raise `LogError` ``FILE:LINE: reason``."""
        skipped = SkippedLine(file=self.file, line=line, reason=shorten(str(reason)))
        if self.strict:
            raise LogError(str(skipped))
        self.skipped.append(skipped)

    def count(self, oddity: str) -> None:
        """Count one more scan with an oddity, a clause whose subject are scans."""
        self._oddities[oddity] += 1

    def all_remarks(self, scan_count: int) -> tuple[str, ...]:
        """The remarks, and one for each oddity of scans and for many damaged lines."""
        counted = [f"{count} scans {oddity}" for oddity, count in self._oddities.items()]
        damaged = len(self.skipped)
        if damaged > MAX_SILENT_DAMAGE * (scan_count + damaged):
            counted.append(
                f"{damaged} damaged lines are left out, and {scan_count} scans are read: what is "
                f"missing between two scans counts as one step"
            )
        return (*self.remarks, *counted)

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


def read_lines(report: DamageReport) -> Iterator[tuple[int, str]]:
    """Yield the lines of the report's file with their numbers from 1; `LogError` if it is blank.

    gzip, bzip2, xz and zip are recognised by their first bytes, never by the suffix, and so is
    UTF-16. Bytes that are not of the encoding become U+FFFD and harm their line only. No more is
    read than the caller takes.
    """
    is_blank, size = True, 0
    for number, line in enumerate(_decode_lines(report), 1):
        size += len(line)
        if size > MAX_BYTES:
            raise LogError(
                f"{report.file}: more than {MAX_BYTES:,} bytes, unpacked; cut it in pieces, or "
                f"read a part with `scans` and `start` (`--scans`, `--start`)"
            )
        is_blank = is_blank and not line.strip()
        yield number, line.rstrip("\r\n")
    if is_blank:
        raise LogError(f"{report.file}: the file is empty")


def _decode_lines(report: DamageReport) -> Iterator[str]:
    """Lines with their ends; all that goes wrong is a `LogError`, but for a packed file's end."""
    file = report.file
    line_count = 0
    try:
        with open(report.path, "rb") as raw, _unpack(raw) as stream:
            head = stream.peek(TAR_BLOCK)
            if head[TAR_PLACE : TAR_PLACE + len(TAR)] == TAR:
                raise LogError("it is a tar archive; unpack it")
            text = io.TextIOWrapper(stream, _encoding(head[:4]), errors="replace", newline=None)
            while line := text.readline(MAX_BYTES + 1):
                line_count += 1
                yield line
    except EOFError as error:  # the file was cut: what it holds until there is good
        if line_count == 0:
            raise LogError(f"{file}: cannot be read: {shorten(str(error))}") from None
        report.skip(line_count + 1, "the packed file breaks off here")
    except Exception as error:  # a damaged archive raises errors of many kinds
        reason = shorten(getattr(error, "strerror", None) or str(error) or type(error).__name__)
        raise LogError(f"{file}: cannot be read: {reason}") from None


def _unpack(raw: io.BufferedReader) -> io.BufferedReader:
    """The bytes of a file, or those in its packing."""
    magic = raw.peek(4)[:4]
    if magic == ZSTD:
        raise LogError("it is packed by zstd; unpack it, or name the folder of the bag")
    if magic.startswith(b"\x1f\x8b"):
        return io.BufferedReader(gzip.open(raw))
    if magic.startswith(b"BZh"):
        return io.BufferedReader(bz2.open(raw))
    if magic == b"\xfd7zX":
        return io.BufferedReader(lzma.open(raw))
    if magic.startswith(b"PK"):
        archive = zipfile.ZipFile(raw)
        return io.BufferedReader(cast("io.RawIOBase", archive.open(_member(archive))))
    return raw


def _encoding(head: bytes) -> str:
    """The encoding by the mark at the beginning."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    return "utf-8-sig"


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


def planar_heading(qx: float, qy: float, qz: float, qw: float) -> float:
    """θ in (−π, π] of a unit quaternion that hardly leans; `DamagedLine` if it is none."""
    norm = math.hypot(qx, qy, qz, qw)
    if not abs(norm - 1.0) <= QUATERNION_TOLERANCE:
        raise DamagedLine(f"the quaternion has length {norm:.4g}, expected 1 (order qx qy qz qw)")
    if math.hypot(qx, qy) > math.sin(0.5 * MAX_LEAN):
        raise DamagedLine(f"a rotation out of the plane, qx = {qx:g} and qy = {qy:g}, expected 0")
    sine = 2.0 * (qw * qz + qx * qy)
    cosine = qw * qw + qx * qx - qy * qy - qz * qz
    return float(wrap(math.atan2(sine, cosine)))


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
    """Raise `DamagedLine` for a place beyond `MAX_DISTANCE`."""
    if not (abs(x) <= MAX_DISTANCE and abs(y) <= MAX_DISTANCE):
        raise DamagedLine(f"{what} is ({x:g}, {y:g}), expected to lie within {MAX_DISTANCE:g} m")


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
