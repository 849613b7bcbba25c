"""What goes back to a learning platform: grades in its gradebook, pages packed under its names.

Canvas takes the gradebook's CSV, ``Student,ID,SIS User ID,SIS Login ID,Section,<title> (<id>)``;
Moodle the offline grading worksheet, ``Identifier,...,Grade,...,Feedback comments``. They are
filled in and otherwise left as the platform wrote them. Any other platform gets ``scores.csv``.
"""

from __future__ import annotations

import csv
import html
import math
import os
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from labkit.course.grading.feedback import number, score_text, summary_text
from labkit.course.grading.handins import Submission
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.errors import LabkitError
from labkit.files import atomic_write, read_table

FORMULA = (*"=+-@", *"＝＋－＠", "\t", "\r", "\n")  # the wide ones where people type Chinese
Row = list[str]
Rows = list[Row]
CANVAS_KEYS = ["ID", "SIS User ID", "SIS Login ID"]
CANVAS_STUDENT = ["Student", *CANVAS_KEYS, "Section"]
CANVAS_NEEDED = ["Student", "ID"]
POINTS_POSSIBLE = "Points Possible"
MOODLE_NEEDED = ["Identifier", "Grade"]
_NUMBER = re.compile(r"\D*?(\d+)\s*")


def read_gradebook(path: str | os.PathLike[str], columns: Sequence[str]) -> Rows:
    """The rows of a gradebook, header first, every row as long as the header.

    Raises
    ------
    LabkitError
        Where it cannot be read, or lacks one of `columns`; the message lists what it has.
    """
    text = read_table(path, "export the gradebook as CSV")
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


def write_scores(
    marks: Iterable[SubmissionVerdict], missing: Mapping[str, str], out: str | os.PathLike[str]
) -> None:
    """Write a row for each student: score, days late and each question's score.

    Parameters
    ----------
    marks : iterable of SubmissionVerdict
        All marks.
    missing : mapping of str to str
        Those who handed in nothing, and their names: rows without a score.
    out : path-like
        The CSV.
    """
    header = ["student", "submission", "score", "points", "late", "isolation"]
    rows: list[dict[str, str]] = [{"student": plain(one)} for one in missing]
    for mark in marks:
        own = (mark.student, mark.submission, number(mark.score), number(mark.points))
        row = dict(zip(header, [*map(plain, own), f"{mark.late:.3g}", mark.mode], strict=True))
        rows.append(row | {one.question: number(one.score) for one in mark.questions})
    columns = list(dict.fromkeys([*header, *(name for row in rows for name in row)]))
    write_gradebook(out, [columns, *([row.get(name, "") for name in columns] for row in rows)])


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
    header, *rows = read_gradebook(gradebook, CANVAS_NEEDED)
    column = _canvas_column(header, title, gradebook)
    identity = [name for name in CANVAS_STUDENT if name in header]
    keys = [
        [row[header.index(name)].strip() for row in rows] for name in CANVAS_KEYS if name in header
    ]
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
    _canvas_column(read_gradebook(gradebook, CANVAS_NEEDED)[0], title, gradebook)


def _canvas_column(header: list[str], title: str, gradebook: str | os.PathLike[str]) -> int:
    places = [
        place
        for place, name in enumerate(header)
        if name == title or (name.startswith(f"{title} (") and name.endswith(")"))
    ]
    if len(places) == 1:
        return places[0]
    choice = ", ".join(name for name in header if name not in CANVAS_STUDENT)
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


def fill_moodle(
    verdicts: Iterable[SubmissionVerdict],
    worksheet: str | os.PathLike[str],
    out: str | os.PathLike[str],
) -> list[str]:
    """Fill in grades and comments, scaled to the worksheet's maximum grade.

    Parameters
    ----------
    verdicts : iterable of SubmissionVerdict
        Their students are Moodle's numbers, as in a bulk download; gone through twice.
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
    place = _moodle_columns(worksheet, header, rows)
    students = [verdict.student for verdict in verdicts]
    maxima = _maxima(worksheet, place, rows)
    numbers = [_NUMBER.sub(r"\1", row[place["Identifier"]]) for row in rows]
    found = rows_of(students, rows, [numbers], worksheet)
    for verdict in verdicts:
        if verdict.student not in found:
            continue
        n = found[verdict.student]
        row = rows[n]
        row[place["Grade"]] = score_text(verdict, maxima[n])
        if "Feedback comments" in place:
            text = html.escape(summary_text(verdict)).replace("\n", "<br>")
            row[place["Feedback comments"]] = plain(text)
    write_gradebook(out, [header, *rows])
    return sorted(set(students) - found.keys())


def check_moodle(worksheet: str | os.PathLike[str]) -> None:
    """Raise, before any work, the `LabkitError` of a worksheet that no verdicts can fill in."""
    header, *rows = read_gradebook(worksheet, [])
    _maxima(worksheet, _moodle_columns(worksheet, header, rows), rows)


def _moodle_columns(worksheet: str | os.PathLike[str], header: Row, rows: Rows) -> dict[str, int]:
    """Where the columns are, by their English names.

    Moodle translates the header, and keeps the order: who it is comes first ("Participant 12"),
    the maximum grade, one number in all rows, right after the grade, and the comments last.
    """
    if set(MOODLE_NEEDED) <= set(header):
        return {name: header.index(name) for name in header}
    identifiers = rows and all(_NUMBER.fullmatch(row[0]) for row in rows)
    maxima = [n for n in range(2, len(header)) if _are_one_number(row[n] for row in rows)]
    if not identifiers or not maxima:
        read_gradebook(worksheet, MOODLE_NEEDED)  # it says what is missing
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


def students_of(gradebook: str | os.PathLike[str], *, canvas: bool) -> list[tuple[list[str], str]]:
    """Who is in a gradebook: the names by which a student may be known, and the one to show."""
    header, *rows = read_gradebook(gradebook, CANVAS_NEEDED if canvas else [])
    if not canvas:
        return [([_NUMBER.sub(r"\1", row[0])], row[1]) for row in rows]
    keys = [header.index(name) for name in CANVAS_KEYS if name in header]
    people = [row for row in rows if row[header.index("ID")].strip().isdigit()]
    return [([row[key].strip() for key in keys if row[key].strip()], row[0]) for row in people]


def lateness_of(worksheet: str | os.PathLike[str]) -> dict[str, float]:
    """How many days late Moodle's worksheet says that each student was; English ones alone.

    >>> [_days(text) for text in ("Submitted for grading - 2 days 3 hours late", "No submission")]
    [2.125, 0.0]
    """
    header, *rows = read_gradebook(worksheet, [])
    if "Status" not in header:
        return {}
    column = header.index("Status")
    return {_NUMBER.sub(r"\1", row[0]): _days(row[column]) for row in rows}


def _days(status: str) -> float:
    """The days in a status of Moodle's."""
    if not re.search(r"\blate\b", status):
        return 0.0
    units = {"day": 1.0, "hour": 1 / 24, "min": 1 / 1440, "sec": 1 / 86400, "week": 7.0}
    found = re.findall(r"(\d+) (day|hour|min|sec|week)", status)
    return float(sum(int(count) * units[unit] for count, unit in found))


def _maximum(text: str, where: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise LabkitError(f"{where}: the maximum grade must be a number, got {text!r}") from None


def write_feedback(
    submissions: Iterable[Submission], pages: Mapping[str, Path], out: str | os.PathLike[str]
) -> None:
    """Pack the students' pages under the names by which Canvas and Moodle take files back.

    Parameters
    ----------
    submissions : iterable of Submission
        As they were found; one of no platform has its page under its own name.
    pages : mapping of str to Path
        The page of each student.
    out : path-like
        The zip archive, for Canvas's "Upload submissions" or Moodle's "Upload multiple
        feedback files in a zip".
    """
    with atomic_write(out, "wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zip:
        for one in submissions:
            if one.student in pages:
                zip.write(pages[one.student], one.feedback_name)
