"""From verdicts to marks: points set by hand, written answers, late days, the roster.

All that people decide stands in ``adjustments.csv`` beside the verdicts, one line each, and is
read whenever marks are made. So it holds for every run to come::

    student,what,value,comment
    *,late_percent,10,
    ada,icp,12,you explained it to me

The student ``*`` sets a rule of the class, one of `RULES`; ``what`` is a question or one of `WHAT`.
"""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeAlias

from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.judging.verdict import QuestionVerdict, SubmissionVerdict
from labkit.course.grading.store import Record
from labkit.course.grading.tables import number, read_rows, write_rows
from labkit.support.errors import LabkitError

ADJUSTMENTS, ROSTER = "adjustments.csv", "roster.csv"
HEADER = ("student", "what", "value", "comment")
CLASS, EVERYBODY = "*", ""  # in the table, and in place of a student's id
RULES = {"late_percent": 100.0, "written": math.inf}  # and the largest value of each
WHAT = ("written", "late", "extension")


class Line(NamedTuple):
    """The decision of one line."""

    value: float
    comment: str = ""


Adjustments: TypeAlias = Mapping[tuple[str, str], Line]  # by student, or `EVERYBODY`, and item


def adjusted(
    verdict: SubmissionVerdict, days: float, adjustments: Adjustments
) -> SubmissionVerdict:
    """The verdict on what came `days` late, with all that is changed of it, each change told."""
    told: list[str] = []

    def decided(what: str, default: float, before: str, after: str) -> float:
        line = adjustments.get((verdict.student, what))
        if line is None:
            return default
        because = f": {line.comment}" if line.comment else ""
        told.append(f"{before} {line.value:g} {after}{because}.")
        return line.value

    late_percent, worth = (adjustments.get((EVERYBODY, one), Line(0.0)).value for one in RULES)
    questions = []
    for one in verdict.questions:
        said = f"{one.title}: set by your instructor to", f"of {one.points:g} points"
        questions.append(replace(one, score=decided(one.question, one.score, *said)))
    score = sum(one.score for one in questions)
    score += decided("written", 0.0, "Written answers:", f"of {worth:g} points")
    days = decided("late", days, "Counted as", "days late")
    days = max(0.0, days - decided("extension", 0.0, "An extension of", "days"))
    if share := min(days * late_percent, 100.0):
        told.append(f"{days:.3g} days late: {share:.3g} % off {score:g} points.")
        score *= 1.0 - share / 100.0
    return replace(
        verdict,
        questions=tuple(questions),
        score=round(max(0.0, score), 2),
        points=verdict.points + worth,
        late=days,
        adjustments=tuple(told),
    )


def make_marks(
    records: Mapping[str, Record], adjustments: Adjustments, assignment: Assignment
) -> list[SubmissionVerdict]:
    """The marks of all who have a verdict or were given points."""
    given = {one for one, what in adjustments if what not in ("late", "extension")}
    marks = []
    for student in sorted({*records, *given} - {EVERYBODY}):
        record = records.get(student)
        verdict = record.verdict if record else _nothing(student, assignment)
        marks.append(adjusted(verdict, record.late if record else 0.0, adjustments))
    return marks


def _nothing(student: str, assignment: Assignment) -> SubmissionVerdict:
    """The verdict on one who handed in nothing."""
    questions = [
        QuestionVerdict(
            question=one.id, title=one.title, points=one.points, score=0.0, cases=(),
            misconception=None, message="Nothing was handed in.",
        )
        for one in assignment.questions
    ]  # fmt: skip
    return SubmissionVerdict(
        student=student, submission="", mode="", questions=tuple(questions), score=0.0,
        points=assignment.points, notes=(), seconds=0.0,
    )  # fmt: skip


def read_adjustments(
    path: str | os.PathLike[str], assignment: Assignment, names: Mapping[str, str] | None
) -> Adjustments:
    """Read ``adjustments.csv``; an empty one is written where there is none.

    A line may use either a student's id or the name for a person, as `names` has them; without
    `names` the rules of the class are read alone. A slip is refused, and costs no points.
    """
    if names is not None and not os.path.exists(path):
        write_rows(path, HEADER, [])
    items = {one.id: one.points for one in assignment.questions} | dict.fromkeys(WHAT, math.inf)
    lines: dict[tuple[str, str], Line] = {}
    rows = read_rows(path, HEADER[:3])[1]
    for line, row in sorted(rows, key=lambda one: one[1]["student"].strip() != CLASS):
        name, what, text = (row[column].strip() for column in HEADER[:3])
        if names is None and name != CLASS:
            continue
        where = f"{path}: line {line}"
        possible = RULES if name == CLASS else items
        if what not in possible:
            raise LabkitError(f"{where}: unknown item {what!r}; {_hint(what.lower(), possible)}")
        student = EVERYBODY if name == CLASS else _student(name, names or {}, where)
        value, most = number(text), possible[what]
        if what == "written" and student:
            most = lines.get((EVERYBODY, what), Line(0.0)).value
        if not math.isfinite(value) or not 0.0 <= value <= most:
            upto = f" from 0 to {most:g}" if math.isfinite(most) else " from 0"
            way_out = "" if most else f"; say what they are worth: {CLASS},written,POINTS,"
            raise LabkitError(f"{where}: {what} must be a number{upto}, got {text!r}{way_out}")
        if (student, what) in lines:
            raise LabkitError(f"{where}: {what} of {name!r} is set before; keep one of the lines")
        lines[student, what] = Line(value, row.get("comment", "").strip())
    return lines


def _student(name: str, names: Mapping[str, str], where: str) -> str:
    """The student whom a line means."""
    known = [name] if name in names else [one for one, shown in names.items() if shown == name]
    if len(known) != 1:
        problem = f"the name of {len(known)} students" if known else "no student of this class"
        raise LabkitError(
            f"{where}: {name!r} is {problem}; {_hint(name, [*names, *names.values()])}"
        )
    return known[0]


def _hint(name: str, possible: Collection[str]) -> str:
    near = difflib.get_close_matches(name, possible, n=3)
    listed = ", ".join([*possible][:24])
    return f"did you mean {' or '.join(map(repr, near))}?" if near else f"there are {listed}"


def read_roster(path: Path) -> dict[str, str]:
    """The students of ``roster.csv``, where there is one, and their names for a person."""
    rows = read_rows(path, ["student"])[1] if path.exists() else []
    found = ((row["student"].strip(), row.get("name", "").strip()) for _, row in rows)
    return {student: name or student for student, name in found if student}
