"""What one student handed in, read when its turn comes."""

from __future__ import annotations

from dataclasses import dataclass

from labkit.errors import LabkitError
from labkit.grading.submissions.files import (
    MAX_FILE,
    MAX_FILES,
    StoredFile,
    is_source,
    may_hold_source,
    unzip,
)
from labkit.grading.submissions.layouts import Platform

Files = tuple[tuple[str, StoredFile], ...]


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
    platform : {"canvas", "moodle", ""}
        Where the download came from, as far as its names tell.
    late : bool
        Whether the platform marked it so.
    notes : tuple of str
        What the student should know of files that are left out.
    """

    student: str
    name: str
    files: Files
    platform: Platform = ""
    late: bool = False
    notes: tuple[str, ...] = ()

    def read(self) -> tuple[dict[str, bytes], tuple[str, ...]]:
        """The notebooks and scripts, and what the student should know of the rest.

        What an archive holds stands below the archive's name, ``work.zip/answers.ipynb``, so
        that no file hides another.
        """
        found: dict[str, bytes] = {}
        notes = list(self.notes)
        for name, file in self.files[:MAX_FILES]:
            read: dict[str, bytes] = {}
            try:
                if is_source(name):
                    read = {name: file.read()}
                elif may_hold_source(name):
                    inside = unzip(name, file.read())
                    read = {f"{name}/{inner}": data for inner, data in inside.items()}
                if sum(map(len, (found | read).values())) > 2 * MAX_FILE:
                    raise LabkitError(f"the files are too large together; {name} is not read")
                found |= read
            except LabkitError as error:
                notes.append(str(error))
        if len(self.files) > MAX_FILES:
            notes.append(f"{len(self.files)} files were handed in; the first {MAX_FILES} are read")
        if not found:
            handed_in = (
                ", ".join(name for name, _ in self.files[:5])
                or "nothing, and links are not followed"
            )
            notes.append(f"there is no notebook (.ipynb) or script (.py) in it; found {handed_in}")
        return found, tuple(notes)
