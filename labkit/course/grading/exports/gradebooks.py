"""Scores in the gradebooks of learning platforms, which are filled in on their own scale.

Canvas takes the gradebook's CSV, ``Student,ID,SIS User ID,SIS Login ID,Section,<title> (<id>)``;
Moodle the offline grading worksheet, ``Identifier,...,Grade,...,Feedback comments``. Who was not
graded is left out: the platform keeps what it has. Any other platform gets ``scores.csv``.
"""

from __future__ import annotations

import html
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from labkit.course.grading.judging.verdict import SubmissionVerdict, short
from labkit.course.grading.tables import Row, number, plain, read_rows, write_rows
from labkit.support.errors import LabkitError

CANVAS = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")
UNITS = {"week": 7.0, "day": 1.0, "hour": 1 / 24, "min": 1 / 1440, "sec": 1 / 86400}


class Person(NamedTuple):
    """A row of a gradebook."""

    row: Row
    name: str
    maximum: float  # what the assignment is worth there; nan where the gradebook does not say
    late: float | None = None  # days, where the platform tells them


@dataclass(frozen=True, kw_only=True)
class Gradebook:
    """A gradebook that can be filled in."""

    columns: Sequence[str]  # those that go back to the platform
    grade: str  # the column of the scores
    comment: str = ""  # the one of the comments; "" where there is none
    head: Sequence[Row] = ()  # rows that go back as they are
    people: Mapping[str, Person]  # by the platform's own number

    def fill(self, marks: Iterable[SubmissionVerdict], out: str | os.PathLike[str]) -> list[str]:
        """Write the rows of those who have a mark; return the students that have no row."""
        filled, unlisted = [], []
        for mark in marks:
            person = self.people.get(mark.student)
            if person is None:
                unlisted.append(mark.student)
                continue
            scaled = mark.score * person.maximum / (mark.points or math.nan)
            score = short(mark.score if math.isnan(scaled) else scaled)
            comment = plain(html.escape(summary_text(mark)).replace("\n", "<br>"))
            filled.append(person.row | {self.comment: comment, self.grade: score})
        write_rows(out, self.columns, [*self.head, *filled])
        return unlisted


def read_canvas(path: str | os.PathLike[str], title: str) -> Gradebook:
    """Read Canvas's gradebook, to fill in the column "title" or "title (number)".

    Where its "Points Possible" are no number above zero, the scores stay as they are.
    """
    columns, rows = read_rows(path, CANVAS[:2])
    pattern = re.compile(re.escape(title) + r"( \(\d+\))?")
    grades = [name for name in columns if pattern.fullmatch(name)]
    if len(grades) != 1:
        choice = ", ".join(name for name in columns if name not in CANVAS)
        which = "more than one" if grades else "no"
        raise LabkitError(f"{path}: line 1: {which} column {title!r}; the columns are {choice}")
    (grade,) = grades
    head = [row for _, row in rows if row["Student"].strip().startswith("Points Possible")]
    possible = number(head[0][grade]) if head else math.nan
    maximum = possible if 0.0 < possible < math.inf else math.nan
    numbered = ((row["ID"].strip(), row) for _, row in rows)
    people = {one: Person(row, row["Student"], maximum) for one, row in numbered if one}
    kept = [name for name in (*CANVAS, grade) if name in columns]
    return Gradebook(columns=kept, grade=grade, head=head, people=people)


def read_moodle(path: str | os.PathLike[str]) -> Gradebook:
    """Read Moodle's grading worksheet, in English, to fill in grades and comments."""
    columns, rows = read_rows(path, ("Identifier", "Grade"))
    people = {}
    for _, row in rows:
        student = re.sub(r"\D*(\d+)\s*", r"\1", row["Identifier"])  # "Participant 4711"
        late = _days(row["Status"]) if "Status" in columns else None
        worth = number(row.get("Maximum Grade", ""))
        people[student] = Person(row, row.get("Full name") or student, worth, late)
    comment = "Feedback comments" * ("Feedback comments" in columns)
    return Gradebook(columns=columns, grade="Grade", comment=comment, people=people)


def _days(status: str) -> float:
    """The days in a status of Moodle's.

    >>> [_days(text) for text in ("Submitted for grading - 2 days 3 hours late", "No submission")]
    [2.125, 0.0]
    """
    late = re.search(r"\blate\b", status)
    found = re.findall(rf"(\d+) ({'|'.join(UNITS)})", status) if late else []
    return float(sum(int(count) * UNITS[unit] for count, unit in found))


def summary_text(verdict: SubmissionVerdict) -> str:
    """A verdict in a few lines, for a gradebook's comment."""
    lines = [f"{short(verdict.score)} of {short(verdict.points)} points."]
    for one in verdict.questions:
        if not one.passed:
            lines.append(f"{one.title} ({short(one.score)}/{short(one.points)}): {one.message}")
    return "\n".join([*lines, *verdict.remarks])


def write_scores(
    marks: Iterable[SubmissionVerdict], missing: Iterable[str], out: str | os.PathLike[str]
) -> None:
    """Write a row for each student, with each question's score; `missing` ones have none."""
    rows: list[Mapping[str, str]] = [{"student": plain(one)} for one in missing]
    columns = dict.fromkeys(("student", "submission", "score", "points", "late", "isolation"))
    for mark in marks:
        scores = {one.question: short(one.score) for one in mark.questions}
        columns |= dict.fromkeys(scores)
        who = {"student": plain(mark.student), "submission": plain(mark.submission)}
        total = {"score": short(mark.score), "points": short(mark.points)}
        rows.append({**scores, **who, **total, "late": f"{mark.late:.3g}", "isolation": mark.mode})
    write_rows(out, list(columns), rows)
