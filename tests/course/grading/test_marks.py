"""What people decide survives every run, and no slip in it passes in silence."""

import stat
from dataclasses import replace

import pytest

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.contract import Limits
from labkit.course.grading.judging.verdict import QuestionVerdict, SubmissionVerdict
from labkit.course.grading.marks import (
    ADJUSTMENTS,
    Adjustments,
    make_marks,
    read_adjustments,
    read_roster,
)
from labkit.course.grading.store import VERDICTS, VerdictStore, fingerprint
from labkit.errors import LabkitError

NAMES = {"ada": "Ada Lovelace", "emmy": "Emmy Noether", "4711": "twin", "4712": "twin"}


def verdict(student, double=2.0, negate=3.0):
    questions = tuple(
        QuestionVerdict(
            question=id, title=id, points=points, score=score, cases=(), misconception=None,
            message="",
        )
        for id, points, score in (("double", 2.0, double), ("negate", 3.0, negate))
    )  # fmt: skip
    return SubmissionVerdict(
        student=student, submission=student, mode="none", questions=questions,
        score=double + negate, points=5.0, notes=(), seconds=0.0,
    )  # fmt: skip


@pytest.fixture
def decide(small, tmp_path):
    def read(*lines):
        text = "\n".join(["student,what,value,comment", *lines])
        (tmp_path / ADJUSTMENTS).write_text(text, encoding="utf-8")
        return read_adjustments(tmp_path, load_assignment(small), NAMES)

    return read


@pytest.fixture
def store(tmp_path):
    with VerdictStore(tmp_path) as store:
        yield store


@pytest.fixture
def marks(store, small):
    return lambda adjustments: make_marks(store, adjustments, load_assignment(small))


@pytest.fixture
def scores(marks):
    return lambda adjustments: {mark.student: mark.score for mark in marks(adjustments)}


def test_points_are_set_added_and_told(store, decide, marks):
    store.put(verdict("ada"), "1")
    adjustments = decide(
        "ada,double,1.5,you showed me the sheet", "Ada Lovelace,bonus,0.5,", "*,written,15,",
        "ada,written,12,well said",
    )  # fmt: skip
    (mark,) = marks(adjustments)
    assert (mark.score, mark.points) == (17.0, 20.0)
    assert mark.adjustments == (
        "double: set by your instructor to 1.5 of 2 points: you showed me the sheet.",
        "+0.5 points by your instructor.",
        "Written answers: 12 of 15 points: well said.",
    )


@pytest.mark.parametrize(
    ("lines", "score"),
    [
        ([], 5.0),
        (["*,late_percent,10,"], 3.5),
        (["*,late_percent,10,", "*,late_cap,20,"], 4.0),
        (["*,late_percent,10,", "*,late_grace,3,"], 5.0),
        (["*,late_percent,10,", "ada,late,0,a note from the doctor"], 5.0),
        (["*,late_percent,10,", "ada,extension,2,"], 4.5),
        (["*,late_percent,90,"], 0.0),
    ],
)
def test_lateness_is_computed_when_marks_are(lines, score, store, decide, scores):
    store.put(verdict("ada"), "1", late=3.0)
    assert scores(decide(*lines)) == {"ada": score}


def test_what_the_platform_says_later_counts(store, decide, scores):
    store.put(verdict("ada"), "1", late=3.0)
    store.set_late("ada", 0.0)
    assert scores(decide("*,late_percent,10,")) == {"ada": 5.0}


def test_a_group_gets_the_best_that_is_left_of_its_submissions(store, decide, scores, marks):
    """One member's is better but late: after lateness the other's is worth more."""
    store.put(verdict("ada"), "1", late=9.0)
    store.put(verdict("emmy", double=0.0), "1")
    group = ["ada,group,A,", "emmy,group,A,", "4711,group,A,"]
    assert scores(decide(*group)) == {"ada": 5.0, "emmy": 5.0, "4711": 5.0}
    late = decide(*group, "*,late_percent,10,")
    assert scores(late) == {"ada": 3.0, "emmy": 3.0, "4711": 3.0}
    assert marks(late)[0].notes == ("Handed in by emmy for A.",)
    own = decide(*group, "ada,double,0,it was not yours")
    assert scores(own) == {"ada": 3.0, "emmy": 5.0, "4711": 5.0}


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("Ada,double,1,", "line 2: 'Ada' is no student of this class; is it ada"),
        ("twin,double,1,", "line 2: 'twin' is the name of 2 students"),
        ("ada,doubel,1,", "line 2: it must name one of double, negate, bonus, "),
        ("*,double,1,", "line 2: it must name one of late_percent, "),
        ("ada,double,2.5,", "line 2: double must be a number from 0 to 2, got '2.5'"),
        ("ada,late,soon,", "line 2: late must be a number, got 'soon'"),
        ("ada,bonus,inf,", "line 2: bonus must be a number, got 'inf'"),
        ("ada,written,3,", "got '3'; say what they are worth: *,written,POINTS,"),
        ("ada,group,A,\nada,group,B,", "line 3: 'ada' must have one group, got 'B'"),
    ],
)
def test_a_slip_is_named_and_ends_the_run(line, message, decide):
    with pytest.raises(LabkitError) as error:
        decide(line)
    assert message in str(error.value)


def test_excels_semicolons_and_commas_are_read(small, tmp_path):
    text = "\ufeffstudent;what;value;comment\nada;double;0,5;\n"
    (tmp_path / ADJUSTMENTS).write_text(text, encoding="utf-8")
    adjustments = read_adjustments(tmp_path, load_assignment(small), NAMES)
    assert adjustments.lines["ada", "double"].value == 0.5


def test_an_empty_table_is_made_to_be_filled_in(small, tmp_path):
    assert not read_adjustments(tmp_path, load_assignment(small), {}).lines
    assert (tmp_path / ADJUSTMENTS).read_text() == "student,what,value,comment\n"
    assert not read_roster(tmp_path)


def test_a_line_that_was_cut_off_costs_one_verdict(tmp_path):
    with VerdictStore(tmp_path) as store:
        store.put(verdict("ada"), "1")
        store.put(verdict("emmy"), "2")
    path = tmp_path / VERDICTS
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    path.write_bytes(path.read_bytes()[:-9])
    with VerdictStore(tmp_path) as store:
        assert store.students == ["ada"]
        store.put(verdict("emmy"), "3")
    with VerdictStore(tmp_path) as store:
        assert store["emmy"] == verdict("emmy")
        assert store.fingerprint("emmy") == "3"
        with pytest.raises(LabkitError, match="is in use by another `labkit grade`"):
            VerdictStore(tmp_path)


def test_what_is_no_store_is_left_as_it_is(tmp_path):
    path = tmp_path / VERDICTS
    for text, message in (("mine\n", "no store of verdicts"), (None, "line 2 is damaged")):
        if text is None:
            path.unlink()
            VerdictStore(tmp_path).__exit__(None, None, None)
            text = path.read_text() + "[]\n"  # noqa: PLW2901
        path.write_text(text)
        with pytest.raises(LabkitError, match=message):
            VerdictStore(tmp_path)
        assert path.read_text() == text


def test_a_full_disk_keeps_all_verdicts_until_then(tmp_path, monkeypatch):
    with VerdictStore(tmp_path) as store:
        store.put(verdict("ada"), "1")
        monkeypatch.setattr(store, "_file", Full(store._file))
        with pytest.raises(LabkitError, match=r"no space left.*run the same command again"):
            store.put(verdict("emmy"), "1")
    with VerdictStore(tmp_path) as store:
        assert store.students == ["ada"]


class Full:
    """A file on a disk that takes half of what is written."""

    def __init__(self, file):
        self.file = file

    def __getattr__(self, name):
        return getattr(self.file, name)

    def write(self, data):
        return self.file.write(data[: len(data) // 2])


def test_another_wall_limit_or_file_is_another_verdict(small):
    assignment = load_assignment(small)
    marks = {
        fingerprint({"a.py": b"1"}, assignment, Limits(), "user"),
        fingerprint({"a.py": b"1"}, assignment, Limits(), "none"),
        fingerprint({"a.py": b"1"}, assignment, Limits(seconds=9.0), "user"),
        fingerprint({"b.py": b"1"}, assignment, Limits(), "user"),
        fingerprint({"a.py": b"2"}, replace(assignment, digest="x"), Limits(), "user"),
    }
    assert len(marks) == 5


def test_without_lines_a_verdict_stays_as_it_is():
    assert Adjustments().apply(verdict("ada"), 0.0, "ada") == verdict("ada")


def test_points_for_one_who_handed_in_nothing_are_kept(store, decide, scores):
    store.put(verdict("ada"), "1")
    given = decide("emmy,double,1.5,by word of mouth", "4711,late,1,", "*,late_percent,10,")
    assert scores(given) == {"ada": 5.0, "emmy": 1.5}
