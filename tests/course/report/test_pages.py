"""A report as HTML and PDF: freshly run, without its code, mistakes by cell."""

import base64
import shutil

import pytest
from nbformat import v4, write

from labkit.course.report import pages
from labkit.course.report.pages import printed, read_report, render
from labkit.support.errors import LabkitError

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


@pytest.fixture
def notebook(tmp_path):
    """Write a notebook of Markdown and code cells."""

    def save(*cells, name="mine.ipynb"):
        made = [
            v4.new_markdown_cell(cell[1:]) if cell.startswith("#") else v4.new_code_cell(cell)
            for cell in cells
        ]
        write(v4.new_notebook(cells=made), tmp_path / name)
        return tmp_path / name

    return save


def test_a_report_is_run_and_written_without_its_code(notebook, tmp_path):
    (tmp_path / "robot.png").write_bytes(PIXEL)
    path = notebook("## Mine\n\n![a robot](robot.png) and $x^2$", "secret = 6 * 7\nprint(secret)")
    html = render(read_report(path), tmp_path)
    assert "secret" not in html
    assert 'jp-InputArea-prompt">' not in html, "text stands to the right of its tables"
    for text in ("Mine", "<pre>42", "data:image/png;base64,iVBOR"):
        assert text in html


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("1 / 0", r"mine\.ipynb: cell 2: ZeroDivisionError: division by zero"),
        ("import os; os._exit(3)", r"mine\.ipynb: cell 2: DeadKernelError"),
    ],
)
def test_a_cell_that_fails_is_named(notebook, code, message):
    with pytest.raises(LabkitError, match=message):
        read_report(notebook("## Mine", code))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("gone.md", None, "gone.md: cannot be read: No such file"),
        ("a.md", b"\xff\xfe\xff", "cannot be read: it is damaged: .*utf-8"),
        ("a.ipynb", b"{}[", "it is damaged: Notebook does not"),
    ],
)
def test_a_file_that_is_no_report(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(LabkitError, match=message):
        read_report(tmp_path / name)


@pytest.mark.skipif(not any(map(shutil.which, pages.BROWSERS)), reason="no Chromium")
def test_a_page_is_printed(tmp_path):
    (tmp_path / "mine.html").write_text("<h1>One</h1>", "utf-8")
    assert printed(tmp_path / "mine.html").startswith(b"%PDF")
