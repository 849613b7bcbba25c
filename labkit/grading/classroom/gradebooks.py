"""Scores in the gradebooks of learning platforms, which are filled in on their own scale.

Canvas takes the gradebook's CSV, ``Student,ID,SIS User ID,SIS Login ID,Section,<title> (<id>)``;
Moodle the offline grading worksheet, ``Identifier,...,Grade,...,Feedback comments``. Who was not
graded is left out, and so is a row whose grade or comment holds something: the platform keeps
what a person wrote. Any other platform gets ``scores.csv``.
"""

from __future__ import annotations

import html
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from labkit.grading.classroom.tables import Row, number, plain, read_rows, write_rows
from labkit.grading.judge.verdict import SubmissionVerdict, short
from labkit.support.errors import LabkitError

CANVAS = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")
COMMENT = "Feedback comments"  # Moodle's, where the worksheet has them
CHANGEABLE = "Grade can be changed"  # Moodle's
IN_ENGLISH = (
    ". Moodle names the columns in your language: set it to English in your preferences, and "
    "download the worksheet again"
)
EMPTY = ("", "-")  # of a cell without a grade
UNITS = {"week": 7.0, "day": 1.0, "hour": 1 / 24, "min": 1 / 1440, "sec": 1 / 86400}


class Person(NamedTuple):
    """A row of a gradebook."""

    row: Row
    name: str
    maximum: float  # what the assignment is worth there; nan where the gradebook does not say
    late: float | None = None  # days, where the platform tells them


class Unfilled(NamedTuple):
    """Students with a mark and no row that could be filled in."""

    unlisted: list[str]  # the gradebook has none
    occupied: list[str]  # it holds a grade or a comment
    locked: list[str]  # the platform takes no grade


class Gradebook(NamedTuple):
    """A gradebook that can be filled in."""

    columns: Sequence[str]  # those that go back to the platform
    grade: str  # the column of the scores
    head: Sequence[Row]  # rows that go back as they are
    people: Mapping[str, Person]  # by the platform's own number
    excused: str = ""  # in place of a score; "" where the platform knows no such cell

    def fill(
        self,
        marks: Iterable[SubmissionVerdict],
        out: str | os.PathLike[str],
        *,
        overwrite: bool = False,
    ) -> Unfilled:
        """Write the rows of those who have a mark, and list those whose row is left out.

        One that holds a grade or a comment is, unless `overwrite`.
        """
        filled = []
        unlisted, occupied, locked = unfilled = Unfilled([], [], [])
        for mark in marks:
            if not mark.is_graded and not (mark.is_excused and self.excused):
                continue
            person = self.people.get(mark.student)
            if person is None:
                unlisted.append(mark.student)
                continue
            if person.row.get(CHANGEABLE) == "No":
                locked.append(mark.student)
                continue
            written = [person.row.get(name, "") for name in (self.grade, COMMENT)]
            if not overwrite and any(cell not in EMPTY for cell in written):
                occupied.append(mark.student)
                continue
            worth = person.maximum if 0.0 < person.maximum < math.inf else mark.points
            score = short(mark.score * worth / mark.points) if mark.is_graded else self.excused
            messages = [
                f"{question.title}: {question.message}"
                for question in mark.questions
                if question.message and not question.passed
            ]
            comment = plain("<br>".join(map(html.escape, [*messages, *mark.remarks])))
            filled.append(person.row | {self.grade: score, COMMENT: comment})
        write_rows(out, self.columns, [*self.head, *filled])
        return unfilled


def read_canvas(path: str | os.PathLike[str], title: str) -> Gradebook:
    """Read Canvas's gradebook, to fill in the column "title" or "title (number)".

    Where its "Points Possible" are no number above zero, the scores stay as they are.
    """
    columns, rows = read_rows(path, CANVAS[:2])
    grades = [name for name in columns if re.fullmatch(re.escape(title) + r"( \(\d+\))?", name)]
    if len(grades) != 1:
        choice = ", ".join(name for name in columns if name not in CANVAS)
        which = "more than one" if grades else "no"
        raise LabkitError(f"{path}: line 1: {which} column {title!r}; the columns are {choice}")
    (grade,) = grades
    head = [row for _, row in rows if row["Student"].startswith("Points Possible")]
    maximum = number(head[0][grade]) if head else math.nan
    people = {row["ID"]: Person(row, row["Student"], maximum) for _, row in rows if row["ID"]}
    returned_columns = [name for name in (*CANVAS, grade) if name in columns]
    return Gradebook(returned_columns, grade, head, people, excused="EX")


def read_moodle(path: str | os.PathLike[str]) -> Gradebook:
    """Read Moodle's grading worksheet, in English, to fill in grades and comments."""
    columns, rows = read_rows(path, ("Identifier", "Grade"), way_out=IN_ENGLISH)
    people = {}
    for line, row in rows:
        maximum = row.get("Maximum Grade", "")
        if maximum and math.isnan(number(maximum)):
            raise LabkitError(
                f"{path}: line {line}: the grade is a scale up to {maximum!r}, and no number; "
                f"choose points in the assignment's settings, and download the worksheet again"
            )
        student = re.sub(r"\D", "", row["Identifier"])  # "Participant 4711"
        late = _days(row["Status"]) if "Status" in row else None
        name = row.get("Full name") or student
        people[student] = Person(row, name, number(maximum), late)
    return Gradebook(columns, "Grade", (), people)


def _days(status: str) -> float:
    """The days in a status of Moodle's.

    >>> [_days(text) for text in ("Submitted for grading - 2 days 3 hours late", "No submission")]
    [2.125, 0.0]
    """
    late = re.search(r"\blate\b", status)
    durations = re.findall(rf"(\d+) ({'|'.join(UNITS)})", status) if late else []
    return float(sum(int(count) * UNITS[unit] for count, unit in durations))


def write_scores(
    marks: Iterable[SubmissionVerdict],
    missing: Iterable[str],
    out: str | os.PathLike[str],
    remarks: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> None:
    """Write a row for each student, with each question's score and the remarks on the student.

    Who is `missing` has none, and who handed in nothing that can be read has the reason alone.
    """
    rows: list[Row] = [{"student": student} for student in missing]
    for mark in marks:
        identity = {"student": mark.student, "submission": plain(mark.submission)}
        if not mark.is_graded:
            rows.append(identity | {"remark": " ".join(mark.remarks)})
            continue
        total = {"score": short(mark.score), "points": short(mark.points)}
        conditions = {"late": f"{mark.late:.3g}", "isolation": mark.mode}
        scores = {verdict.question: short(verdict.score) for verdict in mark.questions}
        rows.append(identity | total | conditions | scores)
    for row in rows:
        texts = [row.get("remark", ""), *remarks.get(row["student"], ())]
        row["remark"] = plain("; ".join(filter(None, texts)))
        row["student"] = plain(row["student"])
    columns = dict.fromkeys(name for row in rows[::-1] for name in row if name != "remark")
    write_rows(out, [*columns, "remark"], rows)
