"""The pages hold what was found, as text, and ask for nothing from elsewhere."""

import re
from dataclasses import replace
from html import unescape

import pytest

from labkit.course.assignment import load_assignment
from labkit.grading.classroom.pages import write_pages
from tests.grading.verdicts import case, question, submission

ASSIGNMENT = load_assignment(hidden=False)
GATE = ASSIGNMENT.questions[0]
MISTAKE = GATE.misconceptions[0]
HOSTILE = "<script>alert('x')</script><img src=x onerror=y>"


def verdict(student, share, *, mistake=None, text="", mode="bubblewrap"):
    told = (text,) if text else ()
    gate = question(
        GATE.id, 4.0, 4.0 * share, case("1", share, text), message=text, mistake=mistake,
        title=GATE.title,
    )  # fmt: skip
    return submission(
        student, gate, mode=mode, name=f"Student {student}", notes=told, unread=told,
        adjustments=told,
    )  # fmt: skip


class Words:
    """The text of a page, its elements, and where its links lead."""

    def __init__(self, page):
        self.source = page.read_text(encoding="utf-8")
        self.tags = set(re.findall(r"<(\w+)", self.source))
        self.links = re.findall(r'<a href="([^"]*)"', self.source)
        self.text = unescape(re.sub(r"<[^>]*>", "", self.source.replace("</", " </")))


@pytest.fixture
def pages(tmp_path):
    """A function that writes the pages of some marks, and reads them: the class's, students'."""

    def write(*marks, failures=(), missing=()):
        failures, missing = dict(failures), dict(missing)
        write_pages(tmp_path, marks, ASSIGNMENT, failures=failures, missing=missing)
        return [Words(path) for path in (tmp_path / "index.html", *tmp_path.glob("students/*"))]

    return write


def test_a_student_reads_score_reason_and_chapter(pages):
    words = " ".join(pages(verdict("ada", 0.25, text="It returned a list."))[1].text.split())
    assert "Student ada : 1 of 4 points" in words
    assert "✗ 1 / 4 It returned a list. It returned a list. (hidden case)" in words
    assert f"0 of 1 cases pass. Read again: {GATE.chapter}" in words
    assert "Graded in isolation: bubblewrap." in words


def test_who_was_not_graded_reads_no_score(pages):
    page = pages(replace(verdict("ada", 0.0), is_graded=False))[1]
    assert "Student ada : not graded" in page.text
    assert "points" not in page.source


def test_the_count_of_cases_is_said_once(pages):
    for message in ("", "0 of 1 cases pass."):
        asked = question(GATE.id, 4.0, 0.0, case("1", 0.0), message=message)
        assert pages(submission("ada", asked))[1].text.count("0 of 1 cases pass.") == 1


def test_whatever_a_student_wrote_stays_text_and_asks_for_nothing(pages):
    hostile = replace(verdict(HOSTILE, 0.0, text=HOSTILE), submission=HOSTILE)
    for words in pages(hostile, failures=[(HOSTILE, HOSTILE)], missing=[(HOSTILE, HOSTILE)]):
        assert not {"script", "img", "link"} & words.tags
        assert words.text.count(HOSTILE) >= 4
        assert "default-src 'none'" in words.source
        assert not re.search(r"https?://", words.source)


@pytest.mark.parametrize("mode", ["bubblewrap", "none"])
def test_the_class_at_a_glance(pages, mode):
    assert "0 marks" in pages()[0].text
    marks = [
        verdict(student, share, mistake=None if share else MISTAKE.id, mode=mode)
        for student, share in (("a", 0.0), ("b", 0.5), ("c", 1.0), ("d", 1.0))
    ]
    page = pages(*marks, failures=[("e", "the disk is full")], missing=[("f", "Emmy N.")])[0]
    words = " ".join(page.text.split())
    assert "4 marks. Median 3, mean 2.5 of 4 points." in words
    assert "each tenth of the points: 1, 0, 0, 0, 0, 1, 0, 0, 0, 2" in page.source
    assert "62 % 2 1 1" in words  # mean share; full marks, some points, none
    assert f"1 {GATE.title} {MISTAKE.says.partition('`')[0].strip()}" in words
    assert "e : the disk is full" in words
    assert "1 of the roster: f (Emmy N.)." in words
    assert ("Limits alone are not safe" in words) == (mode == "none")
    assert page.links == ["reading.html"] + [f"students/{student}.html" for student in "abcd"]


def test_a_question_that_is_excused_is_left_out_of_the_class(pages):
    ada, emmy = verdict("ada", 0.0), verdict("emmy", 1.0)
    excused = replace(ada, questions=tuple(replace(each, points=0.0) for each in ada.questions))

    (overview, *_) = pages(excused, emmy)

    assert "100 %" in overview.text
