"""What an instructor changes of verdicts: points set by hand, late days, members of a group.

Nothing of it is stored among the verdicts: it is read and applied whenever tables and pages
are written, so that it survives every re-grade.
"""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.course.grading.store import VerdictStore
from labkit.errors import LabkitError
from labkit.files import read_table

BONUS, LATE = "bonus", "late"  # in the column of questions: points on top, days late


@dataclass(frozen=True, kw_only=True)
class Override:
    """One line of the overrides file.

    Attributes
    ----------
    points : float
        What the question gets; with "bonus" what is added to the sum, with "late" the days.
    comment : str
        For the student.
    """

    points: float
    comment: str


@dataclass(frozen=True, kw_only=True)
class Adjustments:
    """All that is changed when results are written.

    Attributes
    ----------
    overrides : mapping of (str, str) to Override
        By student and question (or "bonus", or "late").
    per_day : float
        The share of the score [%] that a day late costs.
    groups : mapping of str to str
        The group of each student who is in one: one submission counts for all of a group.
    """

    overrides: Mapping[tuple[str, str], Override] = field(default_factory=dict)
    per_day: float = 0.0
    groups: Mapping[str, str] = field(default_factory=dict)

    def apply(self, verdict: SubmissionVerdict) -> SubmissionVerdict:
        """The verdict with everything that is changed of it, each change told to the student."""
        told: list[str] = []
        questions = []
        for one in verdict.questions:
            override = self.overrides.get((verdict.student, one.question))
            if override:
                told.append(
                    f"{one.title}: set by your instructor to {override.points:g} of "
                    f"{one.points:g} points{_because(override)}"
                )
                one = replace(one, score=override.points)  # noqa: PLW2901
            questions.append(one)
        score = round(sum(one.score for one in questions), 2)
        bonus = self.overrides.get((verdict.student, BONUS))
        if bonus:
            told.append(f"{bonus.points:+g} points by your instructor{_because(bonus)}")
            score += bonus.points
        waived = self.overrides.get((verdict.student, LATE))
        days = waived.points if waived else verdict.late
        share = min(1.0, days * self.per_day / 100.0)
        if days:
            told.append(
                f"{days:g} day{'' if days == 1 else 's'} late{_because(waived)[:-1]}: "
                f"{100.0 * share:g} % off {score:g} points."
            )
        elif verdict.late:
            told.append(f"Not counted as late{_because(waived)}")
        score = round(max(0.0, score) * (1.0 - share), 2)
        return replace(
            verdict,
            questions=tuple(questions),
            score=score,
            late=days,
            adjustments=tuple(told),
        )

    def idle(self, students: Iterable[str]) -> list[str]:
        """The groups of which nobody is among the students, who have verdicts."""
        active = {self.groups.get(student) for student in students}
        return sorted(set(self.groups.values()) - active)


class Adjusted:
    """The adjusted verdicts on a class, by student; all of a group get the best one that it has.

    They are read from the store each time that somebody goes through them: of a class of
    thousands no more than one is in memory.

    Parameters
    ----------
    store : VerdictStore
    students : sequence of str
        Whose verdicts; others of their groups come with them.
    adjustments : Adjustments
    """

    def __init__(
        self, store: VerdictStore, students: Sequence[str], adjustments: Adjustments
    ) -> None:
        self._store = store
        self._adjustments = adjustments
        groups = adjustments.groups
        best: dict[str, tuple[float, str]] = {}
        for student in students:
            if student in groups:
                score, group = store[student].score, groups[student]
                if group not in best or score > best[group][0]:
                    best[group] = score, student
        self._sources = {student: student for student in students if student not in groups}
        self._sources |= {
            member: best[group][1] for member, group in groups.items() if group in best
        }

    @property
    def students(self) -> list[str]:
        """All who get a verdict, in alphabetical order."""
        return sorted(self._sources)

    def __iter__(self) -> Iterator[SubmissionVerdict]:
        for student in self.students:
            source, group = self._sources[student], self._adjustments.groups.get(student)
            verdict = self._store[source]
            if group is not None:
                note = f"Handed in by {source} for {group}."
                verdict = replace(verdict, student=student, notes=(note, *verdict.notes))
            yield self._adjustments.apply(verdict)


def _because(override: Override | None) -> str:
    return f": {override.comment}." if override and override.comment else "."


def read_overrides(
    path: str | os.PathLike[str], assignment: Assignment
) -> dict[tuple[str, str], Override]:
    """Read ``student,question,points,comment``; the last line on the same question counts.

    Raises
    ------
    LabkitError
        Where it cannot be read, or a line names no question, or no possible points; the
        message says which line.
    """
    points = {one.id: one.points for one in assignment.questions}
    found: dict[tuple[str, str], Override] = {}
    for line, row in _rows(path, ("student", "question", "points")):
        question = row["question"]
        if question not in points and question not in (BONUS, LATE):
            raise LabkitError(
                f"{path}: line {line}: the question must be one of {', '.join(points)}, "
                f"{BONUS} or {LATE}, got {question!r}"
            )
        try:
            amount = float(row["points"].replace(",", "."))
        except ValueError:
            amount = math.nan
        most = points.get(question, math.inf)
        least = -math.inf if question == BONUS else 0.0
        if not math.isfinite(amount) or not least <= amount <= most:
            raise LabkitError(
                f"{path}: line {line}: the points must be a number"
                f"{f' from 0 to {most:g}' if question in points else ''}, got {row['points']!r}"
            )
        found[row["student"], question] = Override(points=amount, comment=row.get("comment", ""))
    return found


def read_groups(path: str | os.PathLike[str]) -> dict[str, str]:
    """Read ``student,group``.

    Raises
    ------
    LabkitError
        Where it cannot be read, or puts a student into two groups.
    """
    found: dict[str, str] = {}
    for line, row in _rows(path, ("student", "group")):
        if not row["student"] or not row["group"]:
            raise LabkitError(f"{path}: line {line}: it must name a student and a group")
        if found.setdefault(row["student"], row["group"]) != row["group"]:
            raise LabkitError(
                f"{path}: line {line}: {row['student']!r} is in two groups; take one line out"
            )
    return found


def _rows(
    path: str | os.PathLike[str], needed: tuple[str, ...]
) -> Iterator[tuple[int, dict[str, str]]]:
    """The rows of a CSV file with their lines, cells trimmed."""
    text = read_table(path, "save it as CSV in UTF-8")
    header = text.partition("\n")[0]
    semicolons = ";" in header and "," not in header  # as Excel writes where 0.5 is 0,5
    reader = csv.DictReader(text.splitlines(), delimiter=";" if semicolons else ",")
    found = reader.fieldnames or []
    missing = [name for name in needed if name not in found]
    if missing:
        raise LabkitError(
            f"{path}: line 1: no column {missing[0]!r}; it must name {', '.join(needed)}, "
            f"got {', '.join(found) or 'nothing'}"
        )
    for row in reader:
        cells = {name: (cell or "").strip() for name, cell in row.items() if name}
        if any(cells.values()):
            yield reader.line_num, cells
