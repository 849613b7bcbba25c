"""What people decide survives every run, and no slip in it passes in silence."""

import errno
import os
import re
import stat
from dataclasses import replace

import pytest

from labkit.grading.box.outside import Wall
from labkit.grading.classroom.gradebooks import COMMENT, Gradebook, Person
from labkit.grading.classroom.marks import (
    Decision,
    Roster,
    make_marks,
    read_adjustments,
    read_roster,
)
from labkit.grading.classroom.pages import student_page
from labkit.grading.classroom.store import (
    VERDICTS,
    Record,
    file_name,
    fingerprint,
    read_records,
    write_record,
)
from labkit.grading.questions import read_assignment
from labkit.support.errors import LabkitError
from tests.grading.verdicts import question, submission

ROSTER = Roster({"emmy": "Emmy Noether"})
NAMES = {"ada": "Ada Lovelace", "emmy": "Emmy Noether", "4711": "twin", "4712": "twin"}


def record(student, late=0.0, double=2.0, negate=3.0):
    verdict = submission(student, question("double", 2.0, double), question("negate", 3.0, negate))
    return Record(verdict=verdict, fingerprint="1", code="", late=late)


@pytest.fixture
def decide(small, tmp_path):
    def read(*lines):
        text = "\n".join(["student,what,value,comment", *lines])
        (tmp_path / "adjustments.csv").write_text(text, encoding="utf-8")
        return read_adjustments(tmp_path, read_assignment(small), NAMES, ROSTER)

    return read


@pytest.fixture
def marks(small):
    def make(adjustments, *records):
        named = {one.verdict.student: one for one in records}
        return make_marks(named, adjustments, read_assignment(small), ROSTER)

    return make


def test_points_are_set_added_and_told(decide, marks):
    adjustments = decide(
        "Ada Lovelace,double,1.5,you showed me the sheet", "*,written,15,",
        "ada,written,12,well said",
    )  # fmt: skip
    (mark,) = marks(adjustments, record("ada"))
    assert (mark.score, mark.points) == (16.5, 20.0)
    assert mark.adjustments == (
        "Double: set by your instructor to 1.5 of 2 points: you showed me the sheet.",
        "Written answers: 12 of 15 points: well said.",
    )


@pytest.mark.parametrize(
    ("lines", "score"),
    [
        ([], 5.0),
        (["*,late_percent,10,"], 3.5),
        (["*,late_percent,10,", "ada,late,0,a note from the doctor"], 5.0),
        (["*,late_percent,90,"], 0.0),
        (["*,late_percent,10,", "*,late_grace,1,"], 4.0),
        (["*,late_percent,10,", "*,late_step,2,"], 3.0),
        (["*,late_percent,10,", "*,late_step,1,"], 3.5),
        (["*,late_percent,90,", "*,late_cap,50,"], 2.5),
        (["*,late_percent,10,", "ada,bonus,1,"], 4.5),
    ],
)
def test_lateness_is_computed_when_marks_are(lines, score, decide, marks):
    assert marks(decide(*lines), record("ada", late=3.0))[0].score == score


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("Ada,double,1,", "line 2: no students are called 'Ada'; did you mean 'ada'"),
        ("twin,double,1,", "line 2: 2 students are called 'twin'"),
        ("ada,doubel,1,", "line 2: unknown item 'doubel'; did you mean 'double'?"),
        (
            "*,double,1,",
            "line 2: unknown item 'double'; there are late_percent, late_grace, "
            "late_step, late_cap, written",
        ),
        ("ada,double,2.5,", "line 2: double must be a number from 0 to 2, got '2.5'"),
        ("*,written,inf,", "line 2: written must be a number from 0, got 'inf'"),
        ("*,late_cap,150,", "line 2: late_cap must be a number from 0 to 100, got '150'"),
        ("ada,late,inf,", "line 2: late must be a number from 0, got 'inf'"),
        ("ada,written,3,", "got '3'; say what they are worth: *,written,POINTS,"),
        ("ada,double,,", "line 2: double must be a number from 0 to 2, got ''"),
        ("ada,all,3,", "line 2: all takes 'excused', or no value and a comment; got '3'"),
        ("ada,bonus,excused,", "line 2: bonus must be a number from 0, got 'excused'"),
        ("ada,double,1,\nada,double,2,", "line 3: double of 'ada' is set before, in "),
        ('ada,double,1,"open\nada', ": unexpected end of data; put text that holds a comma in"),
    ],
)
def test_a_slip_is_named_and_ends_the_run(line, message, decide):
    with pytest.raises(LabkitError) as error:
        decide(line)
    assert message in str(error.value)


def test_a_column_of_another_name_is_not_lost(small, tmp_path):
    (tmp_path / "adjustments.csv").write_text("student,what,value,\nada,all,,well done\n", "utf-8")

    with pytest.raises(LabkitError, match="line 1: unknown column '';"):
        read_adjustments(tmp_path, read_assignment(small), NAMES, ROSTER)


def test_a_comment_needs_no_points(decide, marks):
    (mark,) = marks(decide("ada,double,,nice and short", "ada,all,,well done"), record("ada"))

    assert mark.score == 5.0
    assert mark.adjustments == ("Double: nice and short.", "The whole assignment: well done.")


def test_an_excused_question_counts_neither_way(decide, marks):
    (mark,) = marks(decide("ada,negate,excused,ill"), record("ada", double=1.0))

    assert (mark.score, mark.points) == (1.0, 2.0)
    assert mark.adjustments == ("Negate: excused: ill.",)


def test_excused_written_answers_count_neither_way(decide, marks):
    adjustments = decide("*,written,4,", "ada,written,excused,", "emmy,written,1,")

    ada, emmy = marks(adjustments, record("ada"), record("emmy"))

    assert (ada.score, ada.points) == (5.0, 5.0)
    assert (emmy.score, emmy.points) == (6.0, 9.0)


def test_who_is_excused_has_no_mark(decide, marks, tmp_path):
    (mark,) = marks(decide("ada,all,excused,"), record("ada"))
    book = Gradebook(("Grade",), "Grade", (), {"ada": Person({}, "Ada", 5.0)}, excused="EX")

    book.fill([mark], tmp_path / "g.csv")

    assert not mark.is_graded
    assert (tmp_path / "g.csv").read_text(encoding="utf-8") == "Grade\nEX\n"


def test_what_the_page_for_reading_saved_counts_beside_what_is_set_by_hand(decide, marks, tmp_path):
    (tmp_path / "points.csv").write_text(
        'student,what,value,comment\n"ada","negate","1","see line 3"\n', encoding="utf-8"
    )

    (mark,) = marks(decide("ada,double,1,"), record("ada"))

    assert mark.score == 2.0
    with pytest.raises(LabkitError, match=r"points.csv: line 2: negate of 'ada' is set before"):
        decide("ada,negate,1,")


def test_rules_of_the_class_hold_wherever_they_stand(decide):
    lines = ["ada,written,12,", "*,written,15,", "*,late_percent,10,", "emmy,late,2,"]

    assert decide(*lines) == decide(*lines[::-1])


def test_an_empty_table_is_made_and_what_excel_makes_of_it_is_read(small, tmp_path):
    path, assignment = tmp_path / "adjustments.csv", read_assignment(small)
    assert not read_adjustments(tmp_path, assignment, {}, ROSTER)
    assert path.read_text() == "student,what,value,comment\n"
    assert read_roster(tmp_path, NAMES, {}) == ({}, {}, False)
    path.write_text("\ufeffstudent;what;value;comment\nada;double;0,5;\n;;;\n", encoding="utf-8")
    assert read_adjustments(tmp_path, assignment, NAMES, ROSTER)["ada", "double"] == Decision(0.5)


def test_records_come_back_as_they_were_for_their_owner_alone(tmp_path):
    kept = record("../Ada L"), record("ada", late=2.0)
    assert not read_records(tmp_path)
    for one in kept:
        write_record(tmp_path, one)
    assert list(read_records(tmp_path).values()) == list(kept)
    path = tmp_path / VERDICTS / "ada.json"
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    path.write_text(path.read_text()[:-9])
    with pytest.raises(LabkitError, match=r"ada\.json: is damaged.*; delete it and run again"):
        read_records(tmp_path)


def test_a_full_disk_keeps_all_verdicts_until_then(tmp_path, monkeypatch):
    read_records(tmp_path)
    write_record(tmp_path, record("ada"))
    monkeypatch.setattr("labkit.support.files.os.replace", full)
    for student in ("ada", "emmy"):
        with pytest.raises(LabkitError, match="No space left"):
            write_record(tmp_path, record(student, double=0.0))
    assert read_records(tmp_path) == {"ada": record("ada")}


def full(temporary, target):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_every_student_has_files_of_their_own():
    """The second of each pair once had the first one's page, or a place elsewhere."""
    names = ["ada l", "ada-l-71b1e478", "ada-l", "Ada-L", "../../x", "x", "a" * 70, "a" * 71]
    files = [file_name(name) for name in names]
    assert len({file.lower() for file in files}) == len(names)
    assert all(re.fullmatch(r"[\w+-]+", file) for file in files)


def test_another_wall_limit_or_file_is_another_verdict(small):
    assignment = read_assignment(small)
    marks = {
        fingerprint({"a.py": b"1"}, assignment, Wall("user")),
        fingerprint({"a.py": b"1"}, assignment, Wall("none")),
        fingerprint({"a.py": b"1"}, assignment, Wall("user", seconds=9.0)),
        fingerprint({"b.py": b"1"}, assignment, Wall("user")),
        fingerprint({"a.py": b"1", "b.py": b"2"}, assignment, Wall("user")),
        fingerprint({"a.py": b'1["b.py"]2'}, assignment, Wall("user")),
        fingerprint({"a.py": b'1["b.py", 1]2'}, assignment, Wall("user")),
        fingerprint({"a.py": b"2"}, assignment, Wall("user")),
        fingerprint({"a.py": b"1"}, replace(assignment, digest="x"), Wall("user")),
    }
    assert len(marks) == 9


def test_points_for_one_who_handed_in_nothing_are_kept(decide, marks):
    given = decide("emmy,double,1.5,by word of mouth", "4711,late,1,", "*,late_percent,10,")
    found = marks(given, record("ada"))
    assert [(mark.submission, mark.score) for mark in found] == [
        ("ada", 5.0),
        ("Emmy Noether", 1.5),
    ]


def test_who_handed_in_nothing_is_told_so_once(decide, marks, small, tmp_path):
    """The page of points by word of mouth once named each function that was not there."""
    (mark,) = marks(decide("emmy,double,1.5,"))
    page = student_page(mark, read_assignment(small))
    person = Person({}, "Emmy Noether", 5.0)

    Gradebook(("Grade", COMMENT), "Grade", (), {"emmy": person}).fill([mark], tmp_path / "g.csv")

    comment = (tmp_path / "g.csv").read_text(encoding="utf-8")
    for text in (page, comment):
        assert text.count("Nothing was handed in.") == 1
        assert "no function" not in text
        assert "cases" not in text


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["ada,red", "ada,blue"], "lines 2 and 3: 'ada' is listed twice; keep one"),
        (["ann,ada", "ada,red"], "line 2: 'ada' is to hand in for 'ann', but 'red' for 'ada', on"),
        (["ada,red", "ann,ada"], "'red' for 'ada', on line 2; write one name in both lines"),
    ],
)
def test_a_roster_with_two_marks_for_one_student_is_refused(lines, message, tmp_path):
    """The order of its lines once chose the mark."""
    (tmp_path / "roster.csv").write_text("\n".join(["student,group", *lines]), encoding="utf-8")

    with pytest.raises(LabkitError) as error:
        read_roster(tmp_path, {name: name for name in ("ada", "red", "blue")}, {})

    assert message in str(error.value)


def test_who_hands_in_for_others_keeps_the_mark(small):
    """A student, not a folder: the roster leaves the own cell empty."""
    roster = Roster({"ada": "Ada", "emmy": "Emmy"}, {"emmy": "ada"})

    found = make_marks({"ada": record("ada")}, {}, read_assignment(small), roster)

    assert [(mark.student, mark.score) for mark in found] == [("ada", 5.0), ("emmy", 5.0)]


def test_what_a_hand_in_is_given_holds_for_all_whose_it_is_and_an_excuse_for_one(small, tmp_path):
    """A student hands in for another one: the page for reading knows the first name alone."""
    roster = Roster({"ada": "Ada", "emmy": "Emmy"}, {"emmy": "ada"})
    text = "student,what,value,comment\n*,written,4,\nada,written,3,\nada,bonus,1,\n"
    (tmp_path / "adjustments.csv").write_text(f"{text}emmy,double,1,\n", encoding="utf-8")

    adjustments = read_adjustments(tmp_path, read_assignment(small), NAMES, roster)
    ada, emmy = make_marks({"ada": record("ada")}, adjustments, read_assignment(small), roster)

    assert (ada.score, emmy.score) == (9.0, 7.0)
    assert not emmy.is_waiting


@pytest.mark.parametrize(
    ("handed_in", "message"),
    [
        (
            {"red": "red"},
            "(leave the cell empty if the group handed in nothing); did you mean 'red'?",
        ),
        ({"1": "rde", "2": "rde"}, "line 3: 2 hand-ins are called 'rde'"),
    ],
)
def test_a_group_that_fits_no_one_hand_in_is_refused(handed_in, message, tmp_path):
    text = "student,name,group\nada,Ada,\nemmy,Emmy,rde\n"
    (tmp_path / "roster.csv").write_text(text, encoding="utf-8")

    with pytest.raises(LabkitError) as error:
        read_roster(tmp_path, handed_in | {"ada": "ada"}, {})

    assert message in str(error.value)


def test_a_group_that_handed_in_nothing_is_not_refused(tmp_path):
    text = "student,name,group\nada,Ada,\nemmy,Emmy,red\n"
    (tmp_path / "roster.csv").write_text(text, encoding="utf-8")

    assert read_roster(tmp_path, {"ada": "ada"}, {}).names == {"ada": "Ada", "emmy": "Emmy"}
