"""What is read of the files of a submission, before any of its code runs."""

import io
import zipfile

import pytest

from labkit.grading.box.inside.limits import MAX_CELLS, MAX_SOURCE
from labkit.grading.box.inside.reading import read_program
from tests.grading.notebooks import cell, notebook


@pytest.mark.parametrize(
    ("cells", "is_read"),
    [
        ([cell("0")] * MAX_CELLS, True),
        ([cell("0")] * (MAX_CELLS + 1), False),
        ([cell("0" * MAX_SOURCE)], True),
        ([cell("0" * (MAX_SOURCE + 1))], False),
    ],
    ids=["cells", "a cell more", "letters", "a letter more"],
)
def test_a_file_with_too_much_code_is_not_read(cells, is_read):
    program = read_program({"a.ipynb": notebook(cells)}, ["f"])

    assert bool(program.cells) == is_read
    assert ("all files together hold too much code" in "".join(program.unread)) != is_read


def test_of_too_much_code_the_newest_is_read():
    half = [cell("def f(): 0")] * (MAX_CELLS // 2 + 1)
    files = {"old.ipynb": notebook(half), "new.ipynb": notebook(half)}

    program = read_program(files, ["f"])

    assert [*program.scripts] == ["new.ipynb"]
    assert program.unread == ["old.ipynb cannot be read: all files together hold too much code"]


BROKEN = {
    b"": "it is empty",
    b"\xfe\xff\xd8": "it is no text, and so no notebook",
    b'{"cells": [\n<<<<<<< HEAD\n': "it is no notebook from line 2 on",
}


@pytest.mark.parametrize("data", BROKEN)
def test_what_is_no_notebook_is_told_in_words(data):
    """It once was told in those of a codec and of a parser."""
    program = read_program({"a.ipynb": data}, ["f"])

    assert program.unread == [f"a.ipynb cannot be read: {BROKEN[data]}"]


@pytest.mark.parametrize("years", [(2020, 2024), (2024, 2020), (2024, 2024)])
def test_of_two_files_in_an_archive_the_newer_counts_and_of_one_time_the_shorter_name(years):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, year in zip(("long.py", "a.py"), years, strict=True):
            info = zipfile.ZipInfo(name, (year, 1, 1, 0, 0, 0))
            archive.writestr(info, f"def f(): {year}")

    program = read_program({"a.zip": buffer.getvalue()}, ["f"])

    newest = "a.zip/long.py" if years[0] > years[1] else "a.zip/a.py"
    assert program.cells[-1][1] == newest
