"""Each platform's own reading of its format gives the scores back; hostile texts stay texts."""

import csv
from dataclasses import replace

import pytest

from labkit.grading.classroom.gradebooks import read_canvas, read_moodle, write_scores
from labkit.support.errors import LabkitError

CANVAS = (
    "Student,ID,SIS User ID,SIS Login ID,Section,Lab 1 (77),Lab 2 (78),Final Score\n"
    "    Points Possible,,,,,5.00,10.00,(read only)\n"
    '"Lovelace, Ada",4711,a1,ada@x.org,Monday,,3,\n'
    '"Noether, Emmy",815,e1,emmy@x.org,Monday,1,,\n'
    '"Hopper, Grace",12,g1,grace@x.org,Monday,2,,\n'
)
MOODLE = (
    "\ufeffIdentifier,Full name,Status,Grade,Maximum Grade,Last modified (grade),"
    "Feedback comments\n"
    'Participant 4711,Ada Lovelace,Submitted,,100.00,"Saturday, 21 November 2026",\n'
    "Participant 815,Emmy Noether,1 week 12 hours late,,10.00,-,\n"
    "Participant 12,Grace Hopper,No submission,,100.00,-,\n"
)


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out.csv"


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "gradebook.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def rows(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_canvas_gets_the_scores_of_those_who_were_graded(verdicts, written, out):
    book = read_canvas(written(CANVAS), "Lab 1")
    assert book.fill(verdicts, out, overwrite=True) == (["=cmd|x"], [], [])
    assert rows(out) == [
        ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Lab 1 (77)"],
        ["Points Possible", "", "", "", "", "5.00"],
        ["Lovelace, Ada", "4711", "a1", "ada@x.org", "Monday", "5"],
        ["Noether, Emmy", "815", "e1", "emmy@x.org", "Monday", "0.5"],
    ]


@pytest.mark.parametrize(
    ("possible", "score"),
    [("10,00", "1"), ("0.33", "0.03"), ("(read only)", "0.5"), ("0.00", "0.5"), ("inf", "0.5")],
)
def test_canvas_gets_scores_of_its_own_scale(verdicts, written, out, possible, score):
    book = read_canvas(written(CANVAS.replace(",5.00,", f',"{possible}",')), "Lab 1")
    book.fill(verdicts[1:2], out, overwrite=True)
    assert [row[-1] for row in rows(out)[1:]] == [possible, score]


def test_a_semicolon_in_a_title_is_no_delimiter(verdicts, written, out):
    book = read_canvas(written(CANVAS.replace("Lab 1 (", "Lab; 1 (")), "Lab; 1")

    book.fill(verdicts[:1], out)

    assert rows(out)[-1][:2] == ["Lovelace, Ada", "4711"]


@pytest.mark.parametrize(
    ("status", "days"),
    [("3 days", 3.0), ("36 hours", 1.5), ("36 mins 0 secs", 0.025), ("43 secs", 43 / 86400)],
)
def test_moodle_tells_the_time_in_each_of_its_units(status, days, written):
    book = read_moodle(written(MOODLE.replace("1 week 12 hours late", f"{status} late")))

    assert book.people["815"].late == pytest.approx(days)


@pytest.mark.parametrize("status", ["2 days early", "Submitted - 1 day before the end", "later"])
def test_a_time_that_is_not_late_costs_nothing(status, written):
    book = read_moodle(written(MOODLE.replace("1 week 12 hours late", status)))

    assert book.people["815"].late == 0.0


def test_canvas_names_a_column_that_is_not_there(written):
    with pytest.raises(LabkitError, match=r"no column 'Lab 3'; the columns are Lab 1 \(77\)"):
        read_canvas(written(CANVAS), "Lab 3")
    with pytest.raises(LabkitError, match="more than one column 'Lab 1'"):
        read_canvas(written(CANVAS.replace("Lab 2 (78)", "Lab 1 (78)")), "Lab 1")


def test_moodle_gets_grades_of_its_own_scale_and_keeps_its_times(verdicts, written, out):
    book = read_moodle(written(MOODLE))
    hostile = replace(verdicts[2], student="12", notes=("<b>",))
    assert book.fill([*verdicts, hostile], out) == (["=cmd|x"], [], [])
    header, ada, emmy, grace = rows(out)
    assert header == MOODLE.lstrip("\ufeff").splitlines()[0].split(",")
    assert ada[3:6] == ["100", "100.00", "Saturday, 21 November 2026"]
    assert emmy[3] == "1"
    assert emmy[6] == "Gate: About gate.<br>Huber: About huber.<br>a note"
    assert "&lt;b&gt;" in grace[6]
    assert [one.late for one in book.people.values()] == [0.0, 7.5, 0.0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "line 1: no column 'Identifier'; the columns are none"),
        ("ID,Bewertung\n1,1\n", "the columns are ID, Bewertung. Moodle names the columns in your"),
        ('Identifier,"Grade\na,b\n', "line 2: unexpected end of data; put text that"),
        ("Identifier,Grade\na,b\na,b,c\n", "line 3: it has more cells than line 1"),
    ],
)
def test_a_gradebook_that_cannot_be_filled(written, text, says):
    with pytest.raises(LabkitError, match=r"gradebook\.csv: ") as error:
        read_moodle(written(text))
    assert says in str(error.value)


WRITTEN = {  # what a person may have written, in a row of each platform
    "Canvas's grade": (CANVAS, ",Monday,,3,", ",Monday,88,3,"),
    "excused in Canvas": (CANVAS, ",Monday,,3,", ",Monday,EX,3,"),
    "a grade of 0 in Canvas": (CANVAS, ",Monday,,3,", ",Monday,0,3,"),
    "Moodle's grade": (MOODLE, "Submitted,,", "Submitted,88.00,"),
    "Moodle's comment": (MOODLE, '2026",\n', '2026",see me\n'),
}


@pytest.mark.parametrize("cell", WRITTEN)
def test_what_a_person_wrote_stays(cell, verdicts, written, out):
    """Law 5: the row is left out, so that the platform keeps it, unless it is asked for."""
    text, before, after = WRITTEN[cell]
    path = written(text.replace(before, after, 1))
    book = read_canvas(path, "Lab 1") if text is CANVAS else read_moodle(path)

    kept = book.fill(verdicts[:1], out).occupied

    assert kept == ["4711"]
    assert "4711" not in out.read_text(encoding="utf-8")
    assert book.fill(verdicts[:1], out, overwrite=True).occupied == []
    assert "4711" in out.read_text(encoding="utf-8")


def test_who_was_not_graded_has_no_row_and_keeps_the_reason(verdicts, written, out):
    """Law 5."""
    nothing = replace(verdicts[0], is_graded=False, unread=("report.pdf is no notebook",))

    for book in (read_canvas(written(CANVAS), "Lab 1"), read_moodle(written(MOODLE))):
        assert book.fill([nothing], out) == ([], [], [])
        assert "4711" not in out.read_text(encoding="utf-8")
    write_scores([nothing], {}, out)

    assert rows(out)[1] == ["4711", "4711", "report.pdf is no notebook"]


def test_the_plain_table_holds_no_formula(verdicts, out):
    write_scores(verdicts, {"absent": "Nobody"}, out)
    assert rows(out) == [
        [
            "student",
            "submission",
            "score",
            "points",
            "late",
            "isolation",
            "gate",
            "huber",
            "remark",
        ],
        ["absent", *[""] * 8],
        ["4711", "4711", "5", "5", "0", "bubblewrap", "2", "3", ""],
        ["815", "815", "0.5", "5", "0", "bubblewrap", "0.5", "0", ""],
        ["'=cmd|x", "'=cmd|x", "0", "2", "0", "bubblewrap", "0", "", ""],
    ]


def test_a_row_that_moodle_has_locked_is_named(verdicts, written, out):
    text = MOODLE.replace("Status,", "Grade can be changed,").replace("Submitted", "No")

    assert read_moodle(written(text)).fill(verdicts[:1], out) == ([], [], ["4711"])


def test_a_scale_of_words_is_refused(written):
    with pytest.raises(LabkitError, match=r"line 2: the grade is a scale up to 'Excellent', and"):
        read_moodle(written(MOODLE.replace("100.00", "Excellent", 1)))
