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
from typing import NamedTuple, TypeAlias

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


class Roster(NamedTuple):
    """The students of a class, and whose hand-in holds for whom."""

    names: Mapping[str, str]  # for a person, by student
    groups: Mapping[str, str] = {}  # by student: who handed in for the student

    @property
    def teams(self) -> set[str]:
        """The groups that are no student themselves: their members have the marks."""
        return {*self.groups.values()} - self.names.keys()

    def members(self, student: str) -> list[str]:
        """The members of a group; the student alone of any other name."""
        if student not in self.teams:
            return [student]
        return [member for member, group in self.groups.items() if group == student]


def make_marks(
    records: Mapping[str, Record],
    adjustments: Adjustments,
    assignment: Assignment,
    roster: Roster,
) -> list[SubmissionVerdict]:
    """The marks of all students who have a verdict or were given points.

    The members of a group have its verdict under their own names.
    """
    verdicts = {student: record.verdict for student, record in records.items()}
    late = {student: record.late for student, record in records.items()}
    for student, group in roster.groups.items():
        if group in records:
            name = roster.names.get(student, student)
            notes = records[group].verdict.notes
            if student in records and student != group:
                notes += (f"The hand-in of {group} counts for you, and not one of your own.",)
            verdicts[student] = replace(
                records[group].verdict, student=student, submission=name, notes=notes
            )
            late[student] = records[group].late
    with_points = {student for student, item in adjustments if item != "late"} - {CLASS}
    marks = []
    for student in sorted({*verdicts, *with_points} - roster.teams):
        if student not in verdicts:
            nothing, _ = grade_submission({}, Wall(mode=""), assignment, student)
            name = roster.names.get(student, student)
            notes = (*nothing.notes, "Nothing was handed in.")
            verdicts[student] = replace(nothing, submission=name, notes=notes)
        marks.append(_adjust(verdicts[student], late.get(student, 0.0), adjustments))
    return marks


def make_group_marks(
    records: Mapping[str, Record], adjustments: Adjustments, roster: Roster
) -> list[SubmissionVerdict]:
    """The marks of groups as all members may see them: without what one member was given."""
    return [
        _adjust(records[team].verdict, records[team].late, adjustments)
        for team in sorted(roster.teams & records.keys())
    ]


def _adjust(verdict: SubmissionVerdict, days: float, adjustments: Adjustments) -> SubmissionVerdict:
    """The verdict on what came `days` late, with its adjustments made, and a remark on each."""
    remarks: list[str] = []

    def decide(item: str, default: float, prefix: str, suffix: str) -> float:
        if (verdict.student, item) not in adjustments:
            return default
        value, comment = adjustments[verdict.student, item]
        because = f": {comment}" if comment else ""
        remarks.append(f"{prefix} {value:g} {suffix}{because}.")
        return value

    late_percent, worth = (adjustments.get((CLASS, rule), (0.0, ""))[0] for rule in RULES)
    questions = []
    for question in verdict.questions:
        prefix = f"{question.title}: set by your instructor to"
        suffix = f"of {question.points:g} points"
        score = decide(question.question, question.score, prefix, suffix)
        asked = question if verdict.is_graded else replace(question, cases=(), message="")
        questions.append(replace(asked, score=score))
    score = sum(question.score for question in questions)
    score += decide("written", 0.0, "Written answers:", f"of {worth:g} points")
    points_given = bool(remarks)
    days = decide("late", days, "Counted as", "days late")
    if share := min(days * late_percent, 100.0):
        unit = "day" if days == 1.0 else "days"
        remarks.append(f"{days:.3g} {unit} late: {share:.3g} % off {score:g} points.")
        score *= 1.0 - share / 100.0
    return replace(
        verdict,
        questions=tuple(questions),
        is_graded=verdict.is_graded or points_given,
        score=round(score, 2),
        points=verdict.points + worth,
        late=days,
        adjustments=tuple(remarks),
    )


def read_adjustments(
    out: Path, assignment: Assignment, names: Mapping[str, str], roster: Roster
) -> Adjustments:
    """Read ``adjustments.csv`` in the folder `out`; an empty one is written where there is none.

    A line may use either a student's id or the name for a person, as `names` has them; that of a
    group holds for all members. A slip is refused, and costs no points.
    """
    path = out / "adjustments.csv"
    if not path.exists():
        write_rows(path, HEADER, [])
    items = {question.id: question.points for question in assignment.questions}
    items |= {"written": 0.0, "late": math.inf}
    lines: dict[tuple[str, str], tuple[float, str]] = {}
    rows = read_rows(path, HEADER[:3])[1]
    for line, row in sorted(rows, key=lambda numbered: numbered[1]["student"] != CLASS):
        name, item, cell = (row[column] for column in HEADER[:3])
        location = f"{path}: line {line}"
        possible = RULES if name == CLASS else items
        if item not in possible:
            raise LabkitError(f"{location}: unknown item {item!r}; {_hint(item.lower(), possible)}")
        student = CLASS if name == CLASS else _find(name, names, f"{location}: {{}} students")
        value = number(cell)
        maximum = possible[item]
        if not 0.0 <= value <= maximum or value == math.inf:
            upto = f" from 0 to {maximum:g}" if math.isfinite(maximum) else " from 0"
            way_out = "" if maximum else f"; say what they are worth: {CLASS},written,POINTS,"
            raise LabkitError(f"{location}: {item} must be a number{upto}, got {cell!r}{way_out}")
        for holder in {student, *roster.members(student)}:  # a group's own page tells it, too
            if (holder, item) in lines:
                raise LabkitError(
                    f"{location}: {item} of {holder!r} is set before; keep one of the lines"
                )
            lines[holder, item] = value, row.get("comment", "")
        if (student, item) == (CLASS, "written"):
            items[item] = value
    return lines


def _find(name: str, names: Mapping[str, str], problem: str) -> str:
    """The one that a person means by a name, or by the id."""
    matches = [name] if name in names else [id for id, person in names.items() if person == name]
    if len(matches) == 1:
        return matches[0]
    hint = _hint(name, dict.fromkeys([*names, *names.values()]))
    raise LabkitError(f"{problem.format(len(matches) or 'no')} are called {name!r}; {hint}")


def _hint(name: str, possible: Collection[str]) -> str:
    suggestions = difflib.get_close_matches(name, possible, n=3)
    listed = ", ".join([*possible][:24])
    if suggestions:
        return f"did you mean {' or '.join(map(repr, suggestions))}?"
    return f"there are {listed}"


def read_roster(out: Path, handed_in: Mapping[str, str], people: Mapping[str, str]) -> Roster:
    """Read ``roster.csv``, where there is one, and join it with the `people` of gradebooks.

    A group is the name of the folder, file or student in `handed_in` that holds for all of its
    members. One that fits none of them is refused, unless all hand-ins have their students: then it
    handed in nothing. A student with two lines is refused, and so is a group that is a student with
    another group.
    """
    path = out / "roster.csv"
    _, rows = read_rows(path, ["student"]) if path.exists() else ([], [])
    listed = [(line, row) for line, row in rows if row["student"]]
    lines = dict[str, int]()
    for line, row in listed:
        first = lines.setdefault(row["student"], line)
        if first != line:
            raise LabkitError(
                f"{path}: lines {first} and {line}: {row['student']!r} is listed twice; keep one "
                f"of the lines"
            )
    names = {row["student"]: row.get("name") or row["student"] for _, row in listed}
    names.update(people)
    known = {*handed_in, *handed_in.values()}
    cells = {row["student"]: (line, row["group"]) for line, row in listed if row.get("group")}
    groups = {
        student: _find(group, handed_in, f"{path}: line {line}: {{}} hand-ins")
        for student, (line, group) in cells.items()
        if group in known
    }
    for student, group in groups.items():
        further = groups.get(group, group)
        if further != group:
            raise LabkitError(
                f"{path}: line {lines[student]}: {group!r} is to hand in for {student!r}, but "
                f"{further!r} for {group!r}, on line {lines[group]}; write one name in both lines"
            )
    strangers = {
        student: name
        for student, name in handed_in.items()
        if student not in names and student not in groups.values()
    }
    for student, (line, group) in cells.items():
        if student not in groups and strangers:
            hint = _hint(group, strangers)
            raise LabkitError(
                f"{path}: line {line}: no hand-in is called {group!r} (leave the cell empty if "
                f"the group handed in nothing); {hint}"
            )
    return Roster(names, groups)
