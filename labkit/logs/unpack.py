"""The bytes of a file, unpacked from gzip or zip, as far as a damaged stream goes."""

from __future__ import annotations

import io
import os
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

from labkit.errors import LogError

GZIP_MAGIC = b"\x1f\x8b"
ZIP_MAGIC = b"PK\x03\x04"
ZIP_EMPTY_MAGIC = b"PK\x05\x06"
BYTE_ORDER_MARK = b"\xef\xbb\xbf"

GZIP_WINDOW = 31
RAW_DEFLATE_WINDOW = -15


@dataclass(frozen=True, kw_only=True)
class Content:
    """What a file holds once unpacked.

    Attributes
    ----------
    file : str
        The file as the caller named it, for messages.
    data : bytes
        The unpacked bytes; of a damaged stream, those before the damage.
    damage : str
        What is wrong with the packed stream; empty if nothing is.
    """

    file: str
    data: bytes
    damage: str = ""


def load(path: str | os.PathLike[str]) -> Content:
    """Read a file; gzip and zip are told by their first bytes, never by the suffix.

    Raises
    ------
    LogError
        If the file is missing, a directory, unreadable or empty, or if a zip archive does
        not hold exactly one member beside the ``__MACOSX/`` ones.
    """
    file = os.fspath(path)
    packed = _read_bytes(file)
    if packed.startswith(GZIP_MAGIC):
        data, damage = _gunzip(packed)
    elif packed.startswith((ZIP_MAGIC, ZIP_EMPTY_MAGIC)):
        data, damage = _unzip(packed, file)
    else:
        data, damage = packed, ""
    data = data.removeprefix(BYTE_ORDER_MARK)
    if not data.strip():
        raise LogError(f"{file}: the file is empty" + (f" ({damage})" if damage else ""))
    return Content(file=file, data=data, damage=damage)


def _read_bytes(file: str) -> bytes:
    try:
        return Path(file).read_bytes()
    except FileNotFoundError:
        raise LogError(f"{file}: no such file") from None
    except IsADirectoryError:
        raise LogError(f"{file}: is a directory, expected a file") from None
    except PermissionError:
        raise LogError(f"{file}: no permission to read it") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise LogError(f"{file}: cannot be read: {reason}") from None


def _gunzip(packed: bytes) -> tuple[bytes, str]:
    """All gzip members one after the other; trailing zeros are padding."""
    parts: list[bytes] = []
    while packed.rstrip(b"\0"):
        data, damage, packed = _inflate(packed, GZIP_WINDOW)
        parts.append(data)
        if damage:
            return b"".join(parts), f"the gzip stream {damage}"
    return b"".join(parts), ""


def _unzip(packed: bytes, file: str) -> tuple[bytes, str]:
    """The one member of an archive; of a cut one, whatever its first member still gives."""
    try:
        with zipfile.ZipFile(io.BytesIO(packed)) as archive:
            return archive.read(_only_member(archive, file)), ""
    except LogError:
        raise
    except RuntimeError as error:  # encrypted, or packed by an unknown method
        raise LogError(f"{file}: the zip archive cannot be unpacked: {error}") from None
    except Exception:  # zipfile raises whatever a damaged directory makes it stumble over
        data, damage = _first_zip_member(packed)
        return data, f"the zip archive {damage or 'is damaged'}"


def _only_member(archive: zipfile.ZipFile, file: str) -> zipfile.ZipInfo:
    members = [info for info in archive.infolist() if _is_content(info.filename)]
    if len(members) != 1:
        names = ", ".join(info.filename for info in members[:5]) or "none"
        raise LogError(
            f"{file}: a zip archive must hold exactly one log, got {len(members)} ({names}); "
            f"unpack it and name one file"
        )
    return members[0]


def _is_content(name: str) -> bool:
    return not name.startswith("__MACOSX/") and not name.endswith("/")


def _first_zip_member(packed: bytes) -> tuple[bytes, str]:
    """Inflate from the first local header, which needs no directory at the archive's end."""
    if len(packed) < 30:
        return b"", "ends within its first header"
    _, _, _, method, *_, name_length, extra_length = struct.unpack_from("<IHHHHHIIIHH", packed)
    start = 30 + name_length + extra_length
    if method != zipfile.ZIP_DEFLATED:
        return b"", "is damaged"
    data, damage, _ = _inflate(packed[start:], RAW_DEFLATE_WINDOW)
    return data, damage


def _inflate(packed: bytes, window: int) -> tuple[bytes, str, bytes]:
    """The unpacked bytes, what is wrong with the stream, and what follows it.

    Small bites keep what came out before a damaged byte.
    """
    stream = zlib.decompressobj(window)
    parts: list[bytes] = []
    bite = 256
    for start in range(0, len(packed), bite):
        try:
            parts.append(stream.decompress(packed[start : start + bite]))
        except zlib.error:
            return b"".join(parts), f"is damaged near byte {start}, the rest is lost", b""
        if stream.eof:
            return b"".join(parts), "", stream.unused_data + packed[start + bite :]
    return b"".join(parts), f"ends early, after {len(packed)} bytes", b""
