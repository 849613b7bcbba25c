"""Notebooks run beside each other, without a clock, and a cell that fails is told."""

from __future__ import annotations

import nbformat
import pytest
from execution import PatientClient, is_run, run_all
from nbformat.v4 import new_code_cell, new_notebook


@pytest.fixture
def written(tmp_path):
    """A function that writes a notebook of these cells, with these settings of MyST-NB."""

    def write(name, *sources, **settings):
        path = tmp_path / name
        cells = [new_code_cell(source) for source in sources]
        nbformat.write(new_notebook(cells=cells, metadata={"mystnb": settings}), path)
        return path

    return write


def test_notebooks_run_in_their_folder_side_by_side_and_a_failure_stops_its_own(written):
    """Each waits for the other's file, so one after the other would wait for ever."""
    meet = "from pathlib import Path; Path('{}').touch()\nwhile not Path('{}').exists(): pass"
    good = written("good.ipynb", meet.format("a", "b"), "6 * 7")
    bad = written("bad.ipynb", meet.format("b", "a"), "print('so far')", "1 / 0", "print('on')")

    runs = run_all([good, bad])

    assert runs[good].result().failure == ""
    assert runs[good].result().notebook.cells[1].outputs[0].data["text/plain"] == "42"
    assert "ZeroDivisionError" in runs[bad].result().failure
    assert [len(cell.outputs) for cell in runs[bad].result().notebook.cells] == [0, 1, 1, 0]


def test_a_notebook_that_cannot_be_read_is_an_error(tmp_path):
    (tmp_path / "none.ipynb").write_text("{", "utf-8")

    runs = run_all([tmp_path / "none.ipynb"])

    with pytest.raises(nbformat.reader.NotJSONError):
        runs[tmp_path / "none.ipynb"].result()


def test_a_page_of_text_and_a_notebook_with_open_questions_are_not_run(written, tmp_path):
    assert is_run(written("chapter.ipynb", "1"))
    assert not is_run(written("open.ipynb", "1", execution_mode="off"))
    assert not is_run(tmp_path / "page.md")


def test_no_clock_ends_a_run():
    client = PatientClient(new_notebook(), timeout=None)

    assert [client.timeout, client.startup_timeout, client.iopub_timeout] == [None] * 3
