"""Folded code in few folds, solutions in one, and no traces of how exercises are made.

A picture often takes cells of numbers and a cell that draws them. JupyterLab folds each alone.
In the book a folded cell that shows nothing goes into the fold of the next one that shows
something. The cells of a solution go into the dropdown of its text, or into one of their own.
Marks of solutions, nbgrader's hidden tests, and what an unsolved exercise's check says, are left
out. On paper nothing unfolds: folded code is left out there, but for solutions.
"""

from __future__ import annotations

import re
from typing import TypeGuard

from docutils import nodes
from solutions import HIDDEN_TESTS
from sphinx.application import Sphinx
from sphinx_design.shared import create_component

BLANK = "\n\n\n"  # as two functions stand apart in a file
MARK = re.compile(r"^[ \t]*### (?:BEGIN|END) SOLUTION[ \t]*\n?", re.MULTILINE)
UNSOLVED = ("○", "✗")  # how a check begins what it says
SOLUTION, IN_CODE = "Solution", "Solution in code"


def tidy_cells(app: Sphinx, doctree: nodes.document) -> None:
    """Join folds, gather solutions, and silence the checks of unsolved exercises."""
    waiting: list[nodes.container] = []
    for cell in list(doctree.findall(nodes.container)):
        if cell.get("nb_element") != "cell_code":
            continue
        _silence(cell)
        mode = cell.get("hide_mode")
        if mode == "all" or (mode and MARK.search(cell.astext())):
            _gather(cell)
        elif mode == "input":
            waiting.append(cell)
            if len(cell) > 1:
                _join(waiting, cell)
                waiting = []
    for code in doctree.findall(nodes.literal_block):
        source = code.astext()
        shown = MARK.sub("", HIDDEN_TESTS.sub("", source))
        if shown != source:
            _write(code, shown.rstrip("\n"))


def _join(cells: list[nodes.container], into: nodes.container) -> None:
    """Put the code of all cells into the last one."""
    code = [next(iter(cell[0].findall(nodes.literal_block))) for cell in cells]
    _write(code[-1], BLANK.join(block.astext() for block in code))
    for cell in cells[:-1]:
        cell.parent.remove(cell)


def _write(code: nodes.literal_block, source: str) -> None:
    code.rawsource = source
    code.children = []
    code += nodes.Text(source)


def _silence(cell: nodes.container) -> None:
    """Take out what the check of an exercise says that nobody has solved."""
    signs = UNSOLVED if "tag_stub" in cell["classes"] else UNSOLVED[:1]
    for output in cell.children[1:]:
        if output.astext().lstrip()[:1] in signs:
            cell.remove(output)


def _gather(cell: nodes.container) -> None:
    """Put a cell of a solution into the dropdown above it, or into one of its own."""
    parent = cell.parent
    place = parent.index(cell)
    above = parent[place - 1] if place else None
    if not (is_dropdown(above) and above[0].astext() in (SOLUTION, IN_CODE)):
        above = create_component(
            "dropdown",
            classes=[],
            opened=False,
            type="dropdown",
            has_title=True,
            icon=None,
            chevron=None,
            container_classes=["sd-mb-3"],
            title_classes=[],
            body_classes=[],
        )
        above += nodes.rubric(IN_CODE, IN_CODE)
        parent.insert(place, above)
    parent.remove(cell)
    del cell["hide_mode"]
    above += cell


def is_dropdown(node: nodes.Node | None) -> TypeGuard[nodes.container]:
    """Whether a node is a box that folds."""
    return isinstance(node, nodes.container) and node.get("design_component") == "dropdown"
