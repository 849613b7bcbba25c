"""Every notebook's form: short cells, one import cell, no helper twice, figures with words.

The notebooks are found by their folder, so one that is written tomorrow is held to the same
rules. That they run is nbval's part.
"""

from __future__ import annotations

import ast
import dis
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import pairwise, takewhile
from pathlib import Path
from types import CodeType

import nbformat
import pytest
from fold_cells import is_folded
from IPython.core.inputtransformer2 import TransformerManager
from nbformat import NotebookNode

FOLDER = Path(__file__).parents[2] / "notebooks"
NOTEBOOKS = {
    path.relative_to(FOLDER).as_posix(): nbformat.read(path, as_version=4)
    for path in sorted(FOLDER.rglob("*.ipynb"))
    if ".ipynb_checkpoints" not in path.parts
}
CHAPTERS = [name for name in NOTEBOOKS if re.match(r"(0[1-9]|10)_", name)]
MAX_LINES = 15  # about 12 is the aim
MAX_OPENING = 45  # the imports and the first picture
MAX_SHOWN = 150  # lines of code that a chapter shows unasked
FOLDED = {"hide-input", "hide-cell", "remove-cell", "remove-input", "solution"}
# The assignment's questions need numpy alone; what runs the answers on a log comes after them.
LATER_IMPORTS = {"assignment.ipynb": ["killian-imports"]}
WIDGETS = {"align_by_hand", "flipbook", "icp_explorer", "icp_sliders", "live_figure"}
each_notebook = pytest.mark.parametrize("name", NOTEBOOKS)


def code_cells(notebook: NotebookNode) -> list[NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def tags(cell: NotebookNode) -> set[str]:
    return set(cell.metadata.get("tags", []))


def parse(source: str) -> ast.Module:
    """The Python of a cell, its magics turned into calls."""
    return ast.parse(TransformerManager().transform_cell(source))


def length(cell: NotebookNode) -> int:
    """Lines of a cell; those of docstrings do not count."""
    functions = [node for node in parse(cell.source).body if isinstance(node, ast.FunctionDef)]
    words = [node.body[0] for node in functions if ast.get_docstring(node)]
    return len(cell.source.splitlines()) - sum(
        word.end_lineno - word.lineno + 1 for word in words if word.end_lineno
    )


def too_long(cells: Iterable[NotebookNode]) -> list[str]:
    return [cell.id for cell in cells if length(cell) > MAX_LINES]


def helpers(notebook: NotebookNode) -> Iterator[ast.FunctionDef]:
    """What a notebook defines for itself; a stub or an answer to a question is no helper."""
    for cell in code_cells(notebook):
        stub = "stub" in tags(cell)
        if not stub and not cell.metadata.get("nbgrader", {}).get("solution", False):
            nodes = parse(cell.source).body
            yield from (node for node in nodes if isinstance(node, ast.FunctionDef))


def defined_twice(notebooks: Iterable[NotebookNode]) -> list[str]:
    """Names of helpers that come more than once."""
    found = Counter(each.name for notebook in notebooks for each in helpers(notebook))
    return [name for name, count in found.items() if count > 1]


def shows_widget(cell: NotebookNode, widgets: frozenset[str] | set[str] = WIDGETS) -> bool:
    """Whether a cell calls what moves under the reader's hand."""
    calls = [node for node in ast.walk(parse(cell.source)) if isinstance(node, ast.Call)]
    names = {node.func.id for node in calls if isinstance(node.func, ast.Name)}
    return bool(names & widgets)


def without_a_prediction(notebook: NotebookNode) -> list[str]:
    """Widgets before which their section asks for no prediction of their own.

    A function that the notebook defines for itself is no widget, whatever its name.
    """
    silent, asked, own = [], False, {each.name for each in helpers(notebook)}
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            *_, last = re.split(r"^##+ ", cell.source, flags=re.MULTILINE)
            asked = ":class: predict" in last or (asked and last == cell.source)
        elif shows_widget(cell, WIDGETS - own):
            silent += [] if asked else [cell.id]
            asked = False
    return silent


def names(cell: str) -> tuple[set[str], set[str]]:
    """The names that a cell reads before it sets them, and those that it sets."""
    reads, sets = set[str](), set[str]()
    code = compile(TransformerManager().transform_cell(cell), "cell", "exec")
    for step in dis.get_instructions(code):
        if step.opname == "STORE_NAME":
            sets.add(step.argval)
        elif step.opname == "LOAD_NAME" and step.argval not in sets:
            reads.add(step.argval)
    return reads | (set(read_inside(code)) - sets), sets


def read_inside(code: CodeType) -> Iterator[str]:
    """The names that functions and comprehensions in a piece of code take from the notebook."""
    for part in code.co_consts:
        if isinstance(part, CodeType):
            yield from (
                step.argval
                for step in dis.get_instructions(part)
                if step.opname in ("LOAD_GLOBAL", "LOAD_NAME")
            )
            yield from read_inside(part)


@each_notebook
def test_cells_are_short(name):
    opening, *others = code_cells(NOTEBOOKS[name])
    assert too_long(others) == []
    assert length(opening) <= MAX_OPENING


@each_notebook
def test_all_is_imported_in_the_first_cell_of_code(name):
    """Which may go on to draw the chapter's first picture: one fold in JupyterLab, not four."""
    imports = (ast.Import, ast.ImportFrom)
    importing = [
        cell.id
        for cell in code_cells(NOTEBOOKS[name])[1:]
        if any(isinstance(node, imports) for node in ast.walk(parse(cell.source)))
    ]
    assert importing == LATER_IMPORTS.get(name, [])


@each_notebook
def test_jupyterlab_folds_what_the_book_folds(name):
    """`python book/_ext/fold_cells.py notebooks/*.ipynb` mends it."""
    assert [cell.id for cell in code_cells(NOTEBOOKS[name]) if not is_folded(cell)] == []


@each_notebook
def test_no_cell_needs_what_a_claim_sets(name):
    """The students' edition has none of the cells that assert what the text claims."""
    claimed, known, missing = set[str](), set[str](), dict[str, str]()
    for cell in code_cells(NOTEBOOKS[name]):
        reads, sets = names(cell.source)
        if "remove-cell" in tags(cell):
            claimed |= sets
        elif "solution" not in tags(cell):
            missing |= dict.fromkeys(reads & claimed - known, cell.id)
            known |= sets
    assert missing == {}


def test_no_helper_is_defined_twice():
    assert defined_twice(NOTEBOOKS.values()) == []


@each_notebook
def test_a_figure_has_words_for_those_who_cannot_see_it(name):
    silent = [
        cell.id
        for cell in code_cells(NOTEBOOKS[name])
        if cell.source.split("\n")[-1] == "figure"
        and len(cell.metadata.get("mystnb", {}).get("image", {}).get("alt", "")) < 40
    ]
    assert silent == []


@pytest.mark.parametrize("name", CHAPTERS)
def test_a_figure_has_a_caption_below_it(name):
    """In italics: in the book they get the figure's number (`book/_ext/figures.py`)."""
    cells = [cell for cell in NOTEBOOKS[name].cells if "remove-cell" not in tags(cell)]
    bare = [
        cell.id
        for cell, below in pairwise(cells)
        if cell.cell_type == "code"
        and cell.source.split("\n")[-1] == "figure"
        and not (below.cell_type == "markdown" and re.match(r"\*[^*]", below.source))
    ]
    assert bare == []


@pytest.mark.parametrize("name", CHAPTERS)
def test_a_chapter_shows_little_code(name):
    """What draws, checks or solves is folded or left out of the page."""
    shown = [cell for cell in code_cells(NOTEBOOKS[name]) if not FOLDED & tags(cell)]
    assert sum(len(cell.source.splitlines()) for cell in shown) <= MAX_SHOWN


@each_notebook
def test_the_reader_predicts_before_each_slider(name):
    assert without_a_prediction(NOTEBOOKS[name]) == []


@each_notebook
def test_outputs_stay_out_of_the_repository(name):
    cells = code_cells(NOTEBOOKS[name])
    assert [cell.id for cell in cells if cell.outputs or cell.execution_count] == []


@each_notebook
def test_cells_have_names_of_their_own(name):
    ids = [cell.id for cell in NOTEBOOKS[name].cells]
    assert [each for each, count in Counter(ids).items() if count > 1] == []
    assert [each for each in ids if re.fullmatch(r"[0-9a-f]{8}(-.*)?", each)] == []


@pytest.mark.parametrize("name", CHAPTERS)
def test_a_chapter_opens_with_a_picture(name):
    """Below at most one paragraph and code that is folded, so that it is in the first screen."""
    opening = takewhile(lambda cell: not cell.source.startswith("*"), NOTEBOOKS[name].cells)
    title, *others = opening
    assert title.source.count("\n\n") == 1 or "\n\n![" in title.source
    assert all(FOLDED & tags(cell) for cell in others) or "\n\n![" in title.source
