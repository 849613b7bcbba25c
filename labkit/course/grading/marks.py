"""From verdicts to marks: points set by hand, written answers, late days, groups, the roster.

All that people decide stands in ``adjustments.csv`` beside the verdicts, one line each, and is
read whenever marks are made. So it holds for every run to come::

    student,what,value,comment
    *,late_percent,10,
    ada,icp,12,you explained it to me

The student ``*`` sets a rule of the class. ``what`` is a question, or one of `WHAT`.
"""

from __future__ import annotations

import csv
import difflib
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.judging.verdict import QuestionVerdict, SubmissionVerdict
from labkit.course.grading.store import VerdictStore
from labkit.errors import LabkitError
from labkit.files import atomic_write, read_table

ADJUSTMENTS, ROSTER = "adjustments.csv", "roster.csv"
HEADER = ("student", "what", "value", "comment")
CLASS = "*"
WHAT = {
    "bonus": "points on top",
    "written": "points of the written answers",
    "late": "days late, in place of what the platform says",
    "extension": "days of grace for this student",
    "group": "the group's name: the best submission counts for all of it",
}
RULES = {
    "late_percent": "off the score for each day late",
    "late_grace": "days that cost nothing",
    "late_cap": "the most that lateness costs [%]",
    "written": "what the written answers are worth",
}


class Line(NamedTuple):
    """What one line decides."""

    value: float
    comment: str


@dataclass(frozen=True, kw_only=True)
class Adjustments:
    """All that was decided.

    Attributes
    ----------
    lines : mapping of (str, str) to Line
        By student and what it is about; the student ``*`` holds the rules.
    groups : mapping of str to str
        The group of each student who is in one.
    """

    lines: Mapping[tuple[str, str], Line] = field(default_factory=dict)
    groups: Mapping[str, str] = field(default_factory=dict)

    def rule(self, name: str, default: float = 0.0) -> float:
        """A rule of the class."""
        line = self.lines.get((CLASS, name))
        return line.value if line else default

    def apply(self, verdict: SubmissionVerdict, days: float, owner: str) -> SubmissionVerdict:
        """The verdict with all that is changed of it, each change told to the student.

        Parameters
        ----------
        verdict : SubmissionVerdict
            Under the name of the student who gets it.
        days : float
            How late the platform says that it came.
        owner : str
            Who handed it in: what was decided of its lateness counts.
        """
        told: list[str] = []
        questions = []
        for one in verdict.questions:
            line = self.lines.get((verdict.student, one.question))
            if line:
                told.append(
                    f"{one.title}: set by your instructor to {line.value:g} of {one.points:g} "
                    f"points{_because(line)}"
                )
                one = replace(one, score=line.value)  # noqa: PLW2901
            questions.append(one)
        score = sum(one.score for one in questions)
        if bonus := self.lines.get((verdict.student, "bonus")):
            told.append(f"{bonus.value:+g} points by your instructor{_because(bonus)}")
            score += bonus.value
        written = self.lines.get((verdict.student, "written"))
        worth = self.rule("written")
        if written:
            told.append(
                f"Written answers: {written.value:g} of {worth:g} points{_because(written)}"
            )
            score += written.value
        if line := self.lines.get((owner, "late")):
            days = line.value
            told.append(f"Counted as {days:g} days late{_because(line)}")
        if line := self.lines.get((owner, "extension")):
            days = max(0.0, days - line.value)
            told.append(f"An extension of {line.value:g} days{_because(line)}")
        share = min(days * self.rule("late_percent"), self.rule("late_cap", 100.0), 100.0)
        if days > self.rule("late_grace") and share:
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
    store: VerdictStore, adjustments: Adjustments, assignment: Assignment
) -> list[SubmissionVerdict]:
    """The marks of all who have a verdict, share a group with one who has, or were given points.

    Of a group each gets the best that any of its submissions earns, all changes included.
    """
    graded = store.students
    owners: dict[str, list[str]] = {student: [student] for student in graded}
    for student, group in adjustments.groups.items():
        members = [one for one in graded if adjustments.groups.get(one) == group]
        if members:
            owners[student] = members
    marks = []
    for student, candidates in sorted(owners.items()):
        found = []
        for owner in candidates:
            verdict = store[owner]
            if student in adjustments.groups:
                group = adjustments.groups[student]
                note = f"Handed in by {owner} for {group}."
                verdict = replace(verdict, student=student, notes=(note, *verdict.notes))
            found.append(adjustments.apply(verdict, store.late(owner), owner))
        marks.append(max(found, key=lambda verdict: verdict.score))
    given = {student for student, what in adjustments.lines if what not in ("late", "extension")}
    for student in given - owners.keys() - {CLASS}:
        marks.append(adjustments.apply(_nothing(student, assignment), 0.0, student))
    return sorted(marks, key=lambda mark: mark.student)


def _nothing(student: str, assignment: Assignment) -> SubmissionVerdict:
    """The verdict on one who handed in nothing."""
    return SubmissionVerdict(
        student=student,
        submission="",
        mode="",
        questions=tuple(
            QuestionVerdict(
                question=one.id,
                title=one.title,
                points=one.points,
                score=0.0,
                cases=(),
                misconception=None,
                message="Nothing was handed in.",
            )
            for one in assignment.questions
        ),
        score=0.0,
        points=assignment.points,
        notes=(),
        seconds=0.0,
    )


def read_adjustments(
    folder: str | os.PathLike[str], assignment: Assignment, names: Mapping[str, str]
) -> Adjustments:
    """Read ``adjustments.csv``; an empty one is written where there is none.

    Parameters
    ----------
    folder : path-like
        Where it is.
    assignment : Assignment
        Its questions.
    names : mapping of str to str
        All students of the class, and their names for a person: a line may use either.

    Raises
    ------
    LabkitError
        Where a line fits no student or no question, or its value cannot be; the message says
        which line. Nobody's points are lost to a slip.
    """
    path = Path(folder) / ADJUSTMENTS
    if not path.exists():
        with atomic_write(path) as file:
            csv.writer(file, lineterminator="\n").writerow(HEADER)
    points = {one.id: one.points for one in assignment.questions}
    lines: dict[tuple[str, str], Line] = {}
    groups: dict[str, str] = {}
    rows = list(read_rows(path, HEADER[:3]))
    worth = {row["what"]: row["value"] for _, row in rows if row["student"] == CLASS}.get(
        "written", "0"
    )
    for number, row in rows:
        where, what, text = f"{path}: line {number}", row["what"], row["value"]
        possible = RULES if row["student"] == CLASS else [*points, *WHAT]
        if what not in possible:
            raise LabkitError(f"{where}: it must name one of {', '.join(possible)}, got {what!r}")
        student = _student(row["student"], names, where)
        if what == "group":
            if not text or groups.setdefault(student, text) != text:
                raise LabkitError(f"{where}: {row['student']!r} must have one group, got {text!r}")
            continue
        most = points.get(what, math.inf)
        if what == "written" and student != CLASS:
            most = _number(worth)
        value = _number(text)
        least = -math.inf if what == "bonus" else 0.0
        if not math.isfinite(value) or not least <= value <= most:
            upto = f" from 0 to {most:g}" if math.isfinite(most) else ""
            way_out = f"; say what they are worth: {CLASS},written,POINTS," if most == 0 else ""
            raise LabkitError(f"{where}: {what} must be a number{upto}, got {text!r}{way_out}")
        lines[student, what] = Line(value, row.get("comment", ""))
    return Adjustments(lines=lines, groups=groups)


def _student(name: str, names: Mapping[str, str], where: str) -> str:
    if name == CLASS or name in names:
        return name
    known = [student for student, shown in names.items() if shown == name]
    if len(known) == 1:
        return known[0]
    near = difflib.get_close_matches(name, [*names, *names.values()], n=3)
    hint = f"; is it {' or '.join(near)}?" if near else ""
    problem = f"is the name of {len(known)} students" if known else "is no student of this class"
    raise LabkitError(f"{where}: {name!r} {problem}{hint}")


def read_roster(folder: str | os.PathLike[str]) -> dict[str, str]:
    """The students of ``roster.csv``, where there is one, and their names for a person."""
    path = Path(folder) / ROSTER
    if not path.exists():
        return {}
    return {
        row["student"]: row.get("name") or row["student"] for _, row in read_rows(path, ["student"])
    }


def read_rows(
    path: str | os.PathLike[str], needed: Sequence[str]
) -> Iterator[tuple[int, dict[str, str]]]:
    """The rows of a table that people made, with their lines; cells trimmed."""
    text = read_table(path, "save it as CSV in UTF-8")
    header = text.partition("\n")[0]
    semicolons = ";" in header and "," not in header  # as Excel writes where 0.5 is 0,5
    reader = csv.DictReader(text.splitlines(), delimiter=";" if semicolons else ",")
    found = [name.strip() for name in reader.fieldnames or []]
    reader.fieldnames = found
    missing = [name for name in needed if name not in found]
    if missing:
        raise LabkitError(
            f"{path}: line 1: no column {missing[0]!r}; it must name {', '.join(needed)}, "
            f"got {', '.join(found) or 'nothing'}"
        )
    for row in reader:
        cells = {name: (cell or "").strip() for name, cell in row.items() if isinstance(name, str)}
        if any(cells.values()):
            yield reader.line_num, cells


def _number(text: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return math.nan


def _because(line: Line) -> str:
    return f": {line.comment}." if line.comment else "."
