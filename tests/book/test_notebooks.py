"""Every notebook's form: short cells, one import cell, figures with words.

The notebooks are found by their folder, so one that is written tomorrow is held to the same
rules. `make book` and `make test` run them.
"""

from __future__ import annotations

import ast
import re
import symtable
from collections import Counter
from copy import deepcopy
from itertools import pairwise, takewhile
from pathlib import Path

import nbformat
import pytest
from IPython.core.inputtransformer2 import TransformerManager
from nbformat import NotebookNode
from solutions import strip_notebook

FOLDER = Path(__file__).parents[2] / "notebooks"
NOTEBOOKS = {
    path.relative_to(FOLDER).as_posix(): nbformat.read(path, as_version=4)
    for path in sorted(FOLDER.rglob("*.ipynb"))
    if ".ipynb_checkpoints" not in path.parts
}
CHAPTERS = [name for name in NOTEBOOKS if re.match(r"(0[1-9]|10)_", name)]
MAX_LINES = 16  # about 12 is the aim; the longest are a stub and its docstring
MAX_SHOWN = 150  # lines of code that a chapter shows unasked
FOLDED = {"hide-input", "hide-cell", "remove-cell", "remove-input", "solution"}
# The assignment's questions need numpy alone; what runs the answers on a log comes after them.
LATER_IMPORTS = {"assignment.ipynb": ["killian-imports"]}
WIDGETS = {"align_by_hand", "icp_explorer", "icp_sliders", "live_figure"}
each_notebook = pytest.mark.parametrize("name", NOTEBOOKS)


def code_cells(notebook: NotebookNode) -> list[NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def tags(cell: NotebookNode) -> set[str]:
    return set(cell.metadata.get("tags", []))


def parse(source: str) -> ast.Module:
    """The Python of a cell, its magics turned into calls."""
    return ast.parse(TransformerManager().transform_cell(source))


def names(cell: NotebookNode) -> tuple[set[str], set[str]]:
    """The names that a cell takes from the notebook, in functions too, and those that it sets."""
    cell_source = TransformerManager().transform_cell(cell.source)
    tables = [symtable.symtable(cell_source, "cell", "exec")]
    known = tables[0].get_symbols()
    sets = {each.get_name() for each in known if each.is_assigned() or each.is_imported()}
    for table in tables:
        tables += table.get_children()
    used = [each for table in tables for each in table.get_symbols() if each.is_referenced()]
    return {each.get_name() for each in used if each.is_global()} - sets, sets


@each_notebook
def test_cells_are_short(name):
    cells = code_cells(NOTEBOOKS[name])
    assert [cell.id for cell in cells if len(cell.source.splitlines()) > MAX_LINES] == []


@each_notebook
def test_all_is_imported_in_the_first_cell_of_code(name):
    importing = [
        cell.id
        for cell in code_cells(NOTEBOOKS[name])[1:]
        if any(
            isinstance(node, ast.Import | ast.ImportFrom) for node in ast.walk(parse(cell.source))
        )
    ]
    assert importing == LATER_IMPORTS.get(name, [])


@each_notebook
def test_jupyterlab_folds_what_the_book_folds(name):
    """The book reads tags, JupyterLab the cell's metadata: collapse the cell there."""
    source, both = {"source_hidden": True}, {"outputs_hidden": True, "source_hidden": True}
    folds = {"hide-input": source, "hide-cell": both, "remove-cell": both}
    for cell in code_cells(NOTEBOOKS[name]):
        asked = [folds[tag] for tag in tags(cell) if tag in folds]
        assert cell.metadata.get("jupyter", {}) == max(asked, key=len, default={}), cell.id


@each_notebook
def test_no_cell_needs_what_a_claim_sets(name):
    """The students' edition has none of the cells that assert what the text claims."""
    claimed, known, missing = set[str](), set[str](), dict[str, str]()
    for cell in code_cells(NOTEBOOKS[name]):
        reads, sets = names(cell)
        if "remove-cell" in tags(cell):
            claimed |= sets
        elif "solution" not in tags(cell):
            missing |= dict.fromkeys(reads & claimed - known, cell.id)
            known |= sets
    assert missing == {}


@each_notebook
def test_a_figure_has_words_for_those_who_cannot_see_it_and_a_caption_below(name):
    """In a chapter, the caption is in italics: `book/_ext/figures.py` gives it its number."""
    cells = [cell for cell in NOTEBOOKS[name].cells if "remove-cell" not in tags(cell)]
    for cell, below in pairwise([*cells, cells[0]]):
        if cell.cell_type == "code" and cell.source.split("\n")[-1] == "figure":
            alt = cell.metadata.get("mystnb", {}).get("image", {}).get("alt", "")
            assert len(alt) >= 40, cell.id
            captioned = (
                below and below.cell_type == "markdown" and re.match(r"\*[^*]", below.source)
            )
            assert captioned or name not in CHAPTERS, cell.id


@each_notebook
def test_the_reader_predicts_before_each_slider(name):
    """Each asks anew, in its own section, but those before a chapter's first question are free.

    Where there is a question, something moves before the first one.
    """
    sources = [cell.source for cell in NOTEBOOKS[name].cells]
    own = re.findall(r"def (\w+)\(", "\n".join(sources))
    widget, silent, asked = rf"\b({'|'.join(WIDGETS.difference(own))})\(", [], None
    for cell in NOTEBOOKS[name].cells:
        if cell.cell_type == "markdown":
            *_, last = re.split(r"^##+ ", cell.source, flags=re.MULTILINE)
            asked = ":class: predict" in last or (asked and last == cell.source)
        elif asked is not None and re.search(widget, cell.source):
            silent += [] if asked else [cell.id]
            asked = False
    assert silent == []
    first = next((k for k, source in enumerate(sources) if ":class: predict" in source), 0)
    moving = re.search(rf"{widget}|killian-map", "\n".join(sources[:first]))
    assert moving or name not in CHAPTERS or not first


def test_the_place_of_an_answer_does_not_give_it_away():
    """Of the predictions with three choices no place is right more than half of the time."""
    boxes = [
        box
        for notebook in NOTEBOOKS.values()
        for cell in notebook.cells
        for box in re.findall(r"(?ms)^:class: predict$(.*?)^::::$", cell.source)
    ]
    right = [
        re.search(r"(?m)^:::\{dropdown\}[^\n]*\n\*\*(\d)\.\*\*", box)[1]
        for box in boxes
        if len(re.findall(r"(?m)^\d\. ", box)) == 3
    ]
    assert len(right) > 25
    assert set(right) == {"1", "2", "3"}
    assert max(Counter(right).values()) <= len(right) / 2


@each_notebook
def test_every_name_that_students_see_has_a_reader(name):
    """What is set and never read shows nothing. An import may wait for what students write."""
    handed_out, _ = strip_notebook(deepcopy(NOTEBOOKS[name]), name)
    solved = [cell for cell in code_cells(NOTEBOOKS[name]) if "remove-cell" not in tags(cell)]
    trees = [parse(cell.source) for cell in solved]
    loaded = {
        node.id
        for tree in trees
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }
    seen = [(cell.id, names(cell)[1]) for cell in code_cells(handed_out)]
    assert [(cell, sets - loaded - {"_"}) for cell, sets in seen if sets - loaded - {"_"}] == []


@pytest.mark.parametrize("name", [name for name in CHAPTERS if name[:2] not in ("01", "02", "09")])
def test_a_chapter_begins_with_two_questions_on_chapters_that_lie_further_back(name):
    """On the one before the last, and from chapter 5 on, on the one two before that as well."""
    (recall,) = [cell.source for cell in NOTEBOOKS[name].cells if cell.id == "recall"]
    place = CHAPTERS.index(name)
    asked = [CHAPTERS[place - back] for back in (2, 4) if place >= back]
    assert [f"]({chapter})" in recall for chapter in asked] == [True] * len(asked)
    assert recall.count("{dropdown} Answer") == 2


@each_notebook
def test_headings_with_numbers_count_from_one(name):
    text = "\n".join(cell.source for cell in NOTEBOOKS[name].cells)
    for word in ("", "Problem "):
        numbers = re.findall(rf"(?m)^## {word}(\d+)[.:] ", text)
        assert numbers == [str(k + 1) for k in range(len(numbers))]


@each_notebook
def test_outputs_stay_out_of_the_repository_and_cells_have_names_of_their_own(name):
    cells = NOTEBOOKS[name].cells
    assert [cell.id for cell in cells if cell.get("outputs") or cell.get("execution_count")] == []
    assert max(Counter(cell.id for cell in cells).values()) == 1
    assert [cell.id for cell in cells if re.fullmatch(r"[0-9a-f]{8}(-.*)?", cell.id)] == []


@pytest.mark.parametrize("name", CHAPTERS)
def test_a_chapter_shows_little_code_and_opens_with_a_picture(name):
    """What draws, checks or solves is folded; the picture is on the first screen.

    Above it stand at most one paragraph and code that is folded.
    """
    shown = [cell for cell in code_cells(NOTEBOOKS[name]) if not FOLDED & tags(cell)]
    assert sum(len(cell.source.splitlines()) for cell in shown) <= MAX_SHOWN
    opening = takewhile(lambda cell: not cell.source.startswith("*"), NOTEBOOKS[name].cells)
    title, *others = opening
    assert title.source.count("\n\n") == 1 or "\n\n![" in title.source
    assert all(FOLDED & tags(cell) for cell in others) or "\n\n![" in title.source
