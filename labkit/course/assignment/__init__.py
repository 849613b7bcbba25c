"""The assignment of this course: its files, and where they are."""

from __future__ import annotations

from pathlib import Path

from labkit.grading.questions import Assignment, read_assignment

FOLDER = Path(__file__).parent


def load_assignment(*, hidden: bool = True) -> Assignment:
    """Read the course's assignment; the notebooks of students have no `hidden` cases.

    >>> load_assignment(hidden=False).question("huber_weights").signature
    '(residuals, delta)'
    """
    return read_assignment(FOLDER, hidden=hidden)
