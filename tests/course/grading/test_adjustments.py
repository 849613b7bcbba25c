"""What an instructor changes is read as it is written, and what cannot be read is named."""

import pytest

from labkit.course.grading.adjustments import Adjustments, Override, read_groups, read_overrides
from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.errors import LabkitError

ASSIGNMENT = load_assignment(hidden=False)


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "marks.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize(
    "text",
    [
        "student,question,points,comment\nada,rotation,1.5,seen\n",
        "student;question;points;comment\nada;rotation;1,5;seen\n",
        "\ufeffcomment,points,question,student\nseen, 1.5 ,rotation,ada\n\n",
    ],
    ids=["commas", "semicolons", "another order"],
)
def test_overrides_as_spreadsheets_write_them(written, text):
    found = read_overrides(written(text), ASSIGNMENT)
    assert found == {("ada", "rotation"): Override(points=1.5, comment="seen")}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "name,points\n",
            "line 1: no column 'student'; it must name student, .*, got name, points",
        ),
        ("", "line 1: no column 'student'; .* got nothing"),
        ("student,question,points\nada,turn,1\n", "line 2: the question must be one of .*'turn'"),
        ("student,question,points\nada,rotation,9\n", "line 2: .* a number from 0 to 3, got '9'"),
        ("student,question,points\nada,bonus,much\n", "line 2: .* a number, got 'much'"),
    ],
)
def test_what_is_no_override_is_named(written, text, says):
    with pytest.raises(LabkitError, match=rf"marks\.csv: {says}"):
        read_overrides(written(text), ASSIGNMENT)


def test_a_day_that_is_not_counted_is_told():
    verdict = SubmissionVerdict(
        student="ada", submission="ada.py", mode="none", questions=(), score=4.0, points=5.0,
        notes=(), seconds=0.0, late=1.0,
    )  # fmt: skip
    waived = {("ada", "late"): Override(points=0.0, comment="ill")}
    for overrides, score, told in (
        (waived, 0.0, ("Not counted as late: ill.",)),
        ({}, 0.0, ("1 day late: 10 % off 0 points.",)),
    ):
        found = Adjustments(overrides=overrides, per_day=10.0).apply(verdict)
        assert (found.score, found.adjustments) == (score, told)


def test_nobody_is_in_two_groups(written):
    assert read_groups(written("student,group\nada,A\nada,A\n")) == {"ada": "A"}
    with pytest.raises(LabkitError, match="line 3: 'ada' is in two groups"):
        read_groups(written("student,group\nada,A\nada,B\n"))
