"""The pages hold what was found, as text, and ask for nothing from elsewhere."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.exports.pages import page_name, write_class_page, write_student_page
from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict

ASSIGNMENT = load_assignment(hidden=False)
GATE = ASSIGNMENT.questions[0]
MISTAKE = GATE.misconceptions[0]
HOSTILE = "<script>alert('x')</script><img src=x onerror=y>"


def verdict(student, share, *, mistake=None, text="", mode="bubblewrap"):
    case = CaseVerdict(id="1", hidden=True, credit=share, reason=text)
    question = QuestionVerdict(
        question=GATE.id, title=GATE.title, points=4.0, score=4.0 * share, cases=(case,),
        misconception=mistake, message=text,
    )  # fmt: skip
    return SubmissionVerdict(
        student=student, submission=f"Student {student}", mode=mode, questions=(question,),
        score=4.0 * share, points=4.0, notes=(text,) if text else (), seconds=0.1,
        unread=(text,) if text else (), adjustments=(text,) if text else (),
    )  # fmt: skip


class Words(HTMLParser):
    """The text of a page, and its elements."""

    def __init__(self, page):
        super().__init__()
        self.text, self.tags = "", []
        self.source = page.read_text(encoding="utf-8")
        self.feed(self.source)

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
    assert "Graded in isolation: bubblewrap." in words


def test_whatever_a_student_wrote_stays_text_and_asks_for_nothing(tmp_path):
    page = tmp_path / "page.html"
    hostile = replace(verdict(HOSTILE, 0.0, text=HOSTILE), submission=HOSTILE)
    write_student_page(hostile, ASSIGNMENT, page)
    texts = [Words(page)]
    write_class_page(
        [hostile], ASSIGNMENT, page, failures={HOSTILE: HOSTILE}, missing={HOSTILE: HOSTILE}
    )
    texts.append(Words(page))
    for words in texts:
        assert not {"script", "img", "link"} & {tag for tag, _ in words.tags}
        assert words.text.count(HOSTILE) >= 4
        assert "default-src 'none'" in words.source
        assert not re.search(r"https?://", words.source)


@pytest.mark.parametrize("mode", ["bubblewrap", "none"])
def test_the_class_at_a_glance(tmp_path, mode):
    marks = [
        verdict(student, share, mistake=None if share else MISTAKE.id, mode=mode)
        for student, share in (("a", 0.0), ("b", 0.5), ("c", 1.0), ("d", 1.0))
    ]
    page = tmp_path / "index.html"
    failures, missing = {"e": "the disk is full"}, {"f": "Emmy N."}
    write_class_page(marks, ASSIGNMENT, page, failures=failures, missing=missing)
    words = " ".join(Words(page).text.split())
    assert "4 marks. Median 3, mean 2.5 of 4 points." in words
    assert "62 % 2 1 1" in words  # mean share; full marks, some points, none
    assert f"1 {GATE.title} {MISTAKE.says.partition('`')[0].strip()}" in words
    assert "e : the disk is full" in words
    assert "1 of the roster: f (Emmy N.)." in words
    assert ("Limits alone are not safe" in words) == (mode == "none")
    links = [attrs["href"] for tag, attrs in Words(page).tags if tag == "a"]
    assert links == [f"students/{student}.html" for student in "abcd"]


def test_a_class_of_nobody_has_a_page(tmp_path):
    write_class_page([], ASSIGNMENT, tmp_path / "i.html", failures={}, missing={})
    assert "0 marks" in Words(tmp_path / "i.html").text


def test_every_student_has_a_page_of_their_own():
    """The second of each pair once had the first one's page, or a place elsewhere."""
    names = ["ada l", "ada-l-71b1e478", "ada-l", "Ada-L", "../../x", "x", "a" * 70, "a" * 71, ""]
    pages = [page_name(name) for name in names]
    assert len({page.lower() for page in pages}) == len(names)
    assert all(re.fullmatch(r"students/[\w+-]*\.html", page) for page in pages)


def test_chapters_are_links_where_the_book_is(tmp_path):
    write_student_page(verdict("a", 0.0), ASSIGNMENT, tmp_path / "a.html", "https://x.org/")
    links = [attrs["href"] for tag, attrs in Words(tmp_path / "a.html").tags if tag == "a"]
    assert links
    assert all(link.startswith("https://x.org/notebooks/") for link in links)
