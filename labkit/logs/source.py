"""The lines of a text file, plain, in gzip or in zip, one after the other at constant memory."""

from __future__ import annotations

import os
import stat
import struct
import zipfile
import zlib
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from labkit.arrays import check_count
from labkit.errors import LogError
from labkit.logs.lines import DamageReport

GZIP_MAGIC = b"\x1f\x8b"
ZIP_MAGIC = b"PK\x03\x04"
ZIP_EMPTY_MAGIC = b"PK\x05\x06"
BYTE_ORDER_MARK = b"\xef\xbb\xbf"

GZIP_WINDOW = 31
RAW_DEFLATE_WINDOW = -15

PIECE = 1 << 18
"""How many bytes are looked at together."""

BITE = 256
"""How many packed bytes are unpacked at once: what came out before a damaged one is kept, and
no bite swells beyond 260 kB."""

MEBIBYTE = 1 << 20

Progress = Callable[[int, int], object]
"""Called with how many bytes of the file are read, and how many it has."""


@dataclass(frozen=True, kw_only=True)
class ReadLimits:
    """How much a file may hold, lest a small packed one fill the memory.

    Attributes
    ----------
    max_bytes : int
        The most bytes, unpacked; a file with more is refused.
    max_line_bytes : int
        The longest line, in bytes; a longer one is damaged.
    """

    max_bytes: int = 512 * MEBIBYTE
    max_line_bytes: int = 4 * MEBIBYTE

    def __post_init__(self) -> None:
        check_count(self.max_bytes, "max_bytes", at_least=1)
        check_count(self.max_line_bytes, "max_line_bytes", at_least=1)


class TextSource:
    """A file of text lines, which can be gone through any number of times.

    gzip and zip are told by their first bytes, never by the suffix.

    Parameters
    ----------
    path : path-like
        The file.
    limits : ReadLimits, optional
        How much it may hold.
    progress : callable, optional
        Told how much is read, whenever the lines are gone through with a report.

    Raises
    ------
    LogError
        If the file is missing, unreadable, or neither file nor link to one.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        limits: ReadLimits | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.file = os.fspath(path)
        self.limits = limits or ReadLimits()
        self.progress = progress
        with self._open() as opened:
            self._magic = opened.read(4)

    def verify(self, report: DamageReport) -> None:
        """Tell the damage of a packed stream before that which it does to the lines."""
        if self._is_packed():
            for _ in self.lines(report):
                pass

    def lines(self, report: DamageReport | None = None) -> Iterator[tuple[int, str]]:
        """Yield the lines with their numbers from 1, without their ends.

        Bytes that are not UTF-8 become U+FFFD and harm their line only. A line that is too
        long and the damage of a packed stream go into `report`, where there is one.

        Raises
        ------
        LogError
            If the file holds more than its limits allow, or nothing at all, or if a zip
            archive does not hold exactly one member beside the ``__MACOSX/`` ones.
        """
        empty = True
        with self._open() as opened:
            number = 0
            rows = _rows(self._pieces(opened, report), self.limits.max_line_bytes)
            while True:
                try:
                    row = next(rows)
                except StopIteration as end:
                    damage: str = end.value
                    break
                number += 1
                if row is None:
                    empty = False
                    self._skip(number, report)
                    continue
                text = row.decode("utf-8", "replace")
                empty = empty and not text.strip()
                yield number, text
        if empty:
            raise LogError(f"{self.file}: the file is empty" + (f" ({damage})" if damage else ""))
        if damage and report is not None:
            report.skip(number, damage)

    def _pieces(self, opened: BinaryIO, report: DamageReport | None) -> Generator[bytes, None, str]:
        """The unpacked bytes, with their number held to the limit and their progress told."""
        total = os.fstat(opened.fileno()).st_size
        unpacked = self._unpacked(opened)
        seen = 0
        while True:
            try:
                piece = next(unpacked)
            except StopIteration as end:
                return str(end.value)
            if not seen:
                piece = piece.removeprefix(BYTE_ORDER_MARK)
            seen += len(piece)
            self._refuse_size(seen)
            if report is not None and self.progress is not None:
                self.progress(opened.tell(), total)
            yield piece

    def _skip(self, number: int, report: DamageReport | None) -> None:
        if report is not None:
            report.skip(
                number,
                f"a line of more than {self.limits.max_line_bytes:,} bytes; if it is no damage, "
                f"raise `max_line_bytes`",
            )

    def _refuse_size(self, seen: int) -> None:
        if seen > self.limits.max_bytes:
            raise LogError(
                f"{self.file}: more than {self.limits.max_bytes:,} bytes"
                f"{' once unpacked' if self._is_packed() else ''}; if it is what you expect, raise "
                f"`max_bytes`"
            )

    def _is_packed(self) -> bool:
        return self._magic.startswith((GZIP_MAGIC, ZIP_MAGIC, ZIP_EMPTY_MAGIC))

    def _open(self) -> BinaryIO:
        try:
            mode = os.stat(self.file).st_mode
            if stat.S_ISDIR(mode):
                raise LogError(f"{self.file}: is a directory, expected a file")
            if not stat.S_ISREG(mode):
                raise LogError(
                    f"{self.file}: is a pipe or a device, expected a file; write it to one first"
                )
            return Path(self.file).open("rb")
        except FileNotFoundError:
            raise LogError(f"{self.file}: no such file") from None
        except PermissionError:
            raise LogError(f"{self.file}: no permission to read it") from None
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise LogError(f"{self.file}: cannot be read: {reason}") from None

    def _unpacked(self, opened: BinaryIO) -> Generator[bytes, None, str]:
        """Yield what the file holds; return what is wrong with the packed stream."""
        if self._magic.startswith(GZIP_MAGIC):
            return (yield from _gathered(_gunzip(opened)))
        if self._magic.startswith((ZIP_MAGIC, ZIP_EMPTY_MAGIC)):
            return (yield from _gathered(_unzip(opened, self.file)))
        while piece := opened.read(PIECE):
            yield piece
        return ""


def _rows(pieces: Generator[bytes, None, str], longest: int) -> Generator[bytes | None, None, str]:
    """The lines in the pieces without their ends, None for one that is too long."""
    carried, skipping = b"", False
    while True:
        try:
            piece = next(pieces)
        except StopIteration as end:
            if skipping:
                yield None
            elif carried:
                yield carried.rstrip(b"\r\n")
            return str(end.value)
        rows = (carried + piece).splitlines(keepends=True)
        # the last one may go on in the next piece, and b"\r" be half of b"\r\n"
        carried = rows.pop() if rows and not rows[-1].endswith(b"\n") else b""
        for row in rows:
            line = row.rstrip(b"\r\n")
            yield None if skipping or len(line) > longest else line
            skipping = False
        if len(carried) > longest + 1:
            carried, skipping = b"", True


def _gathered(parts: Generator[bytes, None, str]) -> Generator[bytes, None, str]:
    """The same bytes in pieces of a useful size."""
    gathered: list[bytes] = []
    size = 0
    while True:
        try:
            part = next(parts)
        except StopIteration as end:
            yield b"".join(gathered)
            return str(end.value)
        gathered.append(part)
        size += len(part)
        if size >= PIECE:
            yield b"".join(gathered)
            gathered, size = [], 0


def _gunzip(opened: BinaryIO) -> Generator[bytes, None, str]:
    """All gzip members one after the other; zeros behind one are padding."""
    packed = opened.read(BITE)
    while packed:
        if member := packed.lstrip(b"\0"):
            damage, packed = yield from _inflate(member, opened, GZIP_WINDOW)
            if damage:
                return f"the gzip stream {damage}"
        else:
            packed = b""
        packed = packed or opened.read(BITE)
    return ""


def _inflate(
    bite: bytes, opened: BinaryIO, window: int
) -> Generator[bytes, None, tuple[str, bytes]]:
    """Yield the unpacked bytes; return what is wrong with the stream, and what follows it."""
    stream = zlib.decompressobj(window)
    seen = 0
    while bite:
        try:
            yield stream.decompress(bite)
        except zlib.error:
            return f"is damaged near byte {seen}, the rest is lost", b""
        if stream.eof:
            return "", stream.unused_data
        seen += len(bite)
        bite = opened.read(BITE)
    return f"ends early, after {seen} bytes", b""


def _unzip(opened: BinaryIO, file: str) -> Generator[bytes, None, str]:
    """The one member of an archive; of a cut one, whatever its first member still gives."""
    member = _member(opened, file)
    opened.seek(0 if member is None else member.header_offset)
    header = opened.read(30)
    if len(header) < 30:
        return "the zip archive ends within its first header"
    _, _, _, method, *_, name_length, extra_length = struct.unpack("<IHHHHHIIIHH", header)
    opened.seek(name_length + extra_length, os.SEEK_CUR)
    check = 0
    if method == zipfile.ZIP_STORED and member is not None:
        parts, damage = _stored(opened, member.compress_size), ""
    elif method == zipfile.ZIP_DEFLATED:
        parts, damage = _inflate(opened.read(BITE), opened, RAW_DEFLATE_WINDOW), ""
    else:
        return "the zip archive is damaged"
    while True:
        try:
            part = next(parts)
        except StopIteration as end:
            damage, _ = end.value
            break
        check = zlib.crc32(part, check)
        yield part
    if not damage and (member is None or check != member.CRC):
        damage = "is damaged"
    return f"the zip archive {damage}" if damage else ""


def _stored(opened: BinaryIO, size: int) -> Generator[bytes, None, tuple[str, bytes]]:
    while size and (piece := opened.read(min(size, PIECE))):
        size -= len(piece)
        yield piece
    return ("ends early" if size else ""), b""


def _member(opened: BinaryIO, file: str) -> zipfile.ZipInfo | None:
    """The one member that holds the log; None where the archive's directory is damaged."""
    try:
        with zipfile.ZipFile(opened) as archive:
            listed = archive.infolist()
    except Exception:  # zipfile raises whatever a damaged directory makes it stumble over
        return None
    if any(info.header_offset < 0 for info in listed):  # zipfile counts from the archive's end
        return None
    members = [info for info in listed if _is_content(info.filename)]
    if len(members) != 1:
        names = ", ".join(info.filename[:30] for info in members[:5]) or "none"
        raise LogError(
            f"{file}: a zip archive must hold exactly one log, got {len(members)} ({names}); "
            f"unpack it and name one file"
        )
    reason = ""
    if members[0].flag_bits & 1:
        reason = "it is encrypted"
    elif members[0].compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:
        reason = f"its packing, number {members[0].compress_type}, is none that labkit knows"
    if reason:
        raise LogError(
            f"{file}: the zip archive cannot be unpacked: {reason}; unpack it and name the log"
        )
    return members[0]


def _is_content(name: str) -> bool:
    return not name.startswith("__MACOSX/") and not name.endswith("/")
