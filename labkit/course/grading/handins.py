"""Who handed in what: the files of a class, as learning platforms name them, read within bounds.

A class has one layout. Each is a pattern that is held against the platform's own part of a name,
from its beginning; whatever follows is the student's, and chooses neither place, time nor person.
"""

from __future__ import annotations

import os
import re
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from labkit.course.grading.files import (
    MAX_FILE,
    MEBIBYTE,
    SKIPPED,
    Handed,
    is_handed_out,
    is_skipped,
    is_source,
    likely_first,
    may_hold_source,
    printable,
    unzip,
)
from labkit.errors import LabkitError

MAX_TOGETHER = 48 * MEBIBYTE  # of all files of one student
MAX_FILES = 200  # notebooks and scripts of one student
FOLDERS, NBGRADER = "folders", "nbgrader"
LAYOUTS = {
    "canvas": re.compile(  # lovelaceada_LATE_4711_98765_answers.ipynb
        r"(?P<name>[^_/]+)_(?P<late>LATE_)?(?P<student>\d+)_(?P<upload>\d+)_(?P<file>[^/]+)$"
    ),
    "moodle": re.compile(  # Ada Lovelace_4711_assignsubmission_file_/answers.ipynb
        r"(?P<name>[^/_]+)_(?P<student>\d+)_assignsubmission_(?:file|onlinetext)(?:_?/|_)"
        r"(?P<file>.+)$"
    ),
    "gradescope": re.compile(  # submission_4711/answers.ipynb
        r"submission_(?P<student>\d+)/(?P<file>.+)$"
    ),
    NBGRADER: re.compile(  # submitted/ada/lab1/answers.ipynb
        r"(?:submitted/)?(?P<student>[^/]+)/(?P<assignment>[^/]+)/(?P<file>.+)$"
    ),
    FOLDERS: re.compile(  # ada/answers.ipynb, ada.ipynb, ada.zip
        r"(?P<student>[^/]+)/(?P<file>.+)$|(?P<alone>[^/]+?)(?P<suffix>(?:\.ipynb|\.py)?\.\w+)$"
    ),
}
OTHERS = {"submission_metadata.yml", "timestamp.txt", "roster.csv", "adjustments.csv"}


@dataclass(frozen=True, kw_only=True)
class Submission:
    """What one student handed in.

    Attributes
    ----------
    student : str
        Unique in the class: the platform's number, or the name of folder or file.
    name : str
        For a person.
    files : tuple of (str, Handed)
        Every file under its own name; the platform's part of the name is gone.
    late : float
        Days, as far as names tell it: Canvas says no more than "late", which counts as one.
    feedback_name : str
        The name under which its platform takes a page for this student back.
    """

    student: str
    name: str
    files: tuple[tuple[str, Handed], ...]
    late: float = 0.0
    feedback_name: str = ""

    def read(self) -> tuple[dict[str, bytes], tuple[str, ...]]:
        """Its notebooks and scripts, also those in archives, and what was not read and why.

        Whatever a file makes a reader raise is said of that file, and the others are read.
        """
        unread: list[str] = []
        found: dict[str, bytes] = {}
        handed_out, left = 0, MAX_TOGETHER
        sources = [(name, file) for name, file in self.files if may_hold_source(name)]
        for name, file in sorted(sources, key=lambda named: likely_first(named[0])):
            try:
                data = file.read()
                inner = {name: data} if is_source(name) else unzip(name, data, left)
                left -= sum(map(len, inner.values()))
                if left < 0 or len(data) > MAX_FILE:
                    raise LabkitError(
                        f"it is larger than {MAX_FILE // MEBIBYTE} MiB, or all files together "
                        f"are too large; clear the outputs and hand it in again"
                    )
            except Exception as error:  # untrusted: zipfile and its like raise anything
                unread.append(f"{name} cannot be read: {error}")
                continue
            for inside, content in inner.items():
                if is_handed_out(inside, content):
                    handed_out += 1
                elif len(found) < MAX_FILES:
                    found[inside] = content
                else:
                    unread.append(f"{inside} is not read: it is file {MAX_FILES + 1} or later")
        if not found and not unread:
            names = ", ".join(name for name, _ in self.files[:5]) or "nothing"
            unread.append(
                "there is nothing in it but what was handed out; hand in your own notebook"
                if handed_out
                else f"there is no notebook (.ipynb) or script (.py) in it; found {names}"
            )
        return found, tuple(unread[:40])


def find_submissions(
    path: str | os.PathLike[str],
    *,
    layout: str = "",
    within: str = "",
    left_out: Iterable[str | os.PathLike[str]] = (),
) -> tuple[list[Submission], list[str]]:
    """List the submissions in a folder or zip archive, by student.

    Parameters
    ----------
    path : path-like
        A class: a platform's bulk download, or a folder or file for each student.
    layout : str
        One of `LAYOUTS`; without it, the one that fits all files.
    within : str
        The folder in each student's that is graded, as of one of nbgrader's assignments.
    left_out : iterable of path-like
        Files and folders that are nobody's work, as that of the marks.

    Returns
    -------
    submissions : list of Submission
        Sorted by student, also those whose folder holds nothing to be graded.
    remarks : list of str
        What the instructor should know of how the names were read.

    Raises
    ------
    LabkitError
        Where `path` cannot be read, or no layout or more than one fits.
    """
    path = Path(path)
    if (path / "submitted").is_dir() and layout in ("", NBGRADER):
        path = path / "submitted"
    if path.resolve().name == "submitted":
        layout = layout or NBGRADER
    ours = [Path(one).resolve() for one in left_out]
    files = [
        file
        for file in list_files(path)
        if not any(file.path.resolve().is_relative_to(one) for one in ours)
        and PurePosixPath(file.name).name not in OTHERS
    ]
    if not files:
        raise LabkitError(
            f"{path}: nothing was handed in; name a folder or zip archive with one folder or "
            f"file for each student"
        )
    if not layout:
        layout, files = _layout_of(path, files)
    pattern, remarks = LAYOUTS[layout], []
    by_student: dict[str, list[tuple[re.Match[str], Handed]]] = {}
    for file in files:
        found = pattern.match(file.name)
        alone = found.groupdict().get("alone") if found else None
        if found is None or (alone and not may_hold_source(file.name)):
            remarks.append(f"{path}: {file.name} is nobody's work, and is passed over")
            continue
        by_student.setdefault(alone or found["student"], []).append((found, file))
    if within and layout != NBGRADER:
        raise LabkitError(f"--within {within} is for nbgrader's folders; these are {layout}'s")
    if layout == NBGRADER:
        by_student = _one_assignment(path, by_student, within)
    submissions = [_submission(student, found) for student, found in by_student.items()]
    return sorted(submissions, key=lambda one: one.student), remarks


def one_submission(path: str | os.PathLike[str], student: str) -> Submission:
    """All that a file, folder or zip archive holds, as one student's submission."""
    path = Path(path)
    if path.is_file() and is_source(path.name):
        listed = [Handed(printable(path.name), path, "")]
    else:
        listed = list_files(path)
    return Submission(
        student=student, name=student, files=tuple((file.name, file) for file in listed)
    )


def _layout_of(path: Path, files: list[Handed]) -> tuple[str, list[Handed]]:
    """The one layout that fits all files, and the files, without a folder around all of them."""
    tops = {file.name.partition("/")[0] for file in files if "/" in file.name}
    inner = [file._replace(name=file.name.partition("/")[2]) for file in files]
    if tops == {"submitted"} and all("/" in file.name for file in files):
        return NBGRADER, files
    names = [name for name in LAYOUTS if name not in (FOLDERS, NBGRADER)]
    for listed in (files, inner if len(tops) == 1 else []):
        fits = {n: [bool(LAYOUTS[n].match(file.name)) for file in listed] for n in names}
        whole = [name for name, each in fits.items() if listed and all(each)]
        if len(whole) == 1:
            return whole[0], listed
        some = [name for name, each in fits.items() if any(each) and not all(each)]
        if some:
            odd = next(
                file.name for file, fit in zip(listed, fits[some[0]], strict=True) if not fit
            )
            raise LabkitError(
                f"{path}: some names are {' and '.join(some)}'s, and {odd} is not; say "
                f"--layout {some[0]} or --layout {FOLDERS}, or take it out"
            )
    if len(tops) == 1 and all("/" in file.name for file in files):
        (top,) = tops
        raise LabkitError(
            f"{path}: all lies in one folder, {top}: if that is one student, say "
            f"--student {top}; if it is the class, unpack it and name {path / top}; if it is a "
            f"class of one, say --layout {FOLDERS}"
        )
    return FOLDERS, files


def _one_assignment(
    path: Path, by_student: dict[str, list[tuple[re.Match[str], Handed]]], within: str
) -> dict[str, list[tuple[re.Match[str], Handed]]]:
    """The files of one of nbgrader's assignments."""
    names = sorted({match["assignment"] for found in by_student.values() for match, _ in found})
    chosen = within or names[0]
    if chosen not in names or (len(names) > 1 and not within):
        raise LabkitError(
            f"{path}: the assignments are {', '.join(names)}, got {within or 'none of them'}; say "
            f"--within {names[0]}"
        )
    return {
        student: kept
        for student, found in by_student.items()
        if (kept := [one for one in found if one[0]["assignment"] == chosen])
    }


def _submission(student: str, found: Sequence[tuple[re.Match[str], Handed]]) -> Submission:
    """One student's files; of two with one name, as of two uploads, the newest counts."""
    parts = [(match.groupdict(), file) for match, file in found]
    parts.sort(key=lambda part: int(part[0].get("upload") or 0))
    first = parts[-1][0]
    name = first.get("name") or student
    feedback = f"{student.replace('/', '-')}.html"
    if first.get("upload"):
        feedback = f"{name}_{student}_{first['upload']}_feedback.html"
    elif first.get("name"):
        feedback = f"{name}_{student}_assignsubmission_file_/feedback.html"
    return Submission(
        student=student,
        name=name,
        files=tuple({part.get("file") or file.name: file for part, file in parts}.items()),
        late=float(any(part.get("late") for part, _ in parts)),
        feedback_name=feedback,
    )


def list_files(path: Path) -> list[Handed]:
    """The files of a folder or zip archive, by name; no link is followed.

    Raises
    ------
    LabkitError
        Where `path` is missing or cannot be read.
    """
    if path.is_dir():
        return sorted(_in_folder(path))
    try:
        with zipfile.ZipFile(path) as archive:
            members = [info.filename for info in archive.infolist() if not info.is_dir()]
    except FileNotFoundError:
        raise LabkitError(f"{path}: no such file or folder") from None
    except Exception as error:  # untrusted: zipfile raises anything
        strerror = getattr(error, "strerror", None)
        raise LabkitError(
            f"{path}: cannot be read: {strerror}"
            if strerror
            else f"{path}: is no folder and no zip archive ({error}); with one notebook or "
            f"script, say whose it is: --student NAME"
        ) from None
    found = [Handed(printable(name), path, name) for name in members]
    return sorted(file for file in found if not is_skipped(file.name))


def _in_folder(folder: Path) -> Iterator[Handed]:
    def refuse(error: OSError) -> None:
        raise LabkitError(f"{error.filename}: cannot be read: {error.strerror}") from None

    for root, directories, names in os.walk(folder, onerror=refuse):
        directories[:] = [name for name in directories if name not in SKIPPED]
        for name in names:
            path = Path(root, name)
            if path.is_file() and not path.is_symlink() and not is_skipped(name):
                yield Handed(printable(path.relative_to(folder).as_posix()), path, "")
