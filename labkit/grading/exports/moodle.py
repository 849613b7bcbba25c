"""Moodle: the offline grading worksheet, ``Identifier,...,Grade,...,Feedback comments``."""

from __future__ import annotations

import html
import os
from collections.abc import Iterable

from labkit.errors import LabkitError
from labkit.grading.exports.feedback import score_text, summary_text
from labkit.grading.exports.gradebook import (
    Row,
    Rows,
    plain,
    read_gradebook,
    rows_of,
    write_gradebook,
)
from labkit.grading.judging.verdict import SubmissionVerdict

NEEDED = ["Identifier", "Grade"]


def fill_moodle(
    verdicts: Iterable[SubmissionVerdict],
    worksheet: str | os.PathLike[str],
    out: str | os.PathLike[str],
) -> list[str]:
    """Fill in grades and comments, scaled to the worksheet's maximum grade.

    Parameters
    ----------
    verdicts : iterable of SubmissionVerdict
        Their students are Moodle's numbers, as in a bulk download.
    worksheet : path-like
        The grading worksheet as downloaded; its times stay as they are, since Moodle takes
        no grade that is older than what it has.
    out : path-like
        The CSV to write.

    Returns
    -------
    list of str
        The students that the worksheet does not have.

    Raises
    ------
    LabkitError
        Where the worksheet cannot be read, or lacks a column; where a student is in two of
        its rows.
    """
    header, *rows = read_gradebook(worksheet, NEEDED)
    place = {name: header.index(name) for name in header}
    by_number = {verdict.student: verdict for verdict in verdicts}
    maxima = _maxima(worksheet, header, rows)
    numbers = [row[place["Identifier"]].removeprefix("Participant").strip() for row in rows]
    found = rows_of(by_number, rows, [numbers], worksheet)
    for student, n in found.items():
        row, maximum, verdict = rows[n], maxima[n], by_number[student]
        row[place["Grade"]] = score_text(verdict, maximum)
        if "Feedback comments" in place:
            text = html.escape(summary_text(verdict)).replace("\n", "<br>")
            row[place["Feedback comments"]] = plain(text)
    write_gradebook(out, [header, *rows])
    return sorted(by_number.keys() - found.keys())


def check_moodle(worksheet: str | os.PathLike[str]) -> None:
    """Raise, before any work, the `LabkitError` of a worksheet that no verdicts can fill in."""
    header, *rows = read_gradebook(worksheet, NEEDED)
    _maxima(worksheet, header, rows)


def _maxima(worksheet: str | os.PathLike[str], header: Row, rows: Rows) -> list[float | None]:
    """The maximum grade of each row; None where the worksheet has no such column."""
    if "Maximum Grade" not in header:
        return [None] * len(rows)
    column = header.index("Maximum Grade")
    return [_maximum(row[column], f"{worksheet}: row {n}") for n, row in enumerate(rows, 2)]


def _maximum(text: str, where: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise LabkitError(f"{where}: the maximum grade must be a number, got {text!r}") from None
