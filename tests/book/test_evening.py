"""The page on an evening: a station has what its sections need, and the time for them."""

from __future__ import annotations

import builtins
import re
from pathlib import Path

import pytest
from nbformat import NotebookNode

from tests.book.test_hours import EXERCISE, reading
from tests.book.test_notebooks import NOTEBOOKS, names, tags

PAGE = (Path(__file__).parents[2] / "book/evening.md").read_text("utf-8")
ROW = re.compile(r"(?m)^\| (\d+) \| \[.*?\]\(\.\./notebooks/(\w+)\.ipynb\) \| (.*) \|$")
STATIONS = {chapter: (int(minutes), task) for minutes, chapter, task in ROW.findall(PAGE)}
GIVEN = {*dir(builtins), "display", "get_ipython"}


def sections_of(chapter: str) -> dict[str, tuple[str, list[NotebookNode]]]:
    """The text and the cells of code below each heading; those above the first one have no name."""
    sections: dict[str, tuple[str, list[NotebookNode]]] = {"": ("", [])}
    title = ""
    for cell in NOTEBOOKS[f"{chapter}.ipynb"].cells:
        if tags(cell) & {"solution", "remove-cell"}:
            continue
        if cell.cell_type == "code":
            sections[title][1].append(cell)
            continue
        first, *others = re.split(r"(?m)^##+ ", cell.source)
        text, code = sections[title]
        sections[title] = f"{text}\n\n{first}", code
        for part in others:
            title, _, text = part.partition("\n")
            sections[title] = text, []
    return sections


def read_in_the_evening(chapter: str) -> list[tuple[str, list[NotebookNode]]]:
    sections = sections_of(chapter)
    return [sections[title] for title in ("", *re.findall(r'"(.+?)"', STATIONS[chapter][1]))]


@pytest.mark.parametrize("chapter", STATIONS)
def test_the_cells_of_a_station_read_only_what_others_of_it_set(chapter):
    known, missing = set(GIVEN), dict[str, str]()
    for _, cells in read_in_the_evening(chapter):
        for cell in cells:
            reads, sets = names(cell)
            missing |= dict.fromkeys(reads - known, cell.id)
            known |= sets
    assert missing == {}


@pytest.mark.parametrize("chapter", STATIONS)
def test_a_station_has_the_minutes_of_its_sections_and_tasks(chapter):
    """At 80 words a minute; 2 min a prediction, 40 s a formula, 15 s a cell of code."""
    minutes, task = STATIONS[chapter]
    tasks = {
        re.search(r"\{exercise\} (.*?) · ", found[0])[1]: int(found[2])
        for text, _ in sections_of(chapter).values()
        for found in EXERCISE.finditer(text)
    }
    sections = read_in_the_evening(chapter)
    text = "\n".join(text for text, _ in sections)
    formulas = len(re.findall(r"(?ms)^\$\$.*?^\$\$|^\\begin\{equation", text))
    cells = sum(len(code) for _, code in sections)
    to_write = sum(tasks[name] for name in re.findall(r"\*([^*]+)\*", task))

    spent = reading(EXERCISE.sub("", text), speed=80) + formulas * 2 / 3 + cells / 4 + to_write

    assert spent <= minutes, f"counted {spent:.0f} min"


def test_the_page_itself_has_its_minutes():
    minutes = re.search(r"(?m)^\| (\d+) \| This page \|", PAGE)[1]

    assert reading(PAGE, speed=80) <= int(minutes)


def test_the_stations_take_three_hours():
    assert sum(map(int, re.findall(r"(?m)^\| (\d+) \|", PAGE))) == 180
