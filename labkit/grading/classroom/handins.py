"""Hand-ins: the files of a class, as learning platforms name them, in a folder or zip archive.

A class has one layout. Each is a pattern that is held against the platform's own part of a name,
from its beginning; whatever follows is the student's, and chooses neither place, time nor person.
"""

from __future__ import annotations

import os
import re
import time
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from labkit.grading.box.inside.limits import MAX_FILE, MAX_TOGETHER
from labkit.grading.box.inside.reading import (
    SOURCES,
    TOO_LARGE,
    is_skipped,
    is_source,
    may_hold_source,
    printable,
)
from labkit.support.errors import LabkitError

FOLDERS = "folders"
METADATA = "submission_metadata.yml"  # of Gradescope's export: who handed in what
# A file with such an ending is a student's work, though the grader reads only the first few kinds.
WORK = (*SOURCES, ".zip", ".rar", ".7z", ".tar", ".gz", ".pdf", ".html", ".docx")
# Names on a platform: of a student's file, and of the page that goes back.
LAYOUTS = {
    "canvas": (  # lovelaceada_LATE_4711_98765_answers.ipynb
        r"(?P<name>[^_/]+)_(?P<late>LATE_)?(?P<student>\d+|(?<=^anon_)\w{5}|(?<=^anon_LATE_)\w{5})"
        r"_(?P<upload>\d+)_(?P<file>[^/]+)$",
        "{name}_{student}_{upload}_feedback.html",
    ),
    "moodle": (  # Ada Lovelace_4711_assignsubmission_file_/answers.ipynb
        # A name may hold "_" where a folder follows: all up to its last number is the platform's.
        # Where the file follows, too, it may if that part stands there once.
        r"(?P<name>[^/]+(?=_\d+_assignsubmission_(?:file|onlinetext)_?/)|[^/_]+"
        r"|(?!.*_assignsubmission_.*_assignsubmission_)[^/]+)"
        r"_(?P<student>\d+)_assignsubmission_(?:file|onlinetext)(?:_?/|_)(?P<file>.+)$",
        "{name}_{student}_assignsubmission_file_/feedback.html",
    ),
    "gradescope": (  # which takes no pages back: each member's has the member's name
        r"(?:assignment_\d+_export/)?submission_(?P<student>\d+)/(?P<file>.+)$",
        "",
    ),
    FOLDERS: (  # ada/answers.ipynb, ada.ipynb, ada.zip; nbgrader's ada/lab1/answers.ipynb
        r"(?P<student>[^/]+?)(?:/(?P<file>.+)|(?:\.ipynb|\.py)?\.\w+)$",
        "{student}.html",
    ),
}


class Handed(NamedTuple):
    """A file on disk, or in a zip archive on disk."""

    name: str  # its path below what was listed, printable, with "/" between the parts
    path: Path  # the file, or the archive that holds it
    member: str = ""  # its name in the archive
    changed: tuple[int, ...] = ()  # year, month, ... second, as the file system or archive says

    def read(self) -> bytes:
        """Read it all, up to a byte more than `MAX_FILE`."""
        if self.member:
            with open_archive(self.path, self.path.stat().st_mtime_ns).open(self.member) as packed:
                return packed.read(MAX_FILE + 1)
        with self.path.open("rb") as file:
            return file.read(MAX_FILE + 1)


@lru_cache(maxsize=1)
def open_archive(path: Path, _changed: int) -> zipfile.ZipFile:
    """The archive of a class, opened once for all its files: its list of them may be long."""
    return zipfile.ZipFile(path)


@dataclass(frozen=True, kw_only=True)
class Submission:
    """The files that one student handed in."""

    student: str  # unique in the class: the platform's number, or the name of folder or file
    name: str  # for a person
    files: tuple[Handed, ...]  # each under its own name, without the platform's part
    late: float | None = None  # days, where names tell; Canvas's "late" counts as one
    feedback_name: str = ""  # under which its platform takes a page for this student back


def find_submissions(
    path: str | os.PathLike[str], *, layout: str = "", out: Path | None = None
) -> tuple[list[Submission], list[str], list[str]]:
    """List the submissions of a class, by student, files with code of no student, and remarks.

    Without a `layout` the one counts that fits all files. Files in `out` are skipped.
    """
    path = Path(path)
    if os.path.isdir(path / "submitted"):  # in a course of nbgrader
        path /= "submitted"
    files = list_files(path)
    folders_with_files = {file.name.partition("/")[0] for file in files}
    if out:
        results = out.resolve()
        files = [file for file in files if not file.path.resolve().is_relative_to(results)]
    if not files:
        raise LabkitError(
            f"{path}: nothing was handed in; name a folder or zip archive with one folder or "
            f"file for each student"
        )
    lost, remarks = list[str](), list[str]()
    for folder in find_results(files):
        files = [file for file in files if not file.name.startswith(f"{folder}/")]
        remarks.append(f"{path}: {folder} holds results of `labkit grade`; skipped")
    layout = layout or _detect_layout(path, files)
    pattern, feedback = LAYOUTS[layout]
    named: dict[str, list[tuple[dict[str, str], Handed]]] = {}  # parts of a name, by student
    for file in files:
        parts = re.match(pattern, file.name)
        if parts and (parts["file"] or file.name.lower().endswith(WORK)):
            renamed = file._replace(name=parts["file"] or file.name)
            named.setdefault(parts["student"], []).append((parts.groupdict(), renamed))
        elif may_hold_source(file.name):
            lost.append(file.name)
        else:
            remarks.append(f"{path}: {file.name} belongs to no student; skipped")
    if not named:
        raise LabkitError(
            f"{path}: no file name fits the {layout} layout (for example {files[0].name}); "
            f"choose another --layout"
        )
    submissions = [_submission(files_of_one, feedback) for files_of_one in named.values()]
    for folder in list_folders(path):
        parts = re.match(pattern, f"{folder}/nothing")
        if parts and folder not in folders_with_files and not is_skipped(folder):
            nothing = Handed("", path)
            empty = _submission([(parts.groupdict(), nothing)], feedback)
            submissions.append(replace(empty, files=()))
            remarks.append(f"{path}: {folder} is an empty folder")
    members = read_members(path) if layout == "gradescope" else {}
    by_student = [
        replace(submission, student=student, name=name)
        for submission in submissions
        for student, name in members.get(
            submission.student, [(submission.student, submission.name)]
        )
    ]
    return sorted(by_student, key=lambda submission: submission.student), lost, remarks


def find_results(files: Sequence[Handed]) -> list[str]:
    """The folders among the files that hold results of an earlier run, and no hand-in."""
    tables = [file.name for file in files if file.name.endswith("/adjustments.csv")]
    folders = [table.rpartition("/")[0] for table in tables]
    names = [file.name for file in files]
    return [
        folder
        for folder in folders
        if any(name.startswith(f"{folder}/verdicts/") for name in names)
    ]


def read_members(path: Path) -> dict[str, list[tuple[str, str]]]:
    """Students of each submission in Gradescope's export, by its number: e-mail and name."""
    texts = []
    if path.is_dir():
        texts = [file.read_bytes() for file in path.rglob(METADATA)]
    else:
        archive = open_archive(path, path.stat().st_mtime_ns)
        texts = [archive.read(name) for name in archive.namelist() if name.endswith(METADATA)]
    members: dict[str, list[tuple[str, str]]] = {}
    for block in re.split(r"(?m)^(?=\S)", b"\n".join(texts[:1]).decode("utf-8", "replace")):
        number = re.match(r"submission_(\d+):", block)
        _, _, people = block.partition(":submitters:")
        people = re.split(r"(?m)^  :", people)[0]  # up to the submission's next field
        for person in re.split(r"(?m)^ *- ", people)[1:]:
            fields = dict(re.findall(r"(?m)^ *:(\w+): *['\"]?(.*?)['\"]? *$", person))
            student = fields.get("email") or fields.get("sid") or fields.get("name")
            if number and student:
                name = printable(fields.get("name") or student)
                members.setdefault(number[1], []).append((printable(student), name))
    return members


def _detect_layout(path: Path, files: list[Handed]) -> str:
    """The one layout that fits all files."""
    for name in LAYOUTS:
        if name == FOLDERS:
            continue
        misfits = [file.name for file in files if not re.match(LAYOUTS[name][0], file.name)]
        if not misfits:
            return name
        if len(misfits) < len(files):
            raise LabkitError(
                f"{path}: some files are named as {name} names them, but {misfits[0]} is not; use "
                f"--layout {name} or --layout {FOLDERS}, or take that file out"
            )
    top, inside, _ = files[0].name.partition("/")
    if inside and all(file.name.startswith(f"{top}/") for file in files):
        raise LabkitError(
            f"{path}: all files are in one folder, {top}. If it is one student, use "
            f"--layout {FOLDERS}; if it is the class, unpack it and name the folder {top}"
        )
    return FOLDERS


def _submission(named: list[tuple[dict[str, str], Handed]], feedback: str) -> Submission:
    """One student's files; of two with one name, as of two uploads, the newest counts."""
    named.sort(key=lambda parts_and_file: int(parts_and_file[0].get("upload") or 0))
    newest, _ = named[-1]
    return Submission(
        student=newest["student"],
        name=newest.get("name") or newest["student"],
        files=tuple({file.name: file for _, file in named}.values()),
        late=float(any(parts["late"] for parts, _ in named)) if "late" in newest else None,
        feedback_name=feedback.format(**newest),
    )


def one_submission(path: Path, student: str) -> Submission:
    """One student's submission: the content of a folder."""
    name = printable(student)
    return Submission(student=name, name=name, files=tuple(list_files(path)))


def list_files(path: Path) -> list[Handed]:
    """The files of a folder or zip archive, by name, or a single one; no link is followed."""
    try:
        if os.path.isdir(path):
            return sorted(_in_folder(path))
        changed = path.stat().st_mtime_ns
        if is_source(path.name):
            return [Handed(printable(path.name), path)]
        infos = [info for info in open_archive(path, changed).infolist() if not info.is_dir()]
    except OSError as error:
        raise LabkitError(f"{error.filename or path}: cannot be read: {error.strerror}") from None
    except Exception as error:  # untrusted: zipfile raises anything
        raise LabkitError(
            f"{path}: is no folder, zip archive, notebook or script: {error}"
        ) from None
    return sorted(
        Handed(printable(info.filename), path, info.filename, info.date_time)
        for info in infos
        if not is_skipped(info.filename)
    )


def list_folders(path: Path) -> list[str]:
    """The folders at the top of a folder or zip archive, by name: those without a file, too."""
    if path.is_dir():
        names = [folder.name for folder in path.iterdir() if folder.is_dir()]
    elif is_source(path.name):
        names = []
    else:
        infos = open_archive(path, path.stat().st_mtime_ns).infolist()
        names = [info.filename.partition("/")[0] for info in infos if info.is_dir()]
    return sorted({printable(name) for name in names})


def _in_folder(folder: Path) -> Iterator[Handed]:
    def refuse(error: OSError) -> None:
        raise error

    for root, directories, names in os.walk(folder, onerror=refuse):
        directories[:] = [name for name in directories if not is_skipped(name)]
        for name in names:
            path = Path(root, name)
            if path.is_file() and not path.is_symlink() and not is_skipped(name):
                changed = time.localtime(path.stat().st_mtime)[:6]
                yield Handed(printable(path.relative_to(folder).as_posix()), path, "", changed)


def read_files(handed_in: Sequence[Handed]) -> tuple[dict[str, bytes], tuple[str, ...]]:
    """The bytes of the files, from old to new, and what could not be read and why.

    Of two files of one time the shorter name is last. A file that can hold no answer is empty.
    """
    contents: dict[str, bytes] = {}
    unread: list[str] = []
    bytes_left = MAX_TOGETHER
    for file in sorted(handed_in, key=lambda file: (file.changed, -len(file.name)), reverse=True):
        try:
            data = file.read() if may_hold_source(file.name) else b""
            if len(data) > min(bytes_left, MAX_FILE):
                raise ValueError(TOO_LARGE)
            contents[file.name] = data
            bytes_left -= len(data)
        except Exception as error:  # untrusted: zipfile raises anything
            unread.append(f"{file.name} cannot be read: {error}")
    return dict(reversed(contents.items())), tuple(unread)
