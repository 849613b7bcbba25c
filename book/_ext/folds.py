"""Folded code in as few folds as can be.

A picture often takes a cell of numbers and a cell that draws them. JupyterLab folds each alone.
In the book a folded cell that shows nothing goes into the fold of the folded cell below it.
On paper nothing unfolds: folded code is left out there, but for solutions, which get a class.
"""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx

BLANK = "\n\n\n"  # as two functions stand apart in a file


def join_folds(app: Sphinx, doctree: nodes.document) -> None:
    """Join each folded cell without output with the folded cell that follows it."""
    for cell in list(doctree.findall(nodes.container)):
        below = cell.next_node(descend=False, siblings=True)
        if _is_solution(cell):
            cell["classes"].append("solved")
        elif _is_folded(cell) and _is_folded(below) and len(cell) == 1:
            above, code = _code(cell), _code(below)
            joined = above.astext() + BLANK + code.astext()
            code.rawsource, code.children = joined, []
            code += nodes.Text(joined)
            cell.parent.remove(cell)


def _is_folded(node: nodes.Node | None) -> bool:
    """Whether a node is a cell whose code is hidden and its output is not; no solution."""
    hidden = isinstance(node, nodes.container) and node.get("hide_mode") == "input"
    return hidden and not _is_solution(node)


def _is_solution(node: nodes.Element) -> bool:
    is_cell = node.get("nb_element") == "cell_code"
    return is_cell and "### BEGIN SOLUTION" in node.astext()


def _code(cell: nodes.Element) -> nodes.literal_block:
    return next(iter(cell[0].findall(nodes.literal_block)))
