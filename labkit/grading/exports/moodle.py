"""Moodle: the offline grading worksheet, ``Identifier,...,Grade,...,Feedback comments``."""

from __future__ import annotations

import html
import os
import re
from collections.abc import Iterable, Mapping

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
_NUMBER = re.compile(r"\D*?(\d+)\s*")


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
    header, *rows = read_gradebook(worksheet, [])
    place = _columns(worksheet, header, rows)
    by_number = {verdict.student: verdict for verdict in verdicts}
    maxima = _maxima(worksheet, place, rows)
    numbers = [_NUMBER.sub(r"\1", row[place["Identifier"]]) for row in rows]
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
    header, *rows = read_gradebook(worksheet, [])
    _maxima(worksheet, _columns(worksheet, header, rows), rows)


def _columns(worksheet: str | os.PathLike[str], header: Row, rows: Rows) -> dict[str, int]:
    """Where the columns are, by their English names.

    Moodle translates the header, and keeps the order: who it is comes first ("Participant 12"),
    the maximum grade, one number in all rows, right after the grade, and the comments last.
    """
    if set(NEEDED) <= set(header):
        return {name: header.index(name) for name in header}
    identifiers = rows and all(_NUMBER.fullmatch(row[0]) for row in rows)
    maxima = [n for n in range(2, len(header)) if _are_one_number(row[n] for row in rows)]
    if not identifiers or not maxima:
        read_gradebook(worksheet, NEEDED)  # it says what is missing
    found = {"Identifier": 0, "Grade": maxima[0] - 1, "Maximum Grade": maxima[0]}
    last = len(header) - 1
    empty = last > maxima[0] and not any(row[last].strip() for row in rows)
    return found | ({"Feedback comments": last} if empty else {})


def _are_one_number(cells: Iterable[str]) -> bool:
    values = {cell.replace(",", ".").strip() for cell in cells}
    return len(values) == 1 and re.fullmatch(r"\d+(\.\d+)?", values.pop()) is not None


def _maxima(
    worksheet: str | os.PathLike[str], place: Mapping[str, int], rows: Rows
) -> list[float | None]:
    """The maximum grade of each row; None where the worksheet has no such column."""
    if "Maximum Grade" not in place:
        return [None] * len(rows)
    column = place["Maximum Grade"]
    return [_maximum(row[column], f"{worksheet}: row {n}") for n, row in enumerate(rows, 2)]


def _maximum(text: str, where: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise LabkitError(f"{where}: the maximum grade must be a number, got {text!r}") from None
