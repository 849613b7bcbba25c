"""Canvas: the gradebook's CSV, ``Student,ID,SIS User ID,SIS Login ID,Section,<title> (<id>)``."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from contextlib import suppress

from labkit.errors import LabkitError
from labkit.grading.exports.feedback import score_text
from labkit.grading.exports.gradebook import Row, Rows, read_gradebook, rows_of, write_gradebook
from labkit.grading.judging.verdict import SubmissionVerdict

KEYS = ["ID", "SIS User ID", "SIS Login ID"]
STUDENT = ["Student", *KEYS, "Section"]
NEEDED = ["Student", "ID"]
POINTS_POSSIBLE = "Points Possible"


def fill_canvas(
    verdicts: Iterable[SubmissionVerdict],
    gradebook: str | os.PathLike[str],
    title: str,
    out: str | os.PathLike[str],
) -> list[str]:
    """Write the scores of one assignment for Canvas to import, scaled to its points.

    Parameters
    ----------
    verdicts : iterable of SubmissionVerdict
        Their students are Canvas numbers (as in a bulk download), SIS numbers or logins, in
        this order: who is somebody's Canvas number is nobody's SIS number.
    gradebook : path-like
        The gradebook as exported from Canvas. Where its "Points Possible" are no number above
        zero, the scores stay as they are.
    title : str
        The assignment's column: its title, or "title (number)".
    out : path-like
        The CSV to write: the columns that say who a student is, and this one.

    Returns
    -------
    list of str
        The students that the gradebook does not have.

    Raises
    ------
    LabkitError
        Where the gradebook cannot be read, or has no such column; where a student is in two
        of its rows, or two are in one.
    """
    header, *rows = read_gradebook(gradebook, NEEDED)
    column = _column(header, title, gradebook)
    identity = [name for name in STUDENT if name in header]
    keys = [[row[header.index(name)].strip() for row in rows] for name in KEYS if name in header]
    possible = _points_possible(rows, column)
    scores = {verdict.student: score_text(verdict, possible) for verdict in verdicts}
    found = rows_of(scores, rows, keys, gradebook)
    graded = {place: scores[student] for student, place in found.items()}
    filled = [[*identity, header[column]]]
    for place, row in enumerate(rows):
        if place not in graded and not _is_points_possible(row):
            continue  # nothing was graded: Canvas keeps what it has
        score = graded.get(place, row[column])
        filled.append([*(row[header.index(name)] for name in identity), score])
    write_gradebook(out, filled)
    return sorted(scores.keys() - found.keys())


def check_canvas(gradebook: str | os.PathLike[str], title: str) -> None:
    """Raise, before any work, the `LabkitError` of a gradebook that no verdicts can fill in."""
    _column(read_gradebook(gradebook, NEEDED)[0], title, gradebook)


def _column(header: list[str], title: str, gradebook: str | os.PathLike[str]) -> int:
    places = [
        place
        for place, name in enumerate(header)
        if name == title or (name.startswith(f"{title} (") and name.endswith(")"))
    ]
    if len(places) == 1:
        return places[0]
    choice = ", ".join(name for name in header if name not in STUDENT)
    which = "no column" if not places else "more than one column"
    raise LabkitError(f"{gradebook}: line 1: {which} {title!r}; the columns are {choice}")


def _is_points_possible(row: Row) -> bool:
    return row[0].strip().startswith(POINTS_POSSIBLE)


def _points_possible(rows: Rows, column: int) -> float | None:
    """What the assignment is worth in Canvas; None where the gradebook does not say."""
    for row in filter(_is_points_possible, rows):
        with suppress(ValueError):
            points = float(row[column].replace(",", "."))
            return points if 0.0 < points < math.inf else None
    return None
