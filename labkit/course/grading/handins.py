"""Hand-ins: the files of a class, as learning platforms name them.

A class has one layout. Each is a pattern that is held against the platform's own part of a name,
from its beginning; whatever follows is the student's, and chooses neither place, time nor person.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import NamedTuple, TypeAlias

from labkit.course.grading.files import Handed, list_files
from labkit.course.grading.reading import is_source, may_hold_source, printable
from labkit.support.errors import LabkitError

FOLDERS, NBGRADER, SUBMITTED = "folders", "nbgrader", "submitted"
OTHERS = {"submission_metadata.yml", "timestamp.txt", "roster.csv", "adjustments.csv"}


class Layout(NamedTuple):
    """Names on a platform: of a student's file, and of the page that goes back."""

    pattern: re.Pattern[str]
    feedback: str = "{student}.html"


LAYOUTS = {
    "canvas": Layout(  # lovelaceada_LATE_4711_98765_answers.ipynb
        re.compile(
            r"(?P<name>[^_/]+)_(?P<late>LATE_)?(?P<student>\d+|(?<=^anon_)\w{5}|(?<=^anon_LATE_)\w{5})"
            r"_(?P<upload>\d+)_(?P<file>[^/]+)$"
        ),
        "{name}_{student}_{upload}_feedback.html",
    ),
    "moodle": Layout(  # Ada Lovelace_4711_assignsubmission_file_/answers.ipynb
        re.compile(
            r"(?P<name>[^/_]+)_(?P<student>\d+)_assignsubmission_(?:file|onlinetext)(?:_?/|_)"
            r"(?P<file>.+)$"
        ),
        "{name}_{student}_assignsubmission_file_/feedback.html",
    ),
    "gradescope": Layout(
        re.compile(r"(?:assignment_\d+_export/)?submission_(?P<student>\d+)/(?P<file>.+)$")
    ),
    NBGRADER: Layout(  # submitted/ada/lab1/answers.ipynb
        re.compile(r"(?:submitted/)?(?P<student>[^/]+)/(?P<lab>[^/]+)/(?P<file>.+)$")
    ),
    FOLDERS: Layout(  # ada/answers.ipynb, ada.ipynb, ada.zip
        re.compile(r"(?P<student>[^/]+?)(?:/(?P<file>.+)|(?:\.ipynb|\.py)?\.\w+)$")
    ),
}
PLATFORMS = ("canvas", "moodle", "gradescope")  # known by their names alone
Named: TypeAlias = tuple[dict[str, str], Handed]  # the parts of a name, and the file


@dataclass(frozen=True, kw_only=True)
class Submission:
    """The files that one student handed in."""

    student: str  # unique in the class: the platform's number, or the name of folder or file
    name: str  # for a person
    files: tuple[Handed, ...]  # each under its own name, without the platform's part
    late: float | None = None  # days, where names tell; Canvas's "late" counts as one
    feedback_name: str = ""  # under which its platform takes a page for this student back


def find_submissions(
    path: str | os.PathLike[str],
    *,
    layout: str = "",
    within: str = "",
    marks: str | os.PathLike[str] | None = None,
) -> tuple[list[Submission], list[str]]:
    """List the submissions in a folder or zip archive, by student, and what is nobody's.

    Parameters
    ----------
    path : path-like
        A class: a platform's bulk download, or a folder or file for each student.
    layout : str
        One of `LAYOUTS`; without it, the one that fits all files.
    within : str
        Which one of nbgrader's assignments.
    marks : path-like, optional
        The folder of the marks, which are nobody's work.

    Raises
    ------
    LabkitError
        Where `path` cannot be read, or no layout or more than one fits.
    """
    path = Path(path)
    if layout in ("", NBGRADER) and os.path.isdir(path / SUBMITTED):
        path /= SUBMITTED
    ours = Path(marks).resolve() if marks else None
    files = [
        file
        for file in list_files(path)
        if PurePosixPath(file.name).name not in OTHERS
        and not (ours and file.path.resolve().is_relative_to(ours))
    ]
    if not files:
        raise LabkitError(
            f"{path}: nothing was handed in; name a folder or zip archive with one folder or "
            f"file for each student"
        )
    layout = layout or _fitting(path, files)
    pattern, feedback = LAYOUTS[layout]
    folders = [one for one in path.iterdir() if one.is_dir()] if path.is_dir() else []
    empty = [one.name for one in folders if not any(map(Path.is_file, one.rglob("*")))]
    remarks = [f"{path}: {name} is an empty folder" for name in empty]
    named: dict[str, dict[str, list[Named]]] = {}  # by assignment and student
    for file in files:
        found = pattern.match(file.name)
        if found and (found["file"] or may_hold_source(file.name)):
            lab = named.setdefault(found.groupdict().get("lab", ""), {})
            own = file._replace(name=found["file"] or file.name)
            lab.setdefault(found["student"], []).append((found.groupdict(), own))
        else:
            remarks.append(f"{path}: {file.name} belongs to no student; skipped")
    if not named:
        raise LabkitError(
            f"{path}: no file name fits the {layout} layout (for example {files[0].name}); "
            f"choose another --layout"
        )
    chosen = within or min(named)
    if chosen not in named or (len(named) > 1 and not within):
        known = ", ".join(sorted(named)) or "not told apart by these names"
        raise LabkitError(f"{path}: the assignments are {known}, got --within {within!r}")
    return [_submission(one, feedback) for _, one in sorted(named[chosen].items())], remarks


def one_submission(path: str | os.PathLike[str], student: str) -> Submission:
    """One student's submission: the content of a file, folder or zip archive."""
    path = Path(path)
    alone = is_source(path.name) and os.path.isfile(path)
    listed = [Handed(printable(path.name), path)] if alone else list_files(path)
    name = printable(student)
    return Submission(student=name, name=name, files=tuple(listed))


def _fitting(path: Path, files: list[Handed]) -> str:
    """The one layout that fits all files."""
    if path.resolve().name == SUBMITTED or all(one.name.startswith("submitted/") for one in files):
        return NBGRADER
    for name in PLATFORMS:
        odd = [one.name for one in files if not LAYOUTS[name].pattern.match(one.name)]
        if not odd:
            return name
        if len(odd) < len(files):
            raise LabkitError(
                f"{path}: some names are {name}'s, and {odd[0]} is not; say --layout {name} or "
                f"--layout {FOLDERS}, or take it out"
            )
    tops = {file.name.partition("/")[0] for file in files}
    if len(tops) == 1 and all("/" in file.name for file in files):
        (top,) = tops
        raise LabkitError(
            f"{path}: all files are in one folder, {top}. If it is one student, use "
            f"--student {top}; if it is the class, unpack it and name the folder {top}; if it is "
            f"a class of one, use --layout {FOLDERS}"
        )
    return FOLDERS


def _submission(named: list[Named], feedback: str) -> Submission:
    """One student's files; of two with one name, as of two uploads, the newest counts."""
    named.sort(key=lambda one: int(one[0].get("upload") or 0))
    newest = named[-1][0]
    return Submission(
        student=newest["student"],
        name=newest.get("name") or newest["student"],
        files=tuple({file.name: file for _, file in named}.values()),
        late=float(any(parts["late"] for parts, _ in named)) if "late" in newest else None,
        feedback_name=feedback.format(**newest),
    )
