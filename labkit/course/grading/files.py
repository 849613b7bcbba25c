"""The files of a class, on disk or in a zip archive on disk: listed, and read within bounds."""

from __future__ import annotations

import os
import time
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from labkit.course.grading.reading import (
    MAX_FILE,
    MAX_TOGETHER,
    SKIPPED,
    is_skipped,
    likely_first,
    may_hold_source,
    member,
    printable,
)
from labkit.support.errors import LabkitError


class Handed(NamedTuple):
    """A file on disk, or in a zip archive on disk."""

    name: str  # its path below what was listed, printable, with "/" between the parts
    path: Path  # the file, or the archive that holds it
    member: str = ""  # its name in the archive
    changed: tuple[int, ...] = ()  # year, month, ... second, as the file system or archive says

    def read(self) -> bytes:
        """Read it all, up to a byte more than `MAX_FILE`."""
        if self.member:
            with zipfile.ZipFile(self.path) as archive:
                return member(archive, archive.getinfo(self.member), MAX_FILE)
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
            infos = [info for info in archive.infolist() if not info.is_dir()]
    except OSError as error:
        raise LabkitError(f"{error.filename or path}: cannot be read: {error.strerror}") from None
    except Exception as error:  # untrusted: zipfile raises anything
        raise LabkitError(
            f"{path}: is no folder and no zip archive ({error}); with one notebook or script, "
            f"say whose it is: --student NAME"
        ) from None
    return sorted(
        Handed(printable(info.filename), path, info.filename, info.date_time)
        for info in infos
        if not is_skipped(info.filename)
    )


def _in_folder(folder: Path) -> Iterator[Handed]:
    def refuse(error: OSError) -> None:
        raise error

    for root, directories, names in os.walk(folder, onerror=refuse):
        directories[:] = [name for name in directories if name not in SKIPPED]
        for name in names:
            path = Path(root, name)
            if path.is_file() and not path.is_symlink() and not is_skipped(name):
                changed = time.localtime(path.stat().st_mtime)[:6]
                yield Handed(printable(path.relative_to(folder).as_posix()), path, "", changed)


def read_files(handed_in: Sequence[Handed]) -> tuple[dict[str, bytes], tuple[str, ...]]:
    """The bytes of what may hold answers, as they lie there, and what was not read and why.

    The order is that in which the files were changed; of two of one time, the shorter name is last.
    """
    unread: list[str] = []
    found: dict[str, bytes] = {}
    left = MAX_TOGETHER
    sources = [file for file in handed_in if may_hold_source(file.name)]
    for file in sorted(sources, key=lambda one: likely_first(one.name)):
        try:
            data = file.read()
            left -= len(data)
            if left < 0 or len(data) > MAX_FILE:
                raise ValueError(
                    f"it is larger than {MAX_FILE >> 20} MiB, or all files together are too "
                    f"large; clear the outputs and hand it in again"
                )
            found[file.name] = data
        except Exception as error:  # untrusted: zipfile raises anything
            unread.append(f"{file.name} cannot be read: {error}")
    if not sources:
        names = ", ".join(file.name for file in handed_in[:5]) or "nothing"
        unread.append(f"no notebook (.ipynb) or script (.py) of your own is in it, but {names}")
    times = {file.name: (file.changed, -len(file.name), file.name) for file in sources}
    return {name: found[name] for name in sorted(found, key=times.__getitem__)}, tuple(unread)
