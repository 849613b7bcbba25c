"""How learning platforms name what a class handed in.

=============  ===================================================================
Canvas         ``lovelaceada_LATE_4711_98765_answers.ipynb``: name, user, upload
Moodle         ``Ada Lovelace_4711_assignsubmission_file_/answers.ipynb``, or without
               folders ``Ada Lovelace_4711_assignsubmission_file_answers.ipynb``
Blackboard     ``Lab 1_alovelace_attempt_2026-11-21-23-55-10_answers.ipynb``
D2L            ``1234-567 - Ada Lovelace - Nov 21, 2026 1155 PM/answers.ipynb``
nbgrader       ``submitted/ada/assignment1/answers.ipynb``
else           a folder for each student, or a file for each: ``ada.ipynb``
=============  ===================================================================
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import PurePosixPath

from labkit.course.grading.submissions.submission import Platform, may_hold_source

_CANVAS = re.compile(
    r"(?P<name>[^_/]+)(?P<late>_LATE)?_(?P<user>\d+)_(?P<upload>\d+)_(?P<file>[^/]+)$"
)
_AGAIN = re.compile(r"-\d+(?=\.\w+$)")  # answers-2.ipynb: answers.ipynb, uploaded again
# Moodle puts spaces for the underscores of a name: one that claims to hold two numbers is none.
_MOODLE = re.compile(
    r"(?P<name>[^/_]+)_(?P<id>\d+)_assignsubmission_(?:file|onlinetext)(?:_?/|_)"
    r"(?P<file>(?![^/]*_assignsubmission_).+)$"
)
_BLACKBOARD = re.compile(
    r"[^/]+?_(?P<id>[^/_]+)_attempt_(?P<time>\d{4}(?:-\d\d){5})(?:_(?P<file>[^/]+)|\.txt)$"
)
_D2L = re.compile(
    r"(?P<id>\d+)-\d+ - (?P<name>[^/]+) - (?P<day>\w{3} \d{1,2}, \d{4}) (?P<time>\d{3,4}) "
    r"(?P<half>[AP]M)/(?P<file>.+)$"
)
PLATFORMS = (_MOODLE, _BLACKBOARD, _D2L)  # each file's name tells them, whatever the others are


@dataclass(frozen=True, kw_only=True)
class Place:
    """Whose a file is.

    Attributes
    ----------
    student : str
        The platform's number of the student; else the name of the folder or file.
    name : str
        For a person.
    file : str
        The file's own name.
    platform : {"canvas", "moodle", "blackboard", "d2l", ""}
        Where the number comes from.
    late : bool
        Whether the platform marked it so.
    upload : int
        Canvas's number of the upload, or the time of the attempt: the higher the later; else 0.
    """

    student: str
    name: str
    file: str
    platform: Platform = ""
    late: bool = False
    upload: int = 0


def place_of(path: str, *, canvas: bool = True) -> Place:
    """Read the path of a file within what was downloaded; as Canvas's where that may be.

    Examples
    --------
    >>> place = place_of("lovelaceada_LATE_4711_98765_answers-1.ipynb")
    >>> place.student, place.name, place.file, place.platform, place.late, place.upload
    ('4711', 'lovelaceada', 'answers-1.ipynb', 'canvas', True, 98765)
    >>> place_of("Ada Lovelace_4711_assignsubmission_file_/answers.py").student
    '4711'
    >>> place_of("Lab_ada_attempt_2026-11-21-23-55-10_a.py").upload
    20261121235510
    >>> place_of("ada/week 3/answers.py").file, place_of("ada.ipynb.txt").student
    ('week 3/answers.py', 'ada')
    """
    if found := _MOODLE.match(path):
        return Place(student=found["id"], name=found["name"], file=found["file"], platform="moodle")
    if found := _BLACKBOARD.match(path):
        name, when = found["id"], int(found["time"].replace("-", ""))
        file = found["file"] or "attempt.txt"
        return Place(student=name, name=name, file=file, platform="blackboard", upload=when)
    if found := _D2L.match(path):
        return Place(
            student=found["id"],
            name=found["name"],
            file=found["file"],
            platform="d2l",
            upload=_time(f"{found['day']} {found['time']:0>4} {found['half']}"),
        )
    if canvas and (found := _CANVAS.match(path)):
        return Place(
            student=found["user"],
            name=found["name"],
            file=found["file"],
            platform="canvas",
            late=bool(found["late"]),
            upload=int(found["upload"]),
        )
    if "/" in path:
        student, file = path.split("/", 1)
        return Place(student=student, name=student, file=file)
    student = re.sub(r"(\.ipynb|\.py)?\.\w+$", "", path)
    return Place(student=student, name=student, file=path)


def _time(text: str) -> int:
    """When D2L says a file was handed in, as a number that grows; 0 where it says it oddly."""
    with suppress(ValueError):
        return int(datetime.strptime(text, "%b %d, %Y %I%M %p").strftime("%Y%m%d%H%M"))
    return 0


def canvas_clash(paths: Iterable[str]) -> tuple[str, str] | None:
    """Two files that Canvas would not name so: it numbers every user and every upload.

    >>> canvas_clash(["lovelaceada_4711_98765_a.py", "noetheremmy_815_98766_a.py"])
    >>> canvas_clash(["2024_1_2_ada.py", "2024_1_2_emmy.py"])
    ('2024_1_2_ada.py', '2024_1_2_emmy.py')
    """
    known: dict[tuple[str, str], tuple[str, str]] = {}
    for path in paths:
        if found := _CANVAS.match(path):
            for number, whose in (("user", found["name"]), ("upload", path)):
                first, other = known.setdefault((number, found[number]), (whose, path))
                if first != whose:
                    return other, path
    return None


def uploads(places: Iterable[Place]) -> dict[str, list[Place]]:
    """A Canvas student's uploads by the name of the file, the newest last.

    Canvas calls a second ``answers.py`` ``answers-1.py``. Where there is more than one such
    name and the plain one is not among them, the numbers are the student's own.

    Examples
    --------
    >>> def names(*files):
    ...     places = [place_of(f"ada_11_{k}_{file}") for k, file in enumerate(files)]
    ...     return {name: len(found) for name, found in uploads(places).items()}
    >>> names("answers.py", "answers-1.py"), names("answers-1.py"), names("a-1.py", "a-2.py")
    ({'answers.py': 2}, {'answers.py': 1}, {'a-1.py': 1, 'a-2.py': 1})
    """
    by_plain: dict[str, list[Place]] = {}
    for place in sorted(places, key=lambda place: place.upload):
        by_plain.setdefault(_AGAIN.sub("", place.file), []).append(place)
    found: dict[str, list[Place]] = {}
    for plain, same in by_plain.items():
        names = {place.file for place in same}
        numbered = len(names) > 1 and plain not in names
        for place in same:
            found.setdefault(place.file if numbered else plain, []).append(place)
    return found


def wrapping(paths: Collection[str], *, packed: bool) -> str:
    """The folder around what the students handed in, with its "/"; empty where there is none.

    nbgrader's is called ``submitted``. Any other has to hold folders of several students and
    no file of one's. In an archive, where one student alone is rare, it may hold their files:
    several notebooks or several archives. What can hold no answer tells nothing.

    Examples
    --------
    >>> class_files = ["lab 1/ada.ipynb", "lab 1/emmy.ipynb", "lab 1/Thumbs.db"]
    >>> wrapping(class_files, packed=True), wrapping(class_files, packed=False)
    ('lab 1/', '')
    >>> wrapping(["lab 1/ada/a.py", "lab 1/emmy/a.py"], packed=False)
    'lab 1/'
    """
    tops = {path.split("/", 1)[0] for path in paths if "/" in path or may_hold_source(path)}
    top = f"{tops.pop()}/" if len(tops) == 1 else ""
    inner = [path[len(top) :] for path in paths if path.startswith(top)]
    if not top or not any(inner) or any(one.match(f"{top}-") for one in PLATFORMS):
        return ""
    whole = whole_answers(inner)
    if top in {"submitted/", "submissions/"} or any(
        one.match(path) for one in PLATFORMS for path in inner
    ):
        return top
    enough = len(whole) > (0 if packed else 1)
    if enough and all(map(_CANVAS.match, whole)) and not canvas_clash(inner):
        return top
    parts = {path.split("/", 1)[0]: _kind(path) for path in whole}
    several = len(parts) > len(set(parts.values()))
    return top if several and (packed or set(parts.values()) == {"/"}) else ""


def whole_answers(paths: Iterable[str]) -> list[str]:
    """Files each of which may be all that a student handed in: scripts where there is no more."""
    sources = [path for path in paths if may_hold_source(path)]
    return [path for path in sources if not path.lower().endswith(".py")] or sources


def _kind(path: str) -> str:
    return "/" if "/" in path else PurePosixPath(path).suffix.lower()
