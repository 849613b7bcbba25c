"""How learning platforms name what a class handed in.

=============  ===================================================================
Canvas         ``lovelaceada_LATE_4711_98765_answers.ipynb``: name, user, submission
Moodle         ``Ada Lovelace_4711_assignsubmission_file_/answers.ipynb``, or without
               folders ``Ada Lovelace_4711_assignsubmission_file_answers.ipynb``
nbgrader       ``submitted/ada/assignment1/answers.ipynb``
else           a folder for each student, or a file for each: ``ada.ipynb``
=============  ===================================================================
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

Platform = Literal["canvas", "moodle", ""]

_CANVAS = re.compile(
    r"(?P<name>[^_/]+)(?P<late>_LATE)?_(?P<user>\d+)_(?P<submission>\d+)_(?P<file>[^/]+)$"
)
_CANVAS_COPY = re.compile(r"-(\d+)(?=\.\w+$)")  # answers-2.ipynb: answers.ipynb, uploaded again
_MOODLE = re.compile(
    r"(?P<name>[^/]+?)_(?P<id>\d+)_assignsubmission_(?:file|onlinetext)(?:_?/|_)(?P<file>.+)$"
)


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
    platform : {"canvas", "moodle", ""}
        Where the number comes from.
    late : bool
        Whether the platform marked it so.
    copy : int
        Of two files of one name, the one with the higher number is newer.
    """

    student: str
    name: str
    file: str
    platform: Platform = ""
    late: bool = False
    copy: int = 0


def place_of(path: str) -> Place:
    """Read the path of a file within what was downloaded.

    Examples
    --------
    >>> place = place_of("lovelaceada_LATE_4711_98765_answers-1.ipynb")
    >>> place.student, place.name, place.file, place.platform, place.late
    ('4711', 'lovelaceada', 'answers.ipynb', 'canvas', True)
    >>> place_of("Ada Lovelace_4711_assignsubmission_file_/answers.py").student
    '4711'
    >>> place_of("ada/week 3/answers.py").file
    'week 3/answers.py'
    """
    if found := _MOODLE.match(path):
        return Place(student=found["id"], name=found["name"], file=found["file"], platform="moodle")
    if found := _CANVAS.match(path):
        copy = _CANVAS_COPY.search(found["file"])
        return Place(
            student=found["user"],
            name=found["name"],
            file=_CANVAS_COPY.sub("", found["file"]),
            platform="canvas",
            late=bool(found["late"]),
            copy=int(copy[1]) if copy else 0,
        )
    if "/" in path:
        student, file = path.split("/", 1)
        return Place(student=student, name=student, file=file)
    student = path.rsplit(".", 1)[0]
    return Place(student=student, name=student, file=path)


def without_wrapping(paths: list[str], *, packed: bool) -> int:
    """How many leading characters of every path are a folder around the students' folders.

    An archive often holds one such folder, and nbgrader's is called ``submitted``.
    """
    tops = {path.split("/", 1)[0] for path in paths}
    if len(tops) != 1:
        return 0
    top = tops.pop()
    inner = [path[len(top) + 1 :] for path in paths]
    wraps = packed or top in {"submitted", "submissions"}
    if not wraps or not all(inner) or _MOODLE.match(paths[0]):
        return 0
    students = all("/" in path for path in inner) or all(_CANVAS.match(path) for path in inner)
    return len(top) + 1 if students or top in {"submitted", "submissions"} else 0
