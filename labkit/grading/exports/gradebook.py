"""Gradebooks in CSV, filled in and otherwise left as the platform wrote them."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from labkit.errors import LabkitError
from labkit.files import atomic_write
from labkit.grading.exports.feedback import number
from labkit.grading.judging.verdict import SubmissionVerdict

FORMULA = (*"=+-@", *"＝＋－＠", "\t", "\r", "\n")  # the wide ones where people type Chinese
Row = list[str]
Rows = list[Row]


def read_gradebook(path: str | os.PathLike[str], columns: Sequence[str]) -> Rows:
    """The rows of a gradebook, header first, every row as long as the header.

    Raises
    ------
    LabkitError
        Where it cannot be read, or lacks one of `columns`; the message lists what it has.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise LabkitError(f"{path}: is no UTF-8 text; export the gradebook as CSV") from None
    except OSError as error:
        raise LabkitError(f"{path}: cannot be read: {error.strerror}") from None
    try:
        rows = [row for row in csv.reader(text.splitlines(keepends=True), strict=True) if row]
    except csv.Error as error:
        raise LabkitError(f"{path}: is no CSV file: {error}") from None
    if not rows:
        raise LabkitError(f"{path}: the gradebook is empty; export it again")
    header = [name.strip() for name in rows[0]]
    missing = [name for name in columns if name not in header]
    if missing:
        raise LabkitError(
            f"{path}: line 1: no column {missing[0]!r}; the columns are {', '.join(header)}"
        )
    for line, row in enumerate(rows, 1):
        if len(row) > len(header):
            raise LabkitError(f"{path}: row {line} has {len(row)} cells, the header {len(header)}")
    return [header, *(row + [""] * (len(header) - len(row)) for row in rows[1:])]


def rows_of(
    students: Iterable[str],
    rows: Rows,
    keys: Sequence[Sequence[str]],
    path: str | os.PathLike[str],
) -> dict[str, int]:
    """The place of each student's row among `rows`; without those who have none.

    Parameters
    ----------
    students : iterable of str
        Whom to look for.
    rows : list of list of str
        The gradebook without its header.
    keys : sequence of sequence of str
        Columns that say who a row is. A student that the first one holds is not looked for in
        the second: what is one student's number there may be another's here.
    path : path-like
        The gradebook, for messages.

    Raises
    ------
    LabkitError
        Where a student is in two rows, or two are in one.
    """
    holders: dict[str, list[int]] = {}
    for cells in reversed(keys):
        column: dict[str, list[int]] = {}
        for place, cell in enumerate(cells):
            column.setdefault(cell, []).append(place)
        holders |= column
    found: dict[str, int] = {}
    owners: dict[int, str] = {}
    for student in students:
        places = holders.get(student, [])
        if len(places) > 1:
            which = " and ".join(f"row {place + 2} ({rows[place][0]!r})" for place in places)
            raise LabkitError(f"{path}: student {student!r} is {which}; take the wrong one out")
        for place in places:
            other = owners.setdefault(place, student)
            if other != student:
                raise LabkitError(
                    f"{path}: row {place + 2} ({rows[place][0]!r}) is {other!r} and {student!r}; "
                    "grade one of the two submissions"
                )
            found[student] = place
    return found


def write_gradebook(path: str | os.PathLike[str], rows: Iterable[Sequence[str]]) -> None:
    """Write rows as CSV, whole or not at all."""
    with atomic_write(path) as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def plain(text: str) -> str:
    """Text that no spreadsheet takes for a formula.

    >>> plain("=1+1"), plain("＝1+1"), plain("well done")
    ("'=1+1", "'＝1+1", 'well done')
    """
    return "'" + text if text.startswith(FORMULA) else text


def write_scores(verdicts: Iterable[SubmissionVerdict], out: str | os.PathLike[str]) -> None:
    """Write ``student, submission, score, points, late, isolation`` and each question's score."""
    rows: list[list[str]] = []
    questions: dict[str, None] = {}
    scores: list[dict[str, str]] = []
    for verdict in verdicts:
        rows.append(
            [
                plain(verdict.student),
                plain(verdict.submission),
                number(verdict.score),
                number(verdict.points),
                f"{verdict.late:g}",
                verdict.mode,
            ]
        )
        scores.append({one.question: number(one.score) for one in verdict.questions})
        questions |= dict.fromkeys(scores[-1])
    header = ["student", "submission", "score", "points", "late", "isolation", *questions]
    body = [
        [*row, *(own.get(question, "") for question in questions)]
        for row, own in zip(rows, scores, strict=True)
    ]
    write_gradebook(out, [header, *body])
