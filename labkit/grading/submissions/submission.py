"""What one student handed in, read when its turn comes: what may hold answers before the rest."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple

from labkit.errors import LabkitError
from labkit.grading.submissions.files import (
    MAX_TOGETHER,
    StoredFile,
    is_source,
    likely_first,
    may_hold_source,
    unzip,
)

MAX_FILES = 200  # notebooks and scripts of one student
PACKAGE = Path(__file__).parents[2]
KEPT_BACK = "authoring"  # the part of the package that no student gets

Platform = Literal["canvas", "moodle", "blackboard", "d2l", ""]
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
            try:
                data = file.read()
                if is_source(name):
                    read = {name: data}
                else:
                    read = {f"{name}/{inner}": held for inner, held in unzip(name, data).items()}
                if sum(map(len, read.values())) > left:
                    raise LabkitError(f"the files are too large together; {name} is not read")
            except LabkitError as error:
                unread.append(str(error))
                continue
            left -= sum(map(len, read.values()))
            yield from read.items()

    def _nothing(self, handed_out: int) -> str:
        if handed_out:
            return (
                "there is nothing in it but what was handed out; hand in the notebook with your "
                "answers"
            )
        if not self.files:
            return (
                "there is no notebook (.ipynb) or script (.py) in it; found nothing, and links "
                "are not followed"
            )
        names = ", ".join(name for name, _ in self.files[:5])
        return f"there is no notebook (.ipynb) or script (.py) in it; found {names}"


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
    given = {place: path for place, path in scripts.items() if place.parts[0] != KEPT_BACK}
    digests = (_digest(path.read_bytes()) for path in given.values())
    return frozenset(place.as_posix() for place in given), frozenset(digests)


def _digest(data: bytes) -> bytes:
    """Of a text, however its lines end."""
    return hashlib.sha256(data.replace(b"\r\n", b"\n").strip()).digest()


def _defined(data: bytes, functions: Iterable[str]) -> int:
    """How many of the functions a notebook or script seems to define."""
    defined = set(re.findall(rb"\bdef[ \t]+(\w+)", data))
    return sum(function.encode() in defined for function in functions)
