"""Moodle: the offline grading worksheet, ``Identifier,...,Grade,...,Feedback comments``."""

from __future__ import annotations

import html
import os
from collections.abc import Iterable

from labkit.errors import LabkitError
from labkit.grading.exports.feedback import number, summary_text
from labkit.grading.exports.gradebook import Row, Rows, plain, read_gradebook, write_gradebook
from labkit.grading.verdict import SubmissionVerdict

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
        Where the worksheet cannot be read, or lacks a column.
    """
    header, *rows = read_gradebook(worksheet, NEEDED)
    place = {name: header.index(name) for name in header}
    by_number = {verdict.student: verdict for verdict in verdicts}
    found = set()
    for row, maximum in zip(rows, _maxima(worksheet, header, rows), strict=True):
        who = row[place["Identifier"]].removeprefix("Participant").strip()
        verdict = by_number.get(who)
        if verdict is None:
            continue
        found.add(who)
        scale = 1.0 if maximum is None or not verdict.points else maximum / verdict.points
        row[place["Grade"]] = number(verdict.score * scale)
        if "Feedback comments" in place:
            text = html.escape(summary_text(verdict)).replace("\n", "<br>")
            row[place["Feedback comments"]] = plain(text)
    write_gradebook(out, [header, *rows])
    return sorted(by_number.keys() - found)


def check_moodle(worksheet: str | os.PathLike[str]) -> None:
    """Raise the `LabkitError` that filling this worksheet in would raise, before any work."""
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
