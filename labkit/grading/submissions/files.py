"""What one student handed in: files listed without unpacking, read within bounds."""

from __future__ import annotations

import io
import lzma
import os
import struct
import zipfile
import zlib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

from labkit.errors import LabkitError

Platform = Literal["canvas", "moodle", ""]

MEBIBYTE = 1 << 20
MAX_FILE = 32 * MEBIBYTE  # a notebook with its pictures
MAX_TOGETHER = 2 * MAX_FILE  # of all files of one student
MAX_FILES = 200  # of one student
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
        raise LabkitError(f"{path}: cannot be read as a zip archive: {error}") from None
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
            if len(members) > MAX_FILES:
                raise LabkitError(
                    f"{name} holds {len(members)} notebooks and scripts, at most {MAX_FILES} are "
                    f"read from an archive; hand in your own alone"
                )
            for info in members:
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


VERDICTS = "verdicts.jsonl"  # the file by which a folder of verdicts and pages is known
PAGES = "students/"  # a folder in it


def folder_below(path: Path, folder: str | os.PathLike[str]) -> str:
    """A folder's name below `path`, with its "/"; empty where it is that, or lies elsewhere."""
    try:
        below = Path(folder).resolve().relative_to(path.resolve())
    except ValueError:
        return ""
    return f"{printable(below.as_posix())}/" if below.parts else ""


def earlier_outputs(names: Collection[str]) -> list[str]:
    """Folders of earlier verdicts and pages, each with its "/", in which nobody's work lies.

    >>> earlier_outputs(["ada/a.py", "grades/verdicts.jsonl", "grades/students/ada.html"])
    ['grades/']
    >>> earlier_outputs(["ada/a.py", "ada/verdicts.jsonl"])
    []
    """
    holders = [name.removesuffix(VERDICTS) for name in names if Path(name).name == VERDICTS]
    sources = [name for name in names if may_hold_source(name)]
    folders = [holder or PAGES for holder in holders]
    return [folder for folder in folders if not any(one.startswith(folder) for one in sources)]


Files = tuple[tuple[str, StoredFile], ...]


@dataclass(frozen=True, kw_only=True)
class Submission:
    """What one student handed in.

    Attributes
    ----------
    student : str
        Unique in the class: the platform's number, or the name of folder or file.
    name : str
        For a person.
    files : tuple of (str, StoredFile)
        Every file under its own name; the platform's part of the name is gone.
    platform : {"canvas", "moodle", ""}
        Where the download came from, as far as its names tell.
    late : bool
        Whether the platform marked it so.
    notes : tuple of str
        What the student should know of files that are left out.
    """

    student: str
    name: str
    files: Files
    platform: Platform = ""
    late: bool = False
    notes: tuple[str, ...] = ()

    def read(self) -> tuple[dict[str, bytes], tuple[str, ...]]:
        """The notebooks and scripts, and what the student should know of the rest.

        What an archive holds stands below the archive's name, ``work.zip/answers.ipynb``, so
        that no file hides another.
        """
        found: dict[str, bytes] = {}
        notes = list(self.notes)
        for name, file in self.files[:MAX_FILES]:
            read: dict[str, bytes] = {}
            try:
                if is_source(name):
                    read = {name: file.read()}
                elif may_hold_source(name):
                    inside = unzip(name, file.read())
                    read = {f"{name}/{inner}": data for inner, data in inside.items()}
                if sum(map(len, (found | read).values())) > MAX_TOGETHER:
                    raise LabkitError(f"the files are too large together; {name} is not read")
                found |= read
            except LabkitError as error:
                notes.append(str(error))
        if len(self.files) > MAX_FILES:
            notes.append(f"{len(self.files)} files were handed in; the first {MAX_FILES} are read")
        if not found:
            handed_in = (
                ", ".join(name for name, _ in self.files[:5])
                or "nothing, and links are not followed"
            )
            notes.append(f"there is no notebook (.ipynb) or script (.py) in it; found {handed_in}")
        return found, tuple(notes)
