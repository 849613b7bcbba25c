"""``labkit report``: files, messages, exit status."""

import sys

import pytest

from labkit.cli import main
from labkit.course.report import pages


@pytest.fixture
def report(tmp_path):
    path = tmp_path / "mine.md"
    path.write_text("# Mine\n\nText.\n", "utf-8")
    return path


def test_html_alone_needs_no_browser(report, tmp_path, capsys):
    assert main(["report", str(report), "--html-only", "--out", str(tmp_path / "out.v2")]) == 0
    assert "<h1" in (tmp_path / "out.v2.html").read_text("utf-8")
    assert capsys.readouterr().out == f"{tmp_path / 'out.v2.html'}\n"


def test_without_a_browser_the_page_is_there_and_the_way_out_is_named(report, capsys, monkeypatch):
    monkeypatch.setattr(pages, "BROWSERS", ())
    assert main(["report", str(report)]) == 1
    assert report.with_suffix(".html").exists()
    assert not report.with_suffix(".pdf").exists()
    err = capsys.readouterr().err
    assert "labkit report: a PDF needs Chromium, " in err
    assert "apt install chromium" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.md", "--out", "no/such/folder/a"], "cannot write no/such/folder/a.html"),
        (["."], "labkit report: .: is a directory; name a notebook or Markdown in it"),
    ],
)
def test_a_mistake_is_named_without_a_traceback(arguments, message, capsys):
    assert main(["report", *arguments]) == 1
    assert message in capsys.readouterr().err


def test_what_must_be_installed_is_named(report, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "nbformat", None)
    assert main(["report", str(report)]) == 1
    assert 'pip install "labkit[report]"' in capsys.readouterr().err
