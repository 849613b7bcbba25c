"""The book on paper: a short one, whole, and what stands on its pages."""

from __future__ import annotations

import io
import os
from pathlib import Path

import pytest
from print_book import WHOLE, print_book
from pypdf import PdfReader

from labkit.course.report.pages import ReportError


@pytest.mark.skipif("BOOK_HTML" in os.environ, reason="the widget page is built by the fixture")
def test_pages_follow_one_another_with_contents_answers_and_pictures(html: Path, browser: object):
    names = ["book/students", "notebooks/assignment", "widgets"]
    reader = PdfReader(io.BytesIO(print_book(html, names, "A book", "Me")))
    texts = [page.extract_text() for page in reader.pages]
    assert texts[0].split("\n")[:2] == ["A book", "Me"]
    second = next(k for k, text in enumerate(texts[2:], 1) if "Ten numbers." in text)
    contents = " ".join(texts[1].split())
    assert contents.startswith("Contents For students 1 Assignment")
    assert int(contents.split()[-1]) <= second
    text = "\n".join(texts[2:])
    assert "The cell below shows ten." in text  # an answer, folded on the screen
    assert "Ask me again" not in text
    assert [each.title for each in reader.outline if not isinstance(each, list)] == [
        "For students",
        "Assignment: ICP-based motion estimation",  # on two lines of its page
        "Widgets",
    ]
    assert max(len(page.images) for page in reader.pages) >= 1
    assert not html.joinpath(WHOLE).exists()


def test_a_page_that_is_not_built_is_named(tmp_path):
    with pytest.raises(ReportError, match=r"no page book/moon.html; run `make book` first"):
        print_book(tmp_path, ["book/moon"], "A book", "Me")
