"""The files of a submission, on disk or in archives: what can hold answers, read within bounds."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from labkit.support.errors import LabkitError

MEBIBYTE = 1 << 20
MAX_FILE = 32 * MEBIBYTE  # a notebook with its pictures
MAX_TOGETHER = 48 * MEBIBYTE  # of all files of one student
MAX_FILES = 200  # notebooks and scripts of one student
DIRECTORY, ENTRY = b"PK\1\2", 600  # what each file has in an archive; it takes as long as bytes
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # unpacked piece by piece; others at once
SKIPPED = {
    ".ipynb_checkpoints", "__MACOSX", "__pycache__", ".git", ".venv", "node_modules", "Thumbs.db",
    "desktop.ini",
}  # fmt: skip
SOURCES = (".ipynb", ".ipynb.txt", ".ipynb.json", ".py", ".py.txt")  # browsers add an ending
PACKAGE = Path(__file__).parents[2]


class Handed(NamedTuple):
    """A file on disk, or in a zip archive on disk."""

    name: str  # its path below what was listed, printable, with "/" between the parts
    path: Path  # the file, or the archive that holds it
    member: str = ""  # its name in the archive

    def read(self) -> bytes:
        """Read it all, up to a byte more than `MAX_FILE`."""
        if self.member:
            with zipfile.ZipFile(self.path) as archive:
                return _unpacked(archive, archive.getinfo(self.member), MAX_FILE)
        with self.path.open("rb") as file:
            return file.read(MAX_FILE + 1)


def list_files(path: Path) -> list[Handed]:
    """The files of a folder or zip archive, by name; no link is followed.

    Raises
    ------
    LabkitError
        Where `path` is missing or cannot be read.
    """
    try:
        if os.path.isdir(path):
            return sorted(_in_folder(path))
        with zipfile.ZipFile(path) as archive:
            names = [info.filename for info in archive.infolist() if not info.is_dir()]
    except OSError as error:
        raise LabkitError(f"{error.filename or path}: cannot be read: {error.strerror}") from None
    except Exception as error:  # untrusted: zipfile raises anything
        raise LabkitError(
            f"{path}: is no folder and no zip archive ({error}); with one notebook or script, "
            f"say whose it is: --student NAME"
        ) from None
    return sorted(Handed(printable(name), path, name) for name in names if not is_skipped(name))


def _in_folder(folder: Path) -> Iterator[Handed]:
    def refuse(error: OSError) -> None:
        raise error

    for root, directories, names in os.walk(folder, onerror=refuse):
        directories[:] = [name for name in directories if name not in SKIPPED]
        for name in names:
            path = Path(root, name)
            if path.is_file() and not path.is_symlink() and not is_skipped(name):
                yield Handed(printable(path.relative_to(folder).as_posix()), path)


def read_sources(handed_in: Sequence[Handed]) -> tuple[dict[str, bytes], tuple[str, ...]]:
    """The notebooks and scripts of a submission, and what was not read and why.

    Whatever a file makes a reader raise is said of that file, and the others are read.
    """
    unread: list[str] = []
    found: dict[str, bytes] = {}
    left = MAX_TOGETHER
    sources = [file for file in handed_in if may_hold_source(file.name)]
    for file in sorted(sources, key=lambda one: likely_first(one.name)):
        try:
            data = file.read()
            inner = {file.name: data} if is_source(file.name) else unzip(file.name, data, left)
            left -= sum(map(len, inner.values()))
            if left < 0 or len(data) > MAX_FILE:
                raise LabkitError(
                    f"it is larger than {MAX_FILE // MEBIBYTE} MiB, or all files together are "
                    f"too large; clear the outputs and hand it in again"
                )
            found |= {inside: held for inside, held in inner.items() if not is_handed_out(inside)}
        except Exception as error:  # untrusted: zipfile and its like raise anything
            unread.append(f"{file.name} cannot be read: {error}")
    if not found and not unread:
        names = ", ".join(file.name for file in handed_in[:5]) or "nothing"
        unread.append(f"no notebook (.ipynb) or script (.py) of your own is in it, but {names}")
    if len(found) > MAX_FILES:
        unread.append(f"of {len(found)} files {MAX_FILES} are read; hand in your own alone")
    return dict(list(found.items())[:MAX_FILES]), tuple(unread[:40])


def unzip(name: str, data: bytes, most: int, *, deeper: bool = True) -> dict[str, bytes]:
    """The notebooks and scripts in an archive, and in archives in it if `deeper`.

    Raises
    ------
    LabkitError
        Where it holds more than `most` bytes, counting some for each file however small.
        What is no zip archive raises what `zipfile` raises.
    """
    files: dict[str, bytes] = {}
    most -= ENTRY * data.count(DIRECTORY)
    if most < 0:
        raise LabkitError("it holds too many files; hand in your own alone")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for info in sorted(archive.infolist(), key=lambda info: likely_first(info.filename)):
            inner = f"{name}/{printable(info.filename)}"
            if is_skipped(inner) or not (is_source(inner) or (deeper and may_hold_source(inner))):
                continue
            unpacked = _unpacked(archive, info, most)
            source = is_source(inner)
            held = {inner: unpacked} if source else unzip(inner, unpacked, most, deeper=False)
            most -= len(unpacked) + sum(map(len, held.values()))
            if most < 0:
                raise LabkitError("it holds too much; hand in your own files alone")
            files |= held
    return files


def _unpacked(archive: zipfile.ZipFile, info: zipfile.ZipInfo, most: int) -> bytes:
    """The bytes of a member, and one more than `most` where there are more."""
    if info.compress_type not in PACKINGS:
        raise zipfile.BadZipFile("it is packed in a rare way; pack it as an ordinary zip archive")
    with archive.open(info) as packed:
        return packed.read(most + 1)


def is_source(name: str) -> bool:
    """True if a file can hold answers."""
    return name.lower().endswith(SOURCES)


def may_hold_source(name: str) -> bool:
    """True if it is a file with answers, or an archive that may hold one."""
    return name.lower().endswith((*SOURCES, ".zip"))


def likely_first(name: str) -> tuple[bool, bool, int, str]:
    """A key by which notebooks come first, then scripts, and files of the top folder before."""
    return ".ipynb" not in name.lower(), not is_source(name), name.count("/"), name


def is_skipped(name: str) -> bool:
    """True if a file is none of the student's: what editors and systems leave behind."""
    path = PurePosixPath(name)
    return bool(SKIPPED & set(path.parts)) or path.name.startswith(".")


def is_handed_out(name: str) -> bool:
    """True if a file is part of a copy of labkit, by its place.

    >>> is_handed_out("lab/labkit/se2.py"), is_handed_out("se2.py")
    (True, False)
    """
    _, inside, place = name.rpartition("labkit/")
    return bool(inside) and (PACKAGE / place).is_file()


def printable(name: str) -> str:
    r"""A file's name as text that can be printed and stored: on disk it may be any bytes.

    Two names stay two: what cannot be printed is spelled out.

    >>> print(printable("ad\u202ea"), printable("ad\udcff"))
    ad\u202ea ad\xff
    """
    text = name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
