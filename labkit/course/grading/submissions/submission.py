"""What one student handed in: files in a folder or an archive, read when their turn comes.

They are listed without unpacking and read within bounds, what may hold answers before the rest.
"""

from __future__ import annotations

import hashlib
import io
import lzma
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Literal, NamedTuple

from labkit.errors import LabkitError

MEBIBYTE = 1 << 20
MAX_FILE = 32 * MEBIBYTE  # a notebook with its pictures
MAX_TOGETHER = 2 * MAX_FILE  # of all files of one student
MAX_MEMBERS = 2000  # notebooks and scripts in one archive
DIRECTORY, ENTRY = b"PK\1\2", 600  # what each file has in an archive; it takes as long as bytes
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # unpacked piece by piece; others at once
SKIPPED = {
    ".ipynb_checkpoints", "__MACOSX", "__pycache__", ".git", ".venv", "node_modules", "Thumbs.db",
    "desktop.ini",
}  # fmt: skip
SOURCES = (".ipynb", ".ipynb.txt", ".ipynb.json", ".py", ".py.txt")  # browsers add an ending
MAX_FILES = 200  # notebooks and scripts of one student
PACKAGE = Path(__file__).parents[3]
KEPT_BACK = "course/authoring"  # the part of the package that no student gets

Platform = Literal["canvas", "moodle", "blackboard", "d2l", ""]


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
            if self.member:
                with zipfile.ZipFile(self.path) as archive:
                    data = _unpacked(archive, archive.getinfo(self.member), MAX_FILE)
            else:
                with self.path.open("rb") as file:
                    data = file.read(MAX_FILE + 1)
        except DAMAGED as error:
            raise LabkitError(f"{self.name} cannot be read: {error}") from None
        if len(data) > MAX_FILE:  # an archive may understate a size
            raise LabkitError(
                f"{self.name} is larger than {MAX_FILE // MEBIBYTE} MiB; it is not read"
            )
        return data


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


def unzip(
    name: str, data: bytes, most: int, *, deeper: bool = True
) -> tuple[dict[str, bytes], int]:
    """The files of an archive that a student handed in, and of archives in it if `deeper`.

    With them comes what is left of `most`, the bytes that may come out of it; each file in the
    archive counts for some, however small it is.

    Raises
    ------
    LabkitError
        Where it is no zip archive, or holds too much.
    """
    files: dict[str, bytes] = {}
    wanted = may_hold_source if deeper else is_source
    too_much = LabkitError(
        f"{name} holds too much: {MAX_FILE // MEBIBYTE} MiB and {MAX_FILE // ENTRY} files are read "
        f"at most, {MAX_TOGETHER // MEBIBYTE} MiB of all archives; hand in your own files alone"
    )
    most -= ENTRY * data.count(DIRECTORY)
    if most < 0:
        raise too_much
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [
                info
                for info in archive.infolist()
                if not is_skipped(info.filename) and wanted(info.filename)
            ]
            for info in sorted(members, key=lambda info: likely_first(info.filename)):
                inner = printable(info.filename)
                unpacked = _unpacked(archive, info, most)
                most -= len(unpacked)
                if most < 0:
                    raise too_much
                if is_source(inner):
                    files[inner] = unpacked
                else:
                    below, most = unzip(f"{name}/{inner}", unpacked, most, deeper=False)
                    files |= {f"{inner}/{file}": held for file, held in below.items()}
                if max(len(files), len(members)) > MAX_MEMBERS:
                    raise LabkitError(
                        f"{name} holds {max(len(files), len(members))} notebooks and scripts, at "
                        f"most {MAX_MEMBERS} are read from an archive; hand in your own alone"
                    )
    except LabkitError:
        raise
    except DAMAGED as error:
        raise LabkitError(f"{name} cannot be unpacked: {error}") from None
    return files, most


def is_source(name: str) -> bool:
    """Whether a file can hold answers."""
    return name.lower().endswith(SOURCES)


def may_hold_source(name: str) -> bool:
    """Whether it is a file with answers, or an archive that may hold one."""
    return is_source(name) or name.lower().endswith(".zip")


def likely_first(name: str) -> tuple[bool, bool, int]:
    """A key by which files that are likely to hold answers come first, as far as names tell.

    >>> sorted(["labkit/icp.py", "notebooks/a.ipynb", "mine.py", "work.zip"], key=likely_first)
    ['notebooks/a.ipynb', 'mine.py', 'labkit/icp.py', 'work.zip']
    """
    lower = name.lower()
    return ".ipynb" not in lower, not is_source(lower), name.count("/")


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


Files = tuple[tuple[str, StoredFile], ...]


class Reading(NamedTuple):
    """What was read of a submission.

    Attributes
    ----------
    files : dict of str to bytes
        Its notebooks and scripts, those first that define most of the functions asked for.
        What was handed out is not among them.
    unread : tuple of str
        What could not be read or was left out, and why: for the student and the instructor.
    """

    files: dict[str, bytes]
    unread: tuple[str, ...]


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
    platform : {"canvas", "moodle", "blackboard", "d2l", ""}
        Where the download came from, as far as its names tell.
    late : bool
        Whether the platform marked it so.
    notes : tuple of str
        What the student should know of files that are left out.
    upload : int
        Canvas's number of the newest upload, or the time of the newest attempt; else 0.
    """

    student: str
    name: str
    files: Files
    platform: Platform = ""
    late: bool = False
    notes: tuple[str, ...] = ()
    upload: int = 0

    @property
    def feedback_name(self) -> str:
        """The name under which its platform takes a page for this student back."""
        if self.platform == "moodle":
            return f"{self.name}_{self.student}_assignsubmission_file_/feedback.html"
        if self.platform == "canvas":
            return f"{self.name}_{self.student}_{self.upload}_feedback.html"
        return f"{self.student.replace('/', '-')}.html"

    def read(self, functions: Collection[str] = ()) -> Reading:
        """The notebooks and scripts, and what is to be known of the rest.

        Parameters
        ----------
        functions : collection of str
            The functions that the assignment asks for; a file that defines more of them
            comes first, and is kept where there are more than `MAX_FILES`.

        Returns
        -------
        Reading
            What an archive holds stands below the archive's name, ``work.zip/answers.ipynb``,
            so that no file hides another.
        """
        unread = list(self.notes)
        found: dict[str, bytes] = {}
        handed_out = 0
        for name, data in self._sources(unread):
            if is_handed_out(name, data):
                handed_out += 1
            else:
                found[name] = data
        kept = sorted(found, key=lambda name: -_defined(found[name], functions))
        if len(kept) > MAX_FILES:
            unread.append(
                f"{len(kept)} notebooks and scripts were handed in, {MAX_FILES} are read; "
                f"{kept[MAX_FILES]} is the first that is not"
            )
        if not found:
            unread.append(self._nothing(handed_out))
        return Reading({name: found[name] for name in kept[:MAX_FILES]}, tuple(unread))

    def _sources(self, unread: list[str]) -> Iterator[tuple[str, bytes]]:
        """The notebooks and scripts, also those in archives, within the bounds."""
        left = MAX_TOGETHER
        sources = [(name, file) for name, file in self.files if may_hold_source(name)]
        for name, file in sorted(sources, key=lambda named: likely_first(named[0])):
            most = min(MAX_FILE, left)
            try:
                if most <= 0:
                    raise LabkitError(f"the files are too large together; {name} is not read")
                data = file.read()
                if is_source(name):
                    read, rest = {name: data}, most - len(data)
                else:
                    below, rest = unzip(name, data, most)
                    read = {f"{name}/{inner}": held for inner, held in below.items()}
                if rest < 0:
                    raise LabkitError(f"the files are too large together; {name} is not read")
            except LabkitError as error:
                unread.append(str(error))
                left -= 0 if is_source(name) else most  # it took its time, too
                continue
            left -= most - rest
            yield from read.items()

    def _nothing(self, handed_out: int) -> str:
        if handed_out:
            return (
                "there is nothing in it but what was handed out; hand in the notebook with your "
                "answers"
            )
        names = ", ".join(name for name, _ in self.files[:5])
        found = names or "nothing, and links are not followed"
        return f"there is no notebook (.ipynb) or script (.py) in it; found {found}"


def is_handed_out(name: str, data: bytes) -> bool:
    """Whether a file is labkit's own, by its content or by its place in a copy of labkit.

    Examples
    --------
    >>> is_handed_out("lab/labkit/se2.py", b"# changed"), is_handed_out("se2.py", b"# mine")
    (True, False)
    >>> is_handed_out("copy.py", (PACKAGE / "se2.py").read_bytes())
    True
    """
    places, digests = _handed_out()
    _, inside, place = name.rpartition("labkit/")
    return (bool(inside) and place in places) or _digest(data) in digests


@cache
def _handed_out() -> tuple[frozenset[str], frozenset[bytes]]:
    """The places and digests of labkit's scripts, but of those that no student gets."""
    scripts = {path.relative_to(PACKAGE): path for path in PACKAGE.rglob("*.py")}
    given = {
        place: path for place, path in scripts.items() if not place.as_posix().startswith(KEPT_BACK)
    }
    digests = (_digest(path.read_bytes()) for path in given.values())
    return frozenset(place.as_posix() for place in given), frozenset(digests)


def _digest(data: bytes) -> bytes:
    """Of a text, however its lines end."""
    return hashlib.sha256(data.replace(b"\r\n", b"\n").strip()).digest()


def _defined(data: bytes, functions: Iterable[str]) -> int:
    """How many of the functions a notebook or script seems to define."""
    defined = set(re.findall(rb"\bdef[ \t]+(\w+)", data))
    return sum(function.encode() in defined for function in functions)
