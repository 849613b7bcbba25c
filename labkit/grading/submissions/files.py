"""Files in a folder or an archive, listed without unpacking, read within bounds."""

from __future__ import annotations

import io
import lzma
import os
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from labkit.errors import LabkitError

MEBIBYTE = 1 << 20
MAX_FILE = 32 * MEBIBYTE  # a notebook with its pictures
MAX_TOGETHER = 2 * MAX_FILE  # of all files of one student
MAX_MEMBERS = 2000  # notebooks and scripts in one archive
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # unpacked piece by piece; others at once
SKIPPED = {
    ".ipynb_checkpoints", "__MACOSX", "__pycache__", ".git", ".venv", "node_modules", "Thumbs.db",
    "desktop.ini",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class StoredFile:
    """A file on disk, or in a zip archive on disk.

    Attributes
    ----------
    name : str
        Its path below what was listed, with "/" between the parts.
    path : Path
        The file, or the archive that holds it.
    member : str
        Its name in the archive; empty for a file of its own.
    size : int
        Bytes, as the folder or the archive says.
    """

    name: str
    path: Path
    member: str
    size: int

    def read(self) -> bytes:
        """Read it all.

        Raises
        ------
        LabkitError
            Where it cannot be read, or is larger than `MAX_FILE`; the message is for the
            student.
        """
        if self.size > MAX_FILE:
            raise LabkitError(
                f"{self.name} has {self.size / MEBIBYTE:.0f} MiB, at most "
                f"{MAX_FILE // MEBIBYTE} are read; clear its outputs and hand it in again"
            )
        try:
            if not self.member:
                with self.path.open("rb") as file:
                    return _bounded(file.read(MAX_FILE + 1), self.name)
            with zipfile.ZipFile(self.path) as archive:
                return _bounded(
                    _unpacked(archive, archive.getinfo(self.member), MAX_FILE), self.name
                )
        except LabkitError:
            raise
        except DAMAGED as error:
            raise LabkitError(f"{self.name} cannot be read: {error}") from None


# What a damaged archive raises, in this module or in those that it calls.
DAMAGED = (
    OSError, zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, RuntimeError, EOFError,
    ValueError, LookupError,
)  # fmt: skip


def _unpacked(archive: zipfile.ZipFile, info: zipfile.ZipInfo, most: int) -> bytes:
    """The bytes of a member, and one more than `most` where there are more."""
    if info.compress_type not in PACKINGS:
        raise zipfile.BadZipFile("it is packed in a rare way; pack it as an ordinary zip archive")
    with archive.open(info) as packed:
        return packed.read(most + 1)


def _bounded(data: bytes, name: str) -> bytes:
    if len(data) > MAX_FILE:  # an archive may understate a size
        raise LabkitError(f"{name} is larger than {MAX_FILE // MEBIBYTE} MiB; it is not read")
    return data


def list_files(path: Path) -> list[StoredFile]:
    """The files of a folder or zip archive, by name; no link is followed.

    Raises
    ------
    LabkitError
        Where `path` is missing or cannot be read.
    """
    if path.is_dir():
        return sorted(_in_folder(path), key=lambda file: file.name)
    try:
        with zipfile.ZipFile(path) as archive:
            members = [info for info in archive.infolist() if not info.is_dir()]
    except FileNotFoundError:
        raise LabkitError(f"{path}: no such file or folder") from None
    except DAMAGED as error:
        raise LabkitError(
            f"{path}: is no folder, notebook (.ipynb) or script (.py), and cannot be read as a zip "
            f"archive: {error}"
        ) from None
    files = [
        StoredFile(
            name=printable(info.filename), path=path, member=info.filename, size=info.file_size
        )
        for info in members
    ]
    return sorted((file for file in files if not is_skipped(file.name)), key=lambda f: f.name)


def list_folders(path: Path, inside: str) -> list[str]:
    """Names of the folders right inside one of a folder or archive, those without a file too.

    `inside` is the name of a folder right in `path`, with its "/"; empty for `path` itself.
    """
    if path.is_dir():
        around = [each for each in path.iterdir() if f"{printable(each.name)}/" == inside] or [path]
        below = [printable(each.name) for each in around[0].iterdir() if each.is_dir()]
    else:
        with zipfile.ZipFile(path) as archive:
            folders = [printable(info.filename) for info in archive.infolist() if info.is_dir()]
        below = [name[len(inside) :] for name in folders if name.startswith(inside)]
    names = {name.split("/", 1)[0] for name in below}
    return sorted(name for name in names if name and not is_skipped(name))


def _in_folder(folder: Path) -> list[StoredFile]:
    files = []
    for root, directories, names in os.walk(folder):
        directories[:] = [name for name in directories if name not in SKIPPED]
        for name in names:
            path = Path(root, name)
            if path.is_file() and not path.is_symlink() and not is_skipped(name):
                shown = printable(path.relative_to(folder).as_posix())
                size = path.stat().st_size
                files.append(StoredFile(name=shown, path=path, member="", size=size))
    return files


def unzip(name: str, data: bytes) -> dict[str, bytes]:
    """The files of an archive that a student handed in, within the bounds of a single file.

    Raises
    ------
    LabkitError
        Where it is no zip archive, or holds too much.
    """
    files: dict[str, bytes] = {}
    left = MAX_FILE
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [
                info
                for info in archive.infolist()
                if not is_skipped(info.filename) and is_source(info.filename)
            ]
            if len(members) > MAX_MEMBERS:
                raise LabkitError(
                    f"{name} holds {len(members)} notebooks and scripts, at most {MAX_MEMBERS} are "
                    f"read from an archive; hand in your own alone"
                )
            for info in sorted(members, key=lambda info: likely_first(info.filename)):
                unpacked = files[printable(info.filename)] = _unpacked(archive, info, left)
                left -= len(unpacked)
                if left < 0:
                    raise LabkitError(
                        f"{name} unpacks to more than {MAX_FILE // MEBIBYTE} MiB; it is not read"
                    )
    except LabkitError:
        raise
    except DAMAGED as error:
        raise LabkitError(f"{name} cannot be unpacked: {error}") from None
    return files


def is_source(name: str) -> bool:
    """Whether a file can hold answers."""
    return name.lower().endswith((".ipynb", ".py"))


def may_hold_source(name: str) -> bool:
    """Whether it is a file with answers, or an archive that may hold one."""
    return is_source(name) or name.lower().endswith(".zip")


def likely_first(name: str) -> tuple[bool, bool, int]:
    """A key by which files that are likely to hold answers come first, as far as names tell.

    >>> sorted(["labkit/icp.py", "notebooks/a.ipynb", "mine.py", "work.zip"], key=likely_first)
    ['notebooks/a.ipynb', 'mine.py', 'labkit/icp.py', 'work.zip']
    """
    lower = name.lower()
    return not lower.endswith(".ipynb"), not is_source(lower), name.count("/")


def is_skipped(name: str) -> bool:
    """Whether a file is none of the student's: what editors and systems leave behind."""
    parts = PurePosixPath(name).parts
    return bool(SKIPPED & set(parts)) or name.rsplit("/", 1)[-1].startswith(".")


def printable(name: str) -> str:
    r"""A file's name as text that can be printed and stored: on disk it may be any bytes.

    Two names stay two: what cannot be printed is spelled out.

    >>> print(printable("ad\u202ea"), printable("ad\udcff"))
    ad\u202ea ad\xff
    """
    text = name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
