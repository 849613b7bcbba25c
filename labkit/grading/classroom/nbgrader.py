"""nbgrader's gradebook takes the points of the questions, for its formgrader and its exports.

It is a database of SQLite, written here as it stands: nbgrader pins other packages than the lab,
and would run students' code to fill it. What lateness costs of these points is nbgrader's penalty
of a notebook, and a bonus the extra credit of its first question. Written answers are nbgrader's.
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from labkit.grading.classroom.gradebooks import Person, Unfilled
from labkit.grading.judge.verdict import SubmissionVerdict
from labkit.support.errors import LabkitError
from labkit.support.files import atomic_write

CELLS = """
    SELECT base_cell.name, base_cell.id, notebook.id, assignment.id
    FROM grade_cells JOIN base_cell USING (id) JOIN notebook ON notebook.id = base_cell.notebook_id
    JOIN assignment ON assignment.id = notebook.assignment_id
    WHERE assignment.name = ? AND base_cell.name LIKE 'check-%'  -- of a question
"""
RELEASE = "make the assignment anew by `nbgrader generate_assignment`"
NEW_ID = "lower(hex(randomblob(16)))"
OF_STUDENT = "WHERE submitted_assignment.assignment_id = :assignment AND student_id = :student"
HANDED_IN = f"""
    FROM submitted_notebook JOIN submitted_assignment
    ON submitted_assignment.id = submitted_notebook.assignment_id {OF_STUDENT}
"""
HAND_IN = (  # unless it is there
    "INSERT OR IGNORE INTO student (id) VALUES (:student)",
    f"INSERT OR IGNORE INTO submitted_assignment (id, assignment_id, student_id) "
    f"VALUES ({NEW_ID}, :assignment, :student)",
    f"INSERT OR IGNORE INTO submitted_notebook (id, assignment_id, notebook_id) "
    f"SELECT {NEW_ID}, id, :notebook FROM submitted_assignment {OF_STUDENT}",
)
SCORED = f"""
    SELECT 1 FROM grade WHERE manual_score IS NOT NULL
    AND notebook_id IN (SELECT submitted_notebook.id {HANDED_IN})
"""
SCORE = f"""
    INSERT INTO grade (id, notebook_id, cell_id, manual_score, extra_credit, needs_manual_grade)
    SELECT {NEW_ID}, submitted_notebook.id, :cell, :score, :bonus, 0 {HANDED_IN}
    ON CONFLICT (cell_id, notebook_id) DO UPDATE
    SET manual_score = :score, extra_credit = :bonus, needs_manual_grade = 0
"""
PENALTY = f"""
    UPDATE submitted_notebook SET late_submission_penalty = :penalty
    WHERE id IN (SELECT submitted_notebook.id {HANDED_IN})
"""


class NbgraderBook(NamedTuple):
    """A gradebook of nbgrader, which can be filled in as a `Gradebook` can."""

    path: str | Path
    people: Mapping[str, Person]
    cells: Mapping[str, str]  # the id of the cell that gives the points of a question
    ids: Mapping[str, str]  # of their notebook and assignment

    def fill(
        self, marks: Iterable[SubmissionVerdict], out: Path, *, overwrite: bool = False
    ) -> Unfilled:
        """Write a copy with the points of those who have a mark, by hand where nbgrader asks."""
        unfilled = Unfilled([], [], [])
        with closing(sqlite3.connect(":memory:")) as database:
            database.deserialize(Path(self.path).read_bytes())
            for mark in filter(lambda mark: mark.is_graded, marks):
                of: dict[str, object] = {"student": mark.student, **self.ids}
                if not overwrite and database.execute(SCORED, of).fetchone():
                    unfilled.occupied.append(mark.student)
                    continue
                for statement in HAND_IN:
                    database.execute(statement, of)
                points = sum(question.score for question in mark.questions)
                database.execute(PENALTY, of | {"penalty": points * mark.late_percent / 100.0})
                for place, question in enumerate(mark.questions):
                    cell = self.cells.get(question.question)
                    if cell is None:
                        raise LabkitError(f"{self.path}: no cell for {question.title!r}; {RELEASE}")
                    bonus = mark.bonus if place == 0 else 0.0
                    values = {"cell": cell, "score": question.score, "bonus": bonus}
                    database.execute(SCORE, of | values)
            database.commit()
            with atomic_write(out, "wb") as file:
                file.write(database.serialize())
        return unfilled


def read_nbgrader(path: str | Path, assignment: str) -> NbgraderBook:
    """Read the students of nbgrader's ``gradebook.db``, and the cells of one of its assignments."""
    try:
        with closing(sqlite3.connect(f"{Path(path).absolute().as_uri()}?mode=ro", uri=True)) as db:
            students = db.execute("SELECT id, first_name, last_name FROM student").fetchall()
            cells = db.execute(CELLS, [assignment]).fetchall()
            (names,) = db.execute("SELECT group_concat(name, ', ') FROM assignment").fetchone()
    except sqlite3.Error as error:
        raise LabkitError(f"{path}: is no gradebook of nbgrader: {error}") from None
    if not cells:
        raise LabkitError(f"{path}: {assignment!r} has no cell check-...; there are {names}")
    ids = {name.removeprefix("check-").replace("-", "_"): cell for name, cell, _, _ in cells}
    people = {
        id: Person({}, f"{first or ''} {last or ''}".strip() or id, math.nan)
        for id, first, last in students
    }
    *_, notebook, found = cells[0]
    return NbgraderBook(path, people, ids, {"notebook": notebook, "assignment": found})
