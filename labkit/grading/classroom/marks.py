"""From verdicts to marks: points set by hand, written answers, late days, the roster.

All that people decide stands in ``adjustments.csv`` beside the verdicts, one line each, and is
read whenever marks are made. So it holds for every run to come::

    student,what,value,comment
    *,late_percent,10,
    ada,icp,12,you explained it to me

The student ``*`` sets a rule of the class; ``what`` is a question, ``written``, ``bonus``, ``late``
or ``all``. ``points.csv`` beside it is the same table, as the page for reading code saves it.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeAlias

from labkit.grading.classroom.store import Record
from labkit.grading.classroom.tables import Row, number, read_rows, write_rows
from labkit.grading.judge.verdict import QuestionVerdict, SubmissionVerdict
from labkit.grading.questions import Assignment
from labkit.support.errors import LabkitError

HEADER = ("student", "what", "value", "comment")
BY_HAND = "adjustments.csv"
BY_PAGE = "points.csv"
CLASS = "*"  # in place of a student
EXCUSED = "excused"  # in place of a number
RULES = {  # and the largest value of each
    "late_percent": 100.0,  # % off for each day
    "late_grace": math.inf,  # days that cost nothing
    "late_step": math.inf,  # days, of which a part counts as a whole
    "late_cap": 100.0,  # % off at most
    "written": math.inf,  # points
}


class Decision(NamedTuple):
    """A line of a table: a value, an excuse, or a comment alone."""

    value: float | None
    comment: str = ""
    is_excused: bool = False
    is_by_page: bool = False  # from the page for reading


Adjustments: TypeAlias = Mapping[tuple[str, str], Decision]  # by student, or `CLASS`, and item


class Roster(NamedTuple):
    """The students of a class, and whose hand-in holds for whom."""

    names: Mapping[str, str]  # for a person, by student
    groups: Mapping[str, str] = {}  # by student: who handed in for the student
    is_listed: bool = False  # in a table of its own, beside gradebooks

    @property
    def teams(self) -> set[str]:
        """The groups that are no student themselves: their members have the marks."""
        return {*self.groups.values()} - self.names.keys()

    def members(self, student: str) -> list[str]:
        """The holders of a hand-in's mark: a group's members, and of a student the student, too."""
        members = [member for member, group in self.groups.items() if group == student]
        return members if student in self.teams else list(dict.fromkeys([student, *members]))


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
    with_points = {
        student
        for (student, item), decision in adjustments.items()
        if item != "late" and (decision.value is not None or decision.is_excused)
    } - {CLASS}
    marks = []
    for student in sorted({*verdicts, *with_points} - roster.teams):
        if student not in verdicts:
            verdicts[student] = _nothing(student, roster.names.get(student, student), assignment)
        marks.append(_adjust(verdicts[student], late.get(student, 0.0), adjustments))
    return marks


def _nothing(student: str, name: str, assignment: Assignment) -> SubmissionVerdict:
    """The verdict on a student who handed in nothing."""
    questions = [
        QuestionVerdict(question=asked.id, title=asked.title, points=asked.points, score=0.0)
        for asked in assignment.questions
    ]
    return SubmissionVerdict(
        student=student,
        submission=name,
        mode="",
        questions=tuple(questions),
        score=0.0,
        points=assignment.points,
        notes=("Nothing was handed in.",),
        is_graded=False,
    )


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
    nothing = Decision(None)

    def decide(item: str, title: str, text: str) -> Decision:
        decision = adjustments.get((verdict.student, item), nothing)
        parts = [text.format(decision.value)] if decision.value is not None else []
        parts += [EXCUSED] if decision.is_excused else []
        parts += [decision.comment] if decision.comment else []
        if parts:
            remarks.append(f"{title}: {': '.join(parts)}.")
        return decision

    worth = rule(adjustments, "written")
    questions = []
    given = []  # what gives points to who handed in nothing
    for question in verdict.questions:
        text = f"set by your instructor to {{:g}} of {question.points:g} points"
        decision = decide(question.question, question.title, text)
        given.append(decision.value)
        asked = question if verdict.is_graded else replace(question, cases=(), message="")
        if decision.is_excused:
            asked = replace(asked, points=0.0, score=0.0, cases=(), message="", replaced=())
        elif decision.value is not None:
            asked = replace(asked, score=decision.value)
        questions.append(asked)
    written = decide("written", "Written answers", f"{{:g}} of {worth:g} points")
    score = sum(question.score for question in questions) + (written.value or 0.0)
    points = sum(question.points for question in questions) + worth * (not written.is_excused)
    late = decide("late", "Late", "counted as {:g} days").value
    days = days if late is None else late
    share = late_percent(days, adjustments)
    if share:
        unit = "day" if days == 1.0 else "days"
        remarks.append(f"{days:.3g} {unit} late: {share:.3g} % off {score:g} points.")
        score *= 1.0 - share / 100.0
    bonus = decide("bonus", "Bonus", "{:g} points").value
    is_excused = decide("all", "The whole assignment", "").is_excused
    is_given = any(value is not None for value in (*given, written.value, bonus))
    return replace(
        verdict,
        questions=tuple(questions),
        is_graded=(verdict.is_graded or is_given) and not is_excused and points > 0.0,
        is_excused=is_excused,
        is_waiting=worth > 0.0 and written.value is None and not (written.is_excused or is_excused),
        score=round(score + (bonus or 0.0), 2),
        points=points,
        late=days,
        late_percent=share,
        bonus=bonus or 0.0,
        adjustments=tuple(remarks),
    )


def rule(adjustments: Adjustments, name: str, default: float = 0.0) -> float:
    """The value of a rule of the class."""
    value = adjustments.get((CLASS, name), Decision(None)).value
    return default if value is None else value


def late_percent(days: float, adjustments: Adjustments) -> float:
    """The part of the points that lateness costs [%]."""
    counted = max(0.0, days - rule(adjustments, "late_grace"))
    step = rule(adjustments, "late_step")
    if step:
        counted = step * math.ceil(counted / step - 1e-9)
    return min(counted * rule(adjustments, "late_percent"), rule(adjustments, "late_cap", 100.0))


def read_adjustments(
    out: Path, assignment: Assignment, names: Mapping[str, str], roster: Roster
) -> Adjustments:
    """Read both tables in the folder `out`; an empty ``adjustments.csv`` is written for none.

    A line may use either a student's id or the name for a person, as `names` has them. That of a
    group holds for all members, and what is said of the hand-in of a student who handed in for
    others holds for them. A slip is refused, and costs no points.
    """
    if not (out / BY_HAND).exists():
        write_rows(out / BY_HAND, HEADER, [])
    rows = [
        (f"{path}: line {line}", row, path.name == BY_PAGE)
        for path in (out / BY_HAND, out / BY_PAGE)
        if path.exists()
        for line, row in _read_lines(path)
    ]
    items = {question.id: question.points for question in assignment.questions}
    items |= {"written": 0.0, "bonus": math.inf, "late": math.inf, "all": 0.0}
    decisions: dict[tuple[str, str], Decision] = {}
    places: dict[tuple[str, str], str] = {}
    for location, row, is_by_page in sorted(rows, key=lambda placed: placed[1]["student"] != CLASS):
        name, item, cell = (row[column] for column in HEADER[:3])
        possible = RULES if name == CLASS else items
        if item not in possible:
            raise LabkitError(f"{location}: unknown item {item!r}; {_hint(item.lower(), possible)}")
        student = (
            CLASS if name == CLASS else find_student(name, names, f"{location}: {{}} students")
        )
        decision = _read_decision(item, cell, row.get("comment", ""), possible[item], location)
        decision = decision._replace(is_by_page=is_by_page)
        is_personal = student not in roster.teams and item in ("bonus", "all")
        members = [] if is_personal else roster.members(student)
        for holder in {student, *members}:  # a group's own page tells it, too
            if (holder, item) in decisions:
                raise LabkitError(
                    f"{location}: {item} of {holder!r} is set before, in "
                    f"{places[holder, item]}; keep one of the lines"
                )
            decisions[holder, item] = decision
            places[holder, item] = location
        if (student, item) == (CLASS, "written"):
            items[item] = decision.value or 0.0
    return decisions


def _read_lines(path: Path) -> list[tuple[int, Row]]:
    """The rows of a table with their lines; a column of another name would be lost."""
    columns, rows = read_rows(path, HEADER[:3])
    for name in columns:
        if name not in HEADER and any(row[name] for _, row in rows):
            raise LabkitError(
                f"{path}: line 1: unknown column {name!r}; the columns are {', '.join(HEADER)}"
            )
    return rows


def _read_decision(item: str, cell: str, comment: str, maximum: float, location: str) -> Decision:
    """Read the decision of a line; `LabkitError` where that is unclear."""
    if cell.lower() == EXCUSED and item not in ("late", "bonus", *set(RULES) - {"written"}):
        return Decision(None, comment, is_excused=True)
    if not cell and comment:
        return Decision(None, comment)
    if item == "all":
        raise LabkitError(
            f"{location}: all takes {EXCUSED!r}, or no value and a comment; got {cell!r}"
        )
    value = number(cell)
    if not 0.0 <= value <= maximum or value == math.inf:
        upto = f" from 0 to {maximum:g}" if math.isfinite(maximum) else " from 0"
        way_out = "" if maximum else f"; say what they are worth: {CLASS},written,POINTS,"
        raise LabkitError(f"{location}: {item} must be a number{upto}, got {cell!r}{way_out}")
    return Decision(value, comment)


def find_student(name: str, names: Mapping[str, str], problem: str) -> str:
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
        student: find_student(group, handed_in, f"{path}: line {line}: {{}} hand-ins")
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
    return Roster(names, groups, is_listed=bool(listed))
