"""The PDF: its pages, its words, and what is said where there is no browser."""

import asyncio
import io
import os
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from pypdf import PdfReader

from labkit.course.report import ReportError, page_count, pdf, read_report, render, write_pdf

ROOT = Path(__file__).parents[3]


@pytest.fixture
def browser():
    """Skips where no browser is; on the Linux of CI that is a failure."""
    if not any(map(shutil.which, pdf.BROWSERS)):
        missing = "no Chromium here; on Debian and Ubuntu: `sudo apt install chromium`"
        required = os.environ.get("CI") and sys.platform == "linux"
        (pytest.fail if required else pytest.skip)(missing)


def test_pages_are_counted(browser, tmp_path):
    text = "".join(f'<p style="break-before: page">This is page {n}.</p>' for n in (1, 2, 3))
    path = tmp_path / "three.pdf"
    assert write_pdf(f"<main>{text}</main>", path) == (3, [])
    content = path.read_bytes()
    assert page_count(content) == 3
    words = [page.extract_text() for page in PdfReader(io.BytesIO(content)).pages]
    assert all(f"This is page {n}." in text for n, text in enumerate(words, start=1))
    assert "2 / 3" in words[1]


def test_it_prints_from_a_thread_with_a_running_loop_as_a_notebook_has(browser, tmp_path):
    async def cell():
        return write_pdf("<main><p>From a cell.</p></main>", tmp_path / "cell.pdf")[0]

    with ThreadPoolExecutor(1) as own:  # this thread's loop may be that of another test's browser
        assert own.submit(asyncio.run, cell()).result() == 1


def test_the_markdown_template_fits_on_two_pages(browser, tmp_path):
    page = render(read_report(ROOT / "book" / "report_template.md"))
    count, cut = write_pdf(page, tmp_path / "report.pdf")
    assert 1 <= count <= 2
    assert cut == []
    text = "".join(each.extract_text() for each in PdfReader(tmp_path / "report.pdf").pages)
    assert "Where it fails" in text
    assert "huber_delta" in text


def test_the_notebook_template_fits_on_two_pages(browser, tmp_path):
    pytest.importorskip("rtbdata")
    page = render(read_report(ROOT / "notebooks" / "report_template.ipynb"))
    assert page.count("<table") == 4
    assert page.count("<img") == 2
    count, cut = write_pdf(page, tmp_path / "report.pdf")
    assert 1 <= count <= 2
    assert cut == []


@pytest.mark.parametrize(
    "text",
    [
        "|" + "a head|" * 24 + "\n|" + "--:|" * 24 + "\n|" + "12.345|" * 23 + "|",
        "|" + "`a_head`|" * 24 + "\n|" + "--:|" * 24 + "\n|" + "12.345|" * 23 + "|",
        "`" + "x" * 300 + "`",
        "w" * 300,
        "# " + "w" * 300,
        "| a | b |\n|---|---|\n| a | " + "w" * 300 + " |",
        "```\n" + "y" * 400 + "\n```",
    ],
)
def test_wide_text_is_wrapped_and_not_cut_off(browser, tmp_path, text):
    (tmp_path / "a.md").write_text(text + "\n", "utf-8")
    assert write_pdf(render(read_report(tmp_path / "a.md")), tmp_path / "a.pdf") == (1, [])


@pytest.mark.parametrize("delimiter", ["$", "$$"])
def test_a_formula_wider_than_the_page_is_named(browser, tmp_path, delimiter):
    formula = delimiter + "+".join("abcdefgh" * 12) + delimiter
    (tmp_path / "a.md").write_text(f"Here: {formula}\n\nThere: $x$\n", "utf-8")
    count, cut = write_pdf(render(read_report(tmp_path / "a.md")), tmp_path / "a.pdf")
    assert count == 1
    assert [each[:5] for each in cut] == ["a+b+c"]


def test_without_a_browser_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(pdf, "BROWSERS", ("no-such-browser",))
    monkeypatch.setattr(pdf, "CHANNELS", ({"executable_path": str(tmp_path / "none")},))
    with pytest.raises(ReportError, match=r"apt install chromium.*playwright install chromium"):
        write_pdf("<p>x</p>", tmp_path / "a.pdf")
    assert list(tmp_path.iterdir()) == []
