"""nbgrader's gradebook takes the points of the questions, and keeps what a person gave."""

import sqlite3
from contextlib import closing

import pytest

from labkit.grading.classroom.nbgrader import read_nbgrader
from labkit.support.errors import LabkitError
from tests.grading.verdicts import question, submission

MADE = """
CREATE TABLE student (id VARCHAR PRIMARY KEY, first_name VARCHAR, last_name VARCHAR);
CREATE TABLE assignment (id VARCHAR PRIMARY KEY, name VARCHAR);
CREATE TABLE notebook (id VARCHAR PRIMARY KEY, assignment_id VARCHAR);
CREATE TABLE base_cell (id VARCHAR PRIMARY KEY, name VARCHAR, notebook_id VARCHAR);
CREATE TABLE grade_cells (id VARCHAR PRIMARY KEY);
CREATE TABLE submitted_assignment (
    id VARCHAR PRIMARY KEY, assignment_id, student_id, UNIQUE (assignment_id, student_id));
CREATE TABLE submitted_notebook (
    id VARCHAR PRIMARY KEY, assignment_id, notebook_id, late_submission_penalty FLOAT,
    UNIQUE (notebook_id, assignment_id));
CREATE TABLE grade (id VARCHAR PRIMARY KEY, notebook_id, cell_id, manual_score, extra_credit,
    needs_manual_grade, UNIQUE (cell_id, notebook_id));
INSERT INTO student VALUES ('ada', 'Ada', 'Lovelace');
INSERT INTO assignment VALUES ('a', 'lab1');
INSERT INTO notebook VALUES ('n', 'a');
INSERT INTO base_cell VALUES ('c', 'check-double', 'n'), ('d', 'words', 'n'), ('e', 'double', 'n');
INSERT INTO grade_cells VALUES ('c'), ('d');
"""
SCORES = """
SELECT student_id, cell_id, manual_score FROM grade
JOIN submitted_notebook ON submitted_notebook.id = grade.notebook_id
JOIN submitted_assignment ON submitted_assignment.id = submitted_notebook.assignment_id
"""


@pytest.fixture
def gradebook(tmp_path):
    with closing(sqlite3.connect(tmp_path / "gradebook.db")) as database:
        database.executescript(MADE)
    return tmp_path / "gradebook.db"


def mark(student, score, **more):
    return submission(student, question("double", 2.0, score), **more)


def scores(path):
    with closing(sqlite3.connect(path)) as database:
        return database.execute(SCORES).fetchall()


def test_who_has_a_mark_has_the_points_of_each_question(gradebook, tmp_path):
    book = read_nbgrader(gradebook, "lab1")
    marks = [mark("ada", 1.5), mark("new", 2.0), mark("ill", 0.0, is_graded=False)]

    book.fill(marks, tmp_path / "out.db")

    assert book.people["ada"].name == "Ada Lovelace"
    assert scores(tmp_path / "out.db") == [("ada", "c", 1.5), ("new", "c", 2.0)]
    assert scores(gradebook) == []


def test_lateness_and_bonus_go_where_nbgrader_keeps_them(gradebook, tmp_path):
    """Its exports take the penalty off the sum of the points and the extra credit."""
    late = mark("ada", 1.5, late_percent=20.0, bonus=1.0)

    read_nbgrader(gradebook, "lab1").fill([late], tmp_path / "out.db")

    with closing(sqlite3.connect(tmp_path / "out.db")) as database:
        (credit,) = database.execute("SELECT extra_credit FROM grade").fetchone()
        penalties = database.execute("SELECT late_submission_penalty FROM submitted_notebook")
        assert (credit, penalties.fetchone()) == (1.0, (pytest.approx(0.3),))


@pytest.mark.parametrize("overwrite", [False, True])
def test_points_that_stand_there_stay_unless_they_are_to_be_replaced(
    overwrite, gradebook, tmp_path
):
    read_nbgrader(gradebook, "lab1").fill([mark("ada", 1.5)], tmp_path / "first.db")
    book = read_nbgrader(tmp_path / "first.db", "lab1")

    unfilled = book.fill([mark("ada", 0.5)], tmp_path / "second.db", overwrite=overwrite)

    assert unfilled.occupied == ([] if overwrite else ["ada"])
    assert scores(tmp_path / "second.db") == [("ada", "c", 0.5 if overwrite else 1.5)]


def test_a_file_or_an_assignment_that_does_not_fit_is_named(gradebook, tmp_path):
    (tmp_path / "scores.csv").write_text("student,score\nada,1\n", encoding="utf-8")

    with pytest.raises(LabkitError, match=r"scores\.csv: is no gradebook of nbgrader"):
        read_nbgrader(tmp_path / "scores.csv", "lab1")
    with pytest.raises(LabkitError, match=r"'lab2' has no cell check-\.\.\.; there are lab1"):
        read_nbgrader(gradebook, "lab2")
    book, other = read_nbgrader(gradebook, "lab1"), submission("ada", question("negate", 3.0, 3.0))
    with pytest.raises(LabkitError, match=r"no cell for 'Negate'; make the assignment anew"):
        book.fill([other], tmp_path / "out.db")
