"""The submissions of a class, whichever way it was collected."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from labkit.course.grading.submissions.layouts import (
    Place,
    canvas_clash,
    place_of,
    uploads,
    whole_answers,
    wrapping,
)
from labkit.course.grading.submissions.submission import (
    Files,
    StoredFile,
    Submission,
    is_skipped,
    is_source,
    list_files,
    may_hold_source,
    printable,
)
from labkit.errors import LabkitError

ATTEMPTS = {"blackboard", "d2l"}  # platforms that hand out every attempt whole
NBGRADERS = ("source", "release", "nbgrader_config.py", "gradebook.db")  # beside `submitted`
VERDICTS = "verdicts.jsonl"  # the file by which a folder of verdicts and pages is known
PAGES = "students/"  # a folder in it
NOTHING = (
    "nothing was handed in; name a notebook, a script, or a folder or zip archive with one "
    "folder or file for each student"
)


def find_submissions(
    path: str | os.PathLike[str],
    remarks: list[str] | None = None,
    *,
    out: str | os.PathLike[str] | None = None,
    within: str = "",
) -> list[Submission]:
    """List the submissions in a file, folder or zip archive, by student.

    Parameters
    ----------
    path : path-like
        One notebook or script, or a class: a folder or zip archive with a folder or a file
        for each student, or a bulk download of Canvas, Moodle or nbgrader.
    remarks : list of str, optional
        Gets what the instructor should know of how the names were read.
    out : path-like, optional
        Where verdicts are written. It is left out, as are folders with verdicts of earlier
        runs and nobody's work.
    within : str
        The folder in each student's that is graded; all of it where this is empty.

    Returns
    -------
    list of Submission
        Sorted by student, also those whose folder holds nothing. What a Canvas student
        uploaded twice under one name counts once, the newer upload. Other files that lie
        beside the students' ones are passed over.

    Raises
    ------
    LabkitError
        Where `path` is missing or cannot be read, or holds nothing.
    """
    path = Path(path)
    remarks = [] if remarks is None else remarks
    if (path / "submitted").is_dir() and any((path / name).exists() for name in NBGRADERS):
        path /= "submitted"
        remarks.append(f"{path}: this is graded, of nbgrader's course folder")
    if path.is_file() and is_source(path.name):
        return [one_submission(path)]
    listed = list_files(path)
    names = [file.name for file in listed]
    left_out = _outputs(path, names, out, remarks)
    listed = [file for file in listed if not file.name.startswith(left_out)]
    if not listed:
        raise LabkitError(f"{path}: {NOTHING}")
    around = _around(path, [file.name for file in listed], left_out)
    by_student = _by_student(path, listed, around, remarks)
    if within:
        by_student = {
            student: kept
            for student, found in by_student.items()
            if (kept := list(_inside(found, f"{within.rstrip('/')}/")))
        }
        if not by_student:
            raise LabkitError(
                f"{path}: no student has a folder {within!r} to look into; found "
                f"{_some([file.name for file in listed])}"
            )
    elif path.name == "submitted" or around == "submitted/":
        remarks += _several_assignments(path, by_student.values())
    submissions = [_submission(found) for found in by_student.values()]
    if any("/" in file.name[len(around) :] for file in listed):  # each has a folder, maybe empty
        plain = any(not one.platform for one in submissions)
        places = (place_of(f"{each}/-") for each in _folders(path, around, left_out))
        submissions += [
            Submission(student=place.student, name=place.name, files=(), platform=place.platform)
            for place in places
            if place.student not in by_student and (place.platform or plain)
        ]
    if not submissions:
        raise LabkitError(f"{path}: {NOTHING}; found {_some([file.name for file in listed])}")
    if len(submissions) == 1:
        remarks += _doubts(path, submissions[0])
    return sorted(submissions, key=lambda one: one.student)


def one_submission(path: str | os.PathLike[str], student: str = "") -> Submission:
    """All that a file, folder or zip archive holds, as one student's submission.

    Raises
    ------
    LabkitError
        Where it is missing or cannot be read.
    """
    path = Path(path)
    name = student or printable(path.resolve().stem)
    if path.is_file() and is_source(path.name):
        shown = printable(path.name)
        file = StoredFile(name=shown, path=path, member="", size=path.stat().st_size)
        listed = [file]
    else:
        listed = list_files(path)
    return Submission(student=name, name=name, files=tuple((file.name, file) for file in listed))


def _by_student(
    path: Path, listed: Sequence[StoredFile], around: str, remarks: list[str]
) -> dict[str, list[tuple[Place, StoredFile]]]:
    """Each student's files; what lies beside them goes to the remarks."""
    inner = {file.name: file.name.removeprefix(around) for file in listed}
    clash = canvas_clash(inner.values())
    if clash:
        remarks.append(
            f"{path}: {clash[0]} and {clash[1]} have a number in common that Canvas gives once, "
            f"so that each file goes by its own name"
        )
    by_student: dict[str, list[tuple[Place, StoredFile]]] = {}
    beside = []
    for file in listed:
        place = place_of(inner[file.name], canvas=not clash)
        if place.platform or place.file != inner[file.name] or may_hold_source(place.file):
            by_student.setdefault(place.student, []).append((place, file))
        else:
            beside.append(file.name)
    remarks += _passed_over(path, beside)
    return by_student


def _inside(
    found: Sequence[tuple[Place, StoredFile]], folder: str
) -> Iterator[tuple[Place, StoredFile]]:
    """The files of one of a student's folders, by their names in it."""
    for place, file in found:
        if place.file.startswith(folder):
            yield replace(place, file=place.file.removeprefix(folder)), file


def _several_assignments(
    path: Path, students: Iterable[Sequence[tuple[Place, StoredFile]]]
) -> list[str]:
    """What to say where nbgrader's students have handed in more than one assignment."""
    own = [
        {place.file.split("/")[0] for place, _ in found if "/" in place.file} for found in students
    ]
    names = sorted(set().union(*own))
    if max(map(len, own), default=0) < 2:
        return []
    return [
        f"{path}: it holds the assignments {_some(names)}, which are taken for one; grade one of "
        f"them with --within {names[0]}"
    ]


def _outputs(
    path: Path,
    names: Sequence[str],
    out: str | os.PathLike[str] | None,
    remarks: list[str],
) -> tuple[str, ...]:
    """The folders below `path` that the grader wrote or will write, each with its "/"."""
    own = folder_below(path, out) if out is not None else ""
    hidden = [name for name in names if own and name.startswith(own) and is_source(name)]
    if hidden:
        remarks.append(
            f"{path}: {hidden[0]} is not graded, since verdicts go to {own}; choose another --out "
            f"if it is a student's"
        )
    earlier = [folder for folder in earlier_outputs(names) if folder != own]
    remarks += [f"{path}: {folder} is left out: an earlier run wrote it" for folder in earlier]
    return (*earlier, own) if own else tuple(earlier)


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


def _folders(path: Path, inside: str, left_out: Sequence[str]) -> list[str]:
    """Names of the folders right inside one of a folder or archive, those without a file too.

    Those in which the grader writes are left out. `inside` is the name of a folder right in
    `path`, with its "/"; empty for `path` itself.
    """
    if path.is_dir():
        around = [each for each in path.iterdir() if f"{printable(each.name)}/" == inside] or [path]
        below = [printable(each.name) for each in around[0].iterdir() if each.is_dir()]
    else:
        with zipfile.ZipFile(path) as archive:
            folders = [printable(info.filename) for info in archive.infolist() if info.is_dir()]
        below = [name[len(inside) :] for name in folders if name.startswith(inside)]
    names = {name.split("/", 1)[0] for name in below} - {""}
    return sorted(
        name
        for name in names
        if not is_skipped(name) and not any(one.startswith(f"{inside}{name}/") for one in left_out)
    )


def _around(path: Path, names: Sequence[str], left_out: Sequence[str]) -> str:
    """The folder around the students' files, by name; in nbgrader's own, folders are students."""
    if path.resolve().name == "submitted":
        return ""
    folders = [f"{each}/" for each in _folders(path, "", left_out)]
    return wrapping([*names, *folders], packed=path.is_file())


def _passed_over(path: Path, names: Sequence[str]) -> list[str]:
    """What to say of files beside the students' ones, which may be someone's work all the same."""
    if not names:
        return []
    return [
        f"{path}: passed over, as no notebook (.ipynb), script (.py) or zip archive: "
        f"{_some(names)}; convert or unpack what is a student's work"
    ]


def _some(names: Sequence[str]) -> str:
    """A few names, and how many there are where these are not all."""
    return ", ".join(names[:5]) + (f", ... ({len(names)} in all)" if len(names) > 5 else "")


def _doubts(path: Path, alone: Submission) -> list[str]:
    """What to say of a class of one with several answers: they may be a class's."""
    several = whole_answers(alone.read()[0])
    if len(several) < 2:
        return []
    return [
        f"{path}: {several[0]} and {len(several) - 1} more are taken for the work of one student, "
        f"{alone.student!r}; if they are several students', name the folder that holds a folder "
        f"or a file for each; if not, --student {alone.student!r} says so"
    ]


def _submission(found: Sequence[tuple[Place, StoredFile]]) -> Submission:
    first = found[0][0]
    if first.platform == "canvas":
        files, notes = _uploaded(found)
    elif first.platform in ATTEMPTS:
        files, notes = _attempted(found)
    else:
        files, notes = _named(found), ()
    return Submission(
        student=first.student,
        name=first.name,
        files=files,
        platform=first.platform,
        late=any(place.late for place, _ in found),
        notes=notes,
        upload=max(place.upload for place, _ in found),
    )


def _named(found: Sequence[tuple[Place, StoredFile]]) -> Files:
    """The files by their own names; by their whole paths where two would have one name."""
    files = {place.file: file for place, file in found}
    if len(files) < len({file.name for _, file in found}):
        files = {file.name: file for _, file in found}
    return tuple(files.items())


def _attempted(
    found: Sequence[tuple[Place, StoredFile]],
) -> tuple[Files, tuple[str, ...]]:
    """The files of the newest attempt, and a note on the others."""
    times = {place.upload for place, _ in found}
    newest = [(place, file) for place, file in found if place.upload == max(times)]
    note = f"it was handed in {len(times)} times; the newest attempt counts"
    return _named(newest), (note,) if len(times) > 1 else ()


def _uploaded(found: Sequence[tuple[Place, StoredFile]]) -> tuple[Files, tuple[str, ...]]:
    """The newest upload of each file, and a note on those that it replaces."""
    stored = dict(found)
    by_name = uploads(stored)
    files = tuple((name, stored[places[-1]]) for name, places in by_name.items())
    notes = tuple(
        f"{name} was uploaded {len(places)} times; the newest counts, {places[-1].file}"
        for name, places in by_name.items()
        if len(places) > 1
    )
    return files, notes
