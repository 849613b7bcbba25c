"""The page for reading shows code beside marks, and what it saves comes back by `labkit grade`."""

import csv

import pytest

from labkit.grading.classroom.marks import Decision, Roster
from labkit.grading.classroom.pages import write_reading
from labkit.grading.classroom.store import Record
from labkit.grading.questions import read_assignment
from tests.grading.verdicts import question, submission

HOSTILE = '=HYPERLINK("x") <script>alert(1)</script> ]]> é'


@pytest.fixture
def written(small, tmp_path):
    """A function that writes the page of two hand-ins, and returns its place."""

    def write(adjustments=(), code="def double(x):\n    return x\n", members=()):
        records = {
            student: Record(
                verdict=submission(student, question("double", 2.0, 0.0, message="Not this.")),
                fingerprint="1",
                code=code,
                written=f"Since it slips: {HOSTILE}",
            )
            for student in ("ada", "emmy")
        }
        decided = dict(adjustments)
        roster = Roster(dict(members), dict.fromkeys(dict(members), "ada"))
        write_reading(tmp_path, records, decided, read_assignment(small), roster)
        return tmp_path / "reading.html"

    return write


@pytest.fixture
def page(written, browser):
    """The page in a browser."""
    page = browser.new_page()
    page.goto(written().as_uri())
    yield page
    page.close()


def test_what_a_student_wrote_is_text_and_runs_nowhere(written):
    source = written(code=HOSTILE).read_text(encoding="utf-8")

    assert source.count("<script>") == 1
    assert "script-src 'sha256-" in source
    assert "Since it slips: =HYPERLINK" in source


def test_what_is_decided_by_hand_is_shown_and_not_saved_again(written):
    decided = {("ada", "double"): Decision(1.5, "by hand")}

    source = written(decided).read_text(encoding="utf-8")

    assert source.count("decided in adjustments.csv") == 1
    assert "by hand" in source


def test_a_group_s_hand_in_bears_the_names_of_its_members(written):
    source = written(members={"1": "Ann", "2": "Bob"}).read_text(encoding="utf-8")

    assert "<option>Ann, Bob (ada)</option><option>emmy</option>" in source


def field(page, item, student="ada"):
    return page.locator(f"fieldset[data-student={student}][data-item={item}]")


def test_points_and_comments_are_saved_as_a_table(page, tmp_path):
    field(page, "double").locator("[type=number]").fill("1.5")
    field(page, "double").locator("textarea").focus()
    page.keyboard.type('mind "x",\nand y')
    page.click("#next")
    field(page, "all", "emmy").locator("textarea").fill("well done")

    with page.expect_download() as download:
        page.click("#save")

    download.value.save_as(tmp_path / "points.csv")
    with (tmp_path / "points.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows == [
        ["student", "what", "value", "comment"],
        ["ada", "double", "1.5", 'mind "x", and y'],
        ["emmy", "all", "", "well done"],
    ]


def test_points_beyond_the_question_s_are_not_saved(page):
    field(page, "double").locator("[type=number]").fill("3")

    page.click("#save")

    assert page.locator("#save").inner_text().endswith("*")
    assert field(page, "double").locator("input:invalid").count() == 1


def test_a_question_can_be_excused_and_what_is_not_saved_is_marked(page, tmp_path):
    field(page, "double").locator("[type=checkbox]").check()
    assert page.locator("#save").inner_text().endswith("*")

    with page.expect_download() as download:
        page.click("#save")

    download.value.save_as(tmp_path / "points.csv")
    assert '"ada","double","excused",""' in (tmp_path / "points.csv").read_text(encoding="utf-8")
    assert not page.locator("#save").inner_text().endswith("*")
