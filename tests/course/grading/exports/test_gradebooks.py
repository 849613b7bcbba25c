"""Each platform's own reading of its format gives the scores back; hostile texts stay texts."""

import csv

import pytest

from labkit.course.grading.exports.gradebooks import (
    fill_canvas,
    fill_moodle,
    lateness_of,
    students_of,
    write_scores,
)
from labkit.errors import LabkitError

CANVAS = (
    "Student,ID,SIS User ID,SIS Login ID,Section,Lab 1 (77),Lab 2 (78),Final Score\n"
    "    Points Possible,,,,,5.00,10.00,(read only)\n"
    '"Lovelace, Ada",4711,a1,ada@x.org,Monday,,3,\n'
    '"Noether, Emmy",99,815,emmy@x.org,Monday,1,,\n'
    '"Hopper, Grace",12,g1,grace@x.org,Monday,2,,\n'
)
MOODLE = (
    "\ufeffIdentifier,Full name,Status,Grade,Maximum Grade,Last modified (grade),"
    "Feedback comments\n"
    'Participant 4711,Ada Lovelace,Submitted,,100.00,"Saturday, 21 November 2026",\n'
    "Participant 815,Emmy Noether,Submitted,,10.00,-,\n"
    "Participant 12,Grace Hopper,No submission,,100.00,-,\n"
)


def rows(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "gradebook.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_canvas_gets_the_scores_of_those_who_were_graded(verdicts, written, tmp_path):
    out = tmp_path / "canvas.csv"
    assert fill_canvas(verdicts, written(CANVAS), "Lab 1", out) == ["=cmd|x"]
    assert rows(out) == [
        ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Lab 1 (77)"],
        ["    Points Possible", "", "", "", "", "5.00"],
        ["Lovelace, Ada", "4711", "a1", "ada@x.org", "Monday", "5"],
        ["Noether, Emmy", "99", "815", "emmy@x.org", "Monday", "0.5"],
    ]


@pytest.mark.parametrize(
    ("possible", "score"),
    [
        ("10.00", "1"),
        ("10,00", "1"),
        ("100", "10"),
        ("0.33", "0.03"),
        ("", "0.5"),
        ("(read only)", "0.5"),
        ("0.00", "0.5"),
        ("nan", "0.5"),
        ("inf", "0.5"),
    ],
)
def test_canvas_gets_scores_of_its_own_scale(verdicts, written, tmp_path, possible, score):
    book = written(CANVAS.replace(",5.00,", f',"{possible}",'))
    fill_canvas(verdicts[1:2], book, "Lab 1", tmp_path / "canvas.csv")
    assert [row[-1] for row in rows(tmp_path / "canvas.csv")[1:]] == [possible, score]


def test_canvas_gets_the_scores_as_they_are_without_its_scale(verdicts, written, tmp_path):
    lines = CANVAS.splitlines(keepends=True)
    fill_canvas(verdicts[1:2], written(lines[0] + lines[3]), "Lab 1", tmp_path / "canvas.csv")
    assert rows(tmp_path / "canvas.csv")[1][-1] == "0.5"


@pytest.mark.parametrize(
    ("header", "turing", "doe"),
    [
        ("ID,SIS User ID,SIS Login ID", "4711,902,alan", "5000,4711,john"),
        ("ID,SIS User ID,SIS Login ID", "4711,902,alan", "5000,900,4711"),
        ("ID,SIS User ID,SIS Login ID", "17,4711,alan", "5000,900,4711"),
        ("SIS User ID,SIS Login ID,ID", "902,alan,4711", "4711,john,5000"),
    ],
)
@pytest.mark.parametrize("first", ["turing", "doe"])
def test_a_number_may_be_another_students_elsewhere(
    verdicts, written, tmp_path, header, turing, doe, first
):
    lines = [f'"Turing, Alan",{turing},\n', f'"Doe, John",{doe},3\n']
    lines = lines if first == "turing" else lines[::-1]
    book = written(f"Student,{header},Lab 1\n" + "".join(lines))
    assert fill_canvas(verdicts[:1], book, "Lab 1", tmp_path / "canvas.csv") == []
    assert [row[0] for row in rows(tmp_path / "canvas.csv")] == ["Student", "Turing, Alan"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (CANVAS.replace(",99,", ",4711,"), "'4711' is row 3 ('Lovelace, Ada') and row 4 ("),
        (CANVAS.replace(",g1,", ",815,"), "'815' is row 4 ('Noether, Emmy') and row 5 ("),
        (
            CANVAS.replace(",a1,", ",815,").replace("99,815", "99,e1"),
            "row 3 ('Lovelace, Ada') is '4711' and '815'",
        ),
    ],
)
def test_canvas_gives_one_student_one_row(verdicts, written, tmp_path, text, says):
    with pytest.raises(LabkitError) as error:
        fill_canvas(verdicts, written(text), "Lab 1", tmp_path / "out.csv")
    assert says in str(error.value)
    assert not (tmp_path / "out.csv").exists()


def test_canvas_names_a_column_that_is_not_there(verdicts, written, tmp_path):
    with pytest.raises(
        LabkitError, match=r"line 1: no column 'Lab 3'; the columns are Lab 1 \(77\)"
    ):
        fill_canvas(verdicts, written(CANVAS), "Lab 3", tmp_path / "out.csv")
    twice = CANVAS.replace("Lab 2 (78)", "Lab 1 (78)")
    with pytest.raises(LabkitError, match="more than one column 'Lab 1'"):
        fill_canvas(verdicts, written(twice), "Lab 1", tmp_path / "out.csv")
    assert not (tmp_path / "out.csv").exists()


def test_moodle_gets_grades_of_its_own_scale_and_keeps_its_times(verdicts, written, tmp_path):
    out = tmp_path / "moodle.csv"
    assert fill_moodle(verdicts, written(MOODLE), out) == ["=cmd|x"]
    header, ada, emmy, grace = rows(out)
    assert header == MOODLE.lstrip("\ufeff").splitlines()[0].split(",")
    assert ada[3:6] == ["100", "100.00", "Saturday, 21 November 2026"]
    assert emmy[3] == "1"
    assert emmy[6].startswith("0.5 of 5 points.<br>Gate (0.5/2): About gate.<br>")
    assert grace[3] == grace[6] == ""


def test_moodle_speaks_other_languages(verdicts, written, tmp_path):
    """Its columns keep their order; the number stands at the end of who it is."""
    words = (
        "ID,Vollst\u00e4ndiger Name,Status,Bewertung,Bestwertung,Zuletzt ge\u00e4ndert,Feedback\n"
    )
    rows = (
        'Teilnehmer/in4711,Ada,Abgegeben,,"100,00","Montag, 12:00",\n'
        'Teilnehmer/in815,Emmy,Abgegeben,,"100,00","Montag, 13:00",\n'
    )
    fill_moodle(verdicts, written(words + rows), tmp_path / "moodle.csv")
    with (tmp_path / "moodle.csv").open(encoding="utf-8", newline="") as file:
        header, ada, emmy = csv.reader(file)
    assert ",".join(header) + "\n" == words
    assert (ada[3], ada[4]) == ("100", "100,00")
    assert ada[6].startswith("5 of 5 points")
    assert (emmy[3], emmy[5]) == ("10", "Montag, 13:00")
    with pytest.raises(LabkitError, match="no column 'Identifier'; the columns are ID"):
        fill_moodle(verdicts, written(words.replace("Bestwertung", "x") + "7,a,b,,,,\n"), "no.csv")


def test_moodle_gives_one_student_one_row(verdicts, written, tmp_path):
    twice = MOODLE.replace("Participant 12,", "Participant 815,")
    with pytest.raises(LabkitError, match=r"'815' is row 3 \('Participant 815'\) and row 4"):
        fill_moodle(verdicts, written(twice), tmp_path / "out.csv")
    assert not (tmp_path / "out.csv").exists()


def test_moodle_comments_are_text_not_markup(verdicts, written, tmp_path):
    hostile = [verdicts[2].__class__(**{**vars(verdicts[2]), "student": "12"})]
    hostile[0] = hostile[0].__class__(**{**vars(hostile[0]), "notes": ("<b>",)})
    fill_moodle(hostile, written(MOODLE), tmp_path / "out.csv")
    assert "&lt;b&gt;" in rows(tmp_path / "out.csv")[3][6]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the gradebook is empty"),
        ("Name,Score\nAda,1\n", "line 1: no column 'Identifier'; the columns are Name, Score"),
        ("Identifier,Grade\na,b,c\n", "row 2 has 3 cells, the header 2"),
        (
            "Identifier,Grade,Maximum Grade\nParticipant 815,,ten\n",
            "row 2: the maximum grade must be a number, got 'ten'",
        ),
    ],
)
def test_a_gradebook_that_cannot_be_filled(verdicts, written, tmp_path, text, says):
    with pytest.raises(LabkitError, match=r"gradebook\.csv: ") as error:
        fill_moodle(verdicts, written(text), tmp_path / "out.csv")
    assert says in str(error.value)
    assert not (tmp_path / "out.csv").exists()
    with pytest.raises(LabkitError, match="cannot be read: No such file"):
        fill_moodle(verdicts, tmp_path / "missing.csv", tmp_path / "out.csv")


def test_the_plain_table_holds_no_formula(verdicts, tmp_path):
    write_scores(verdicts, {"absent": "Nobody"}, tmp_path / "scores.csv")
    assert rows(tmp_path / "scores.csv") == [
        ["student", "submission", "score", "points", "late", "isolation", "gate", "huber"],
        ["absent", *[""] * 7],
        ["4711", "4711.ipynb", "5", "5", "0", "landlock", "2", "3"],
        ["815", "815.ipynb", "0.5", "5", "0", "landlock", "0.5", "0"],
        ["'=cmd|x", "'=cmd|x.ipynb", "0", "2", "0", "landlock", "0", ""],
    ]


def test_who_is_in_a_gradebook_is_known_by_all_names(written):
    assert students_of(written(CANVAS), canvas=True)[1] == (
        ["99", "815", "emmy@x.org"],
        "Noether, Emmy",
    )
    assert students_of(written(MOODLE), canvas=False)[2] == (["12"], "Grace Hopper")
    assert lateness_of(written(MOODLE.replace("Submitted,,10.", "1 week 12 hours late,,10."))) == {
        "4711": 0.0, "815": 7.5, "12": 0.0,
    }  # fmt: skip
