"""From verdicts to marks: points set by hand, written answers, late days, the roster.

All that people decide stands in ``adjustments.csv`` beside the verdicts, one line each, and is
read whenever marks are made. So it holds for every run to come::

    student,what,value,comment
    *,late_percent,10,
    ada,icp,12,you explained it to me

The student ``*`` sets a rule of the class; ``what`` is a question, ``written`` or ``late``.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

from labkit.grading.box.outside import Wall
from labkit.grading.classroom.store import Record
from labkit.grading.classroom.tables import number, read_rows, write_rows
from labkit.grading.grade import grade_submission
from labkit.grading.judge.verdict import SubmissionVerdict
from labkit.grading.questions import Assignment
from labkit.support.errors import LabkitError

HEADER = ("student", "what", "value", "comment")
CLASS = "*"  # in place of a student
RULES = {"late_percent": 100.0, "written": math.inf}  # and the largest value of each
# Value and comment, by student, or `CLASS`, and item.
Adjustments: TypeAlias = Mapping[tuple[str, str], tuple[float, str]]


def make_marks(
    records: Mapping[str, Record],
    adjustments: Adjustments,
    assignment: Assignment,
    groups: Mapping[str, str] = {},
) -> list[SubmissionVerdict]:
    """The marks of all who have a verdict or were given points.

    In `groups` stands whose hand-in holds for a student, too: one mark for all members.
    """
    records = dict(records)
    for student, group in groups.items():
        if record := records.get(group):
            verdict = replace(record.verdict, student=student)
            records[student] = replace(record, verdict=verdict)
    for group in set(groups.values()) - groups.keys():
        records.pop(group, None)
    given = {student for student, what in adjustments if what != "late"} - {CLASS}
    marks = []
    for student in sorted({*records, *given}):
        if record := records.get(student):
            marks.append(_adjusted(record.verdict, record.late, adjustments))
        else:
            nothing, _ = grade_submission({}, Wall(mode=""), assignment, student)
            marks.append(_adjusted(nothing, 0.0, adjustments))
    return marks


def _adjusted(
    verdict: SubmissionVerdict, days: float, adjustments: Adjustments
) -> SubmissionVerdict:
    """The verdict on what came `days` late, with all that is changed of it, each change told."""
    told: list[str] = []

    def decided(what: str, default: float, before: str, after: str) -> float:
        if (verdict.student, what) not in adjustments:
            return default
        value, comment = adjustments[verdict.student, what]
        because = f": {comment}" if comment else ""
        told.append(f"{before} {value:g} {after}{because}.")
        return value

    late_percent, worth = (adjustments.get((CLASS, one), (0.0, ""))[0] for one in RULES)
    questions = []
    for one in verdict.questions:
        said = f"{one.title}: set by your instructor to", f"of {one.points:g} points"
        questions.append(replace(one, score=decided(one.question, one.score, *said)))
    score = sum(one.score for one in questions)
    score += decided("written", 0.0, "Written answers:", f"of {worth:g} points")
    points_given = bool(told)
    days = decided("late", days, "Counted as", "days late")
    if share := min(days * late_percent, 100.0):
        unit = "day" if days == 1.0 else "days"
        told.append(f"{days:.3g} {unit} late: {share:.3g} % off {score:g} points.")
        score *= 1.0 - share / 100.0
    return replace(
        verdict,
        questions=tuple(questions),
        is_graded=verdict.is_graded or points_given,
        score=round(score, 2),
        points=verdict.points + worth,
        late=days,
        adjustments=tuple(told),
    )


def read_adjustments(out: Path, assignment: Assignment, names: Mapping[str, str]) -> Adjustments:
    """Read ``adjustments.csv`` in the folder `out`; an empty one is written where there is none.

    A line may use either a student's id or the name for a person, as `names` has them. A slip is
    refused, and costs no points.
    """
    path = out / "adjustments.csv"
    if not path.exists():
        write_rows(path, HEADER, [])
    items = {one.id: one.points for one in assignment.questions} | {
        "written": 0.0,
        "late": math.inf,
    }
    lines: dict[tuple[str, str], tuple[float, str]] = {}
    rows = read_rows(path, HEADER[:3])[1]
    for line, row in sorted(rows, key=lambda one: one[1]["student"] != CLASS):
        name, what, text = (row[column] for column in HEADER[:3])
        where = f"{path}: line {line}"
        possible = RULES if name == CLASS else items
        if what not in possible:
            raise LabkitError(f"{where}: unknown item {what!r}; {_hint(what.lower(), possible)}")
        student = CLASS if name == CLASS else _student(name, names, where)
        value, most = number(text), possible[what]
        if not 0.0 <= value <= most or value == math.inf:
            upto = f" from 0 to {most:g}" if math.isfinite(most) else " from 0"
            way_out = "" if most else f"; say what they are worth: {CLASS},written,POINTS,"
            raise LabkitError(f"{where}: {what} must be a number{upto}, got {text!r}{way_out}")
        if (student, what) in lines:
            raise LabkitError(f"{where}: {what} of {name!r} is set before; keep one of the lines")
        lines[student, what] = value, row.get("comment", "")
        if (student, what) == (CLASS, "written"):
            items[what] = value
    return lines


def _student(name: str, names: Mapping[str, str], where: str) -> str:
    """The student whom a line means."""
    known = [name] if name in names else [one for one, shown in names.items() if shown == name]
    if len(known) == 1:
        return known[0]
    hint = _hint(name, dict.fromkeys([*names, *names.values()]))
    raise LabkitError(f"{where}: {len(known) or 'no'} students are called {name!r}; {hint}")


def _hint(name: str, possible: Collection[str]) -> str:
    near = difflib.get_close_matches(name, possible, n=3)
    listed = ", ".join([*possible][:24])
    return f"did you mean {' or '.join(map(repr, near))}?" if near else f"there are {listed}"


def read_roster(out: Path) -> tuple[dict[str, str], dict[str, str]]:
    """The students of ``roster.csv``, where there is one: their names for a person, and groups.

    A group is the name of the folder, file or student that handed in for all of its members.
    """
    path = out / "roster.csv"
    _, rows = read_rows(path, ["student"]) if path.exists() else ([], [])
    listed = [row for _, row in rows if row["student"]]
    names = {row["student"]: row.get("name") or row["student"] for row in listed}
    return names, {row["student"]: row["group"] for row in listed if row.get("group")}
