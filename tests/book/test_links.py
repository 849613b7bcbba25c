"""Links as they read where the plain Markdown is opened."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("book/*.md"), *ROOT.glob("notebooks/*.ipynb")])
TABLES = [ROOT / "book/intro.md", ROOT / "book/evening.md"]


def title_of(path):
    cells = json.loads(path.read_text("utf-8"))["cells"]
    text = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return re.search(r"(?m)^# (.*)$", text)[1]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_link_has_words(page):
    assert re.findall(r"(?<!!)\[\]\(.*?\)", page.read_text("utf-8")) == []


@pytest.mark.parametrize("page", TABLES, ids=lambda page: page.name)
def test_a_table_names_a_chapter_by_its_title(page):
    link = re.compile(r"(?m)^\|[^|]*(?:\| )?\[([^]]+)\]\((.*?\.ipynb)\)")
    named = {address: words for words, address in link.findall(page.read_text("utf-8"))}

    titles = {address: title_of(page.parent / address) for address in named}

    assert len(named) > 4
    assert named == titles
