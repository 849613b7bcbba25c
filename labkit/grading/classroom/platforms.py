"""The platforms whose gradebooks are filled in, each by an option of its name."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

from labkit.grading.classroom.gradebooks import Gradebook, read_canvas, read_moodle
from labkit.grading.classroom.nbgrader import NbgraderBook, read_nbgrader

Book: TypeAlias = Gradebook | NbgraderBook


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
