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


def test_without_a_browser_the_page_is_there_and_the_way_out_is_named(report, capsys, monkeypatch):
    monkeypatch.setattr(pages, "BROWSERS", ())
    assert main(["report", str(report)]) == 1
    assert "<h1" in report.with_suffix(".html").read_text("utf-8")
    assert not report.with_suffix(".pdf").exists()
    err = capsys.readouterr().err
    assert "labkit report: a PDF needs Chromium, " in err
    assert "apt install chromium" in err


@pytest.mark.parametrize(
    ("report", "message"),
    [
        ("no/such/folder/a.md", "cannot write no/such/folder/a.html"),
        (".", "labkit report: .: a report is a notebook (.ipynb) or Markdown (.md)"),
        ("a.txt", "a.txt: a report is a notebook (.ipynb) or Markdown (.md)"),
    ],
)
def test_a_mistake_is_named_without_a_traceback(report, message, capsys):
    assert main(["report", report]) == 1
    assert message in capsys.readouterr().err


def test_what_must_be_installed_is_named(report, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "nbformat", None)
    assert main(["report", str(report)]) == 1
    assert 'pip install "labkit[report]"' in capsys.readouterr().err
