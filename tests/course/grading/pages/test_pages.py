"""The pages hold what was found, as text, and ask for nothing from elsewhere."""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.contract import SourceCell
from labkit.course.grading.feedback import PAGES, to_html
from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict
from labkit.course.grading.pages.statistics import ClassSummary
from labkit.course.grading.pages.write import (
    write_class_page,
    write_pair_page,
    write_student_page,
)
from labkit.course.grading.similarity import Group, side_by_side

ASSIGNMENT = load_assignment(hidden=False)
GATE = ASSIGNMENT.questions[0]
MISTAKE = GATE.misconceptions[0]
GATE_CASES = [case.id for case in ASSIGNMENT.visible[GATE.id]] + ["h8", "h9"]
HOSTILE = "<script>alert('x')</script><img src=x onerror=y>"


def verdict(student, share, *, mistake=None, text="", mode="landlock"):
    case = CaseVerdict(id="1", hidden=True, credit=share, reason=text)
    question = QuestionVerdict(
        question=GATE.id, title=GATE.title, points=4.0, score=4.0 * share, cases=(case,),
        misconception=mistake, message=text,
    )  # fmt: skip
    return SubmissionVerdict(
        student=student, submission=f"Student {student}", mode=mode, questions=(question,),
        score=4.0 * share, points=4.0, notes=(text,) if text else (), seconds=0.1,
    )  # fmt: skip


class Words(HTMLParser):
    """The text of a page, and its elements."""

    def __init__(self, page):
        super().__init__()
        self.text, self.tags = "", []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        self.text += " "

    def handle_data(self, data):
        self.text += data


def test_a_student_reads_score_reason_and_chapter(tmp_path):
    page = tmp_path / "ada.html"
    write_student_page(verdict("ada", 0.25, text="It returned a list."), ASSIGNMENT, page)
    words = " ".join(Words(page).text.split())
    assert "Student ada : 1 of 4 points" in words
    assert "✗ 1 / 4 It returned a list. It returned a list. (hidden case)" in words
    assert f"Read again: {GATE.chapter}" in words
    assert "Graded in isolation: landlock." in words


def test_whatever_a_student_wrote_stays_text(tmp_path):
    page = tmp_path / "page.html"
    hostile = replace(verdict(HOSTILE, 0.0, text=HOSTILE), submission=HOSTILE)
    write_student_page(hostile, ASSIGNMENT, page)
    assert not {"script", "img"} & {tag for tag, _ in Words(page).tags}
    assert Words(page).text.count(HOSTILE) >= 4
    summary = ClassSummary()
    summary.add(hostile, "students/x.html")
    groups = [Group(students=(HOSTILE, "b"), pairs=((HOSTILE, "b", 0.9),))]
    write_class_page(summary, ASSIGNMENT, page, groups=groups, failures={HOSTILE: HOSTILE})
    assert not {"script", "img"} & {tag for tag, _ in Words(page).tags}


@pytest.mark.parametrize("mode", ["landlock", "none"])
def test_the_class_at_a_glance(tmp_path, mode):
    summary = ClassSummary()
    for student, share in (("a", 0.0), ("b", 0.5), ("c", 1.0), ("d", 1.0)):
        mistake = MISTAKE.id if share == 0.0 else None
        summary.add(verdict(student, share, mistake=mistake, mode=mode), f"students/{student}.html")
    page = tmp_path / "index.html"
    groups = [Group(students=("b", "c", "d"), pairs=(("b", "c", 0.97), ("c", "d", 0.94)))]
    write_class_page(summary, ASSIGNMENT, page, groups=groups, failures={"e": "the disk is full"})
    assert (summary.median, summary.mean, summary.points) == (3.0, 2.5, 4.0)
    assert summary.histogram == [1, 0, 0, 0, 0, 1, 0, 0, 0, 2]
    words = " ".join(Words(page).text.split())
    assert "4 submissions. Median 3, mean 2.5 of 4 points." in words
    assert "62 % 2 1 1" in words  # mean share; full marks, some points, none
    assert f"1 {GATE.title} {MISTAKE.says}" in words
    assert "b (Student b), c (Student c), d (Student d) 3 b and c: 97 %c and d: 94 %" in words
    assert "e : the disk is full" in words
    assert ("Limits alone are not safe" in words) == (mode == "none")
    links = [attrs["href"] for tag, attrs in Words(page).tags if tag == "a"]
    assert links == [f"students/{student}.html" for student in "abcd"]


def test_cases_that_tell_nothing_and_files_that_were_not_read_are_shown(tmp_path):
    """The first case goes with the score, the second against it, the third is everybody's."""
    summary = ClassSummary()
    for student, passed in (("a", "013"), ("b", "03"), ("c", "13"), ("d", "23")):
        cases = tuple(
            CaseVerdict(id=GATE_CASES[k], hidden=True, credit=float(str(k) in passed), reason="")
            for k in (0, 1, 3)
        )
        one = verdict(student, 1.0 if "0" in passed else 0.0)
        question = replace(one.questions[0], cases=cases)
        unread = ("b.pdf is no notebook",) if student == "b" else ()
        summary.add(replace(one, questions=(question,), unread=unread), "x.html")
    found = list(summary.questions[GATE.id].cases.values())
    assert [case.share for case in found] == [0.5, 0.5, 1.0]
    assert found[0].discrimination == pytest.approx(1.0)
    assert found[1].discrimination == pytest.approx(0.0)
    assert math.isnan(found[2].discrimination)
    write_class_page(summary, ASSIGNMENT, tmp_path / "index.html")
    words = " ".join(Words(tmp_path / "index.html").text.split())
    assert "Not read Something of these submissions was not read" in words
    assert "b (Student b) : b.pdf is no notebook" in words
    about = ASSIGNMENT.visible[GATE.id][0].about
    assert f"{about} (hidden) 50 % 4 1.00" in words


def test_code_and_chapters_in_what_a_student_is_told(tmp_path):
    page = tmp_path / "ada.html"
    text = "`x` is <b>; see chapter 1, “Rotation”."
    write_student_page(verdict("ada", 0.0, text=text), ASSIGNMENT, page, book="https://x.org/lab")
    html = page.read_text(encoding="utf-8")
    assert "<code>x</code> is &lt;b&gt;" in html
    links = {attrs["href"] for tag, attrs in Words(page).tags if tag == "a"}
    assert links == {"https://x.org/lab/notebooks/01_problem_and_se2.html#rotation"}


def test_a_case_of_which_nothing_is_to_be_said_is_no_line(tmp_path):
    page = tmp_path / "ada.html"
    write_student_page(verdict("ada", 0.0), ASSIGNMENT, page)
    assert not [tag for tag, _ in Words(page).tags if tag == "li"]


def test_every_chapter_that_feedback_names_has_a_page():
    sources = Path(__file__).parents[4]
    for page in PAGES.values():
        source = sources / page.removesuffix(".html")
        assert any(source.with_suffix(kind).exists() for kind in (".ipynb", ".md")), page
    named = {one.chapter for one in ASSIGNMENT.questions}
    named |= {known.chapter for one in ASSIGNMENT.questions for known in one.misconceptions}
    assert {to_html(chapter, "https://x.org")[:8] for chapter in named} == {"<a href="}


def cell(source, question=GATE.id):
    return SourceCell(source=source, question=question, label="cell")


def test_two_submissions_side_by_side(tmp_path):
    """Other names and comments hide nothing, and what was handed out shows nothing."""
    ours = [cell(f"{GATE.stub}\n    c = np.cos(a)  # mine\n    return c + 1"), cell("k = 1", None)]
    theirs = [cell(f"{GATE.stub}\n    k=np.cos(b)\n    return [k, k]")]
    question, shared = side_by_side(ours, theirs, ASSIGNMENT.questions)
    assert [(row.left.strip(), row.right.strip(), row.same) for row in question.rows] == [
        ("c = np.cos(a)  # mine", "k=np.cos(b)", True),
        ("return c + 1", "return [k, k]", False),
    ]
    assert (question.share, shared.title, shared.share) == (0.5, "Shared code", 0.0)
    hostile = [cell(HOSTILE)]
    write_pair_page((HOSTILE, "b"), (hostile, theirs), ASSIGNMENT, tmp_path / "1.html")
    page = Words(tmp_path / "1.html")
    assert not {"script", "img"} & {tag for tag, _ in page.tags}
    assert page.text.count(HOSTILE) >= 2


def test_the_pages_ask_nothing_of_the_network(tmp_path):
    page = tmp_path / "page.html"
    write_student_page(verdict("ada", 1.0), ASSIGNMENT, page)
    assert not re.search(r"https?://|src=|@import|url\(", page.read_text(encoding="utf-8"))


def test_an_empty_class_has_a_page(tmp_path):
    write_class_page(ClassSummary(), ASSIGNMENT, tmp_path / "index.html")
    assert "0 submissions" in Words(tmp_path / "index.html").text
