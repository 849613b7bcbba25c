"""Folded code in as few folds as can be, and no traces of how exercises are made.

A picture often takes cells of numbers and a cell that draws them. JupyterLab folds each alone.
In the book a folded cell that shows nothing goes into the fold of the next one that shows
something, or else of the last one before. The cells of a solution go into the dropdown of its
text, or into one of their own, with the check that follows them. Marks of solutions, and what an
unsolved exercise's check says, are left out. On paper nothing unfolds: folded code is left out
there, but for solutions.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from docutils import nodes
from sphinx.application import Sphinx
from sphinx_design.shared import create_component

BLANK = "\n\n\n"  # as two functions stand apart in a file
MARK = re.compile(r"^[ \t]*### (?:BEGIN|END) SOLUTION[ \t]*\n?", re.MULTILINE)
UNSOLVED = ("○", "✗")  # how a check begins what it says
SOLUTION = "Solution"
IN_CODE = "Solution in code"


def join_folds(app: Sphinx, doctree: nodes.document) -> None:
    """Join each folded cell without output with one that has some, and gather the solutions."""
    waiting: list[nodes.container] = []
    shown: nodes.container | None = None
    solution: nodes.container | None = None
    for cell in list(doctree.findall(nodes.container)):
        if _is_solution(cell) and cell.get("hide_mode") == "input":
            solution = _put_into(None, [cell])
        elif _is_check(cell) and solution and cell.parent[cell.parent.index(cell) - 1] is solution:
            _put_into(solution, [cell])
        elif _is_folded(cell) and len(cell) == 1:
            waiting.append(cell)
        elif _is_folded(cell):
            _join([*waiting, cell], cell)
            waiting, shown = [], cell
        if cell.get("nb_element") == "cell_code":
            _silence(cell)
    if shown and waiting:
        _join([shown, *waiting], shown)
    for cells, dropdown in list(_solutions(doctree)):
        _put_into(dropdown, cells)
    for code in doctree.findall(nodes.literal_block):
        if MARK.search(code.astext()):
            _write(code, MARK.sub("", code.astext()))


def _join(cells: list[nodes.container], into: nodes.container) -> None:
    """Put the code of all cells into one of them, in their order."""
    _write(_code(into), BLANK.join(_code(each).astext() for each in cells))
    for each in cells:
        if each is not into:
            each.parent.remove(each)


def _write(code: nodes.literal_block, text: str) -> None:
    code.rawsource, code.children = text, []
    code += nodes.Text(text)


def _silence(cell: nodes.container) -> None:
    """Take out what the check of an exercise says that nobody has solved."""
    signs = UNSOLVED if "tag_stub" in cell["classes"] else UNSOLVED[:1]
    for output in cell.children[1:]:
        if output.astext().lstrip()[:1] in signs:
            cell.remove(output)


def _solutions(
    doctree: nodes.document,
) -> Iterator[tuple[list[nodes.container], nodes.container | None]]:
    """The hidden cells of each solution, and the dropdown that stands beside them, if any."""
    for cell in doctree.findall(_is_hidden):
        parent = cell.parent
        at = parent.index(cell)
        if at and _is_hidden(parent[at - 1]):
            continue
        end = at
        while end < len(parent) and _is_hidden(parent[end]):
            end += 1
        beside = [*parent[max(at - 1, 0) : at], *parent[end : end + 1]]
        dropdown = next(filter(_is_dropdown, beside), None)
        yield list(parent[at:end]), dropdown


def _put_into(dropdown: nodes.container | None, cells: list[nodes.container]) -> nodes.container:
    if dropdown is None:
        dropdown = create_component(
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
        dropdown += nodes.rubric(IN_CODE, IN_CODE)
        cells[0].parent.insert(cells[0].parent.index(cells[0]), dropdown)
    for cell in cells:
        cell.parent.remove(cell)
        del cell["hide_mode"]
        dropdown += cell
    return dropdown


def _is_hidden(node: nodes.Node | None) -> bool:
    """Whether a node is a cell that is hidden with its output: part of a solution."""
    return isinstance(node, nodes.container) and node.get("hide_mode") == "all"


def _is_dropdown(node: nodes.Node) -> bool:
    is_one = isinstance(node, nodes.container) and node.get("design_component") == "dropdown"
    return is_one and node[0].astext() == SOLUTION


def _is_folded(node: nodes.Node | None) -> bool:
    """Whether a node is a cell whose code is hidden and its output is not; no solution."""
    hidden = isinstance(node, nodes.container) and node.get("hide_mode") == "input"
    return hidden and not _is_solution(node)


def _is_solution(node: nodes.Element) -> bool:
    is_cell = node.get("nb_element") == "cell_code"
    return is_cell and "### BEGIN SOLUTION" in node.astext()


def _is_check(node: nodes.Element) -> bool:
    """Whether a folded cell tries the solution that stands before it: its output would tell it."""
    of_nbgrader = node.get("cell_metadata", {}).get("nbgrader", {})
    return bool(node.get("hide_mode") == "input" and of_nbgrader.get("grade"))


def _code(cell: nodes.Element) -> nodes.literal_block:
    return next(iter(cell[0].findall(nodes.literal_block)))
