"""The files of a submission, on disk or in archives: what can hold answers, read within bounds."""

from __future__ import annotations

import hashlib
import io
import zipfile
from functools import cache
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from labkit.errors import LabkitError

MEBIBYTE = 1 << 20
MAX_FILE = 32 * MEBIBYTE  # a notebook with its pictures
DIRECTORY, ENTRY = b"PK\1\2", 600  # what each file has in an archive; it takes as long as bytes
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # unpacked piece by piece; others at once
SKIPPED = {
    ".ipynb_checkpoints", "__MACOSX", "__pycache__", ".git", ".venv", "node_modules", "Thumbs.db",
    "desktop.ini",
}  # fmt: skip
SOURCES = (".ipynb", ".ipynb.txt", ".ipynb.json", ".py", ".py.txt")  # browsers add an ending
PACKAGE = Path(__file__).parents[2]
KEPT_BACK = "course/authoring"  # the part of the package that no student gets


class Handed(NamedTuple):
    """A file on disk, or in a zip archive on disk.

    Attributes
    ----------
    name : str
        Its path below what was listed, printable, with "/" between the parts.
    path : Path
        The file, or the archive that holds it.
    member : str
        Its name in the archive; empty for a file of its own.
    """

    name: str
    path: Path
    member: str

    def read(self) -> bytes:
        """Read it all, up to a byte more than `MAX_FILE`."""
        if self.member:
            with zipfile.ZipFile(self.path) as archive:
                return _unpacked(archive, archive.getinfo(self.member), MAX_FILE)
        with self.path.open("rb") as file:
            return file.read(MAX_FILE + 1)


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
    wanted = may_hold_source if deeper else is_source
    if most < 0:
        raise LabkitError("it holds too many files; hand in your own alone")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = [info for info in archive.infolist() if wanted(info.filename)]
        members = [info for info in members if not is_skipped(info.filename)]
        for info in sorted(members, key=lambda info: likely_first(info.filename)):
            unpacked = _unpacked(archive, info, most)
            inner = printable(info.filename)
            if is_source(inner):
                held = {f"{name}/{inner}": unpacked}
            else:
                held = unzip(f"{name}/{inner}", unpacked, most, deeper=False)
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
    """Whether a file can hold answers."""
    return name.lower().endswith(SOURCES)


def may_hold_source(name: str) -> bool:
    """Whether it is a file with answers, or an archive that may hold one."""
    return is_source(name) or name.lower().endswith(".zip")


def likely_first(name: str) -> tuple[bool, bool, int, str]:
    """A key by which files that are likely to hold answers come first, as far as names tell.

    >>> sorted(["labkit/icp.py", "notebooks/a.ipynb", "mine.py", "work.zip"], key=likely_first)
    ['notebooks/a.ipynb', 'mine.py', 'labkit/icp.py', 'work.zip']
    """
    lower = name.lower()
    return ".ipynb" not in lower, not is_source(lower), name.count("/"), name


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
    places = {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob("*.py")}
    given = {place: path for place, path in places.items() if not place.startswith(KEPT_BACK)}
    return frozenset(given), frozenset(_digest(path.read_bytes()) for path in given.values())


def _digest(data: bytes) -> bytes:
    """Of a text, however its lines end."""
    return hashlib.sha256(data.replace(b"\r\n", b"\n").strip()).digest()
