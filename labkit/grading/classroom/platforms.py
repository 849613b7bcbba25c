"""The platforms whose gradebooks are filled in, each by an option of its name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, Protocol

from labkit.grading.classroom.gradebooks import Person, Unfilled, read_canvas, read_moodle
from labkit.grading.classroom.nbgrader import read_nbgrader
from labkit.grading.judge.verdict import SubmissionVerdict


class Book(Protocol):
    """A gradebook that can be filled in."""

    @property
    def people(self) -> Mapping[str, Person]:
        """Its students, by their names on the platform."""

    def fill(
        self, marks: Iterable[SubmissionVerdict], out: Path, *, overwrite: bool = False
    ) -> Unfilled:
        """Write it with the marks, and list those whose row is left out."""


class Platform(NamedTuple):
    """A platform, and the file that goes back to it."""

    returned: str  # the name of that file
    read: Callable[..., Book]
    arguments: tuple[str, ...]  # of the option; the first one is the gradebook's file
    says: str


GRADEBOOKS = {
    "canvas": Platform("canvas.csv", read_canvas, ("FILE", "COLUMN"), "Canvas's gradebook"),
    "moodle": Platform("moodle.csv", read_moodle, ("FILE",), "Moodle's grading worksheet"),
    "nbgrader": Platform(
        "nbgrader.db", read_nbgrader, ("FILE", "ASSIGNMENT"), "nbgrader's gradebook.db"
    ),
}
