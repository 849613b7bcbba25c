"""Folded cells that become one fold."""

from __future__ import annotations

import folds
import pytest
from docutils import nodes
from docutils.utils import new_document


def cell(code: str, *, hide: str = "input", output: bool = False) -> nodes.container:
    """A cell as MyST-NB reads it."""
    source = nodes.container("", nodes.literal_block(code, code), nb_element="cell_code_source")
    made = nodes.container("", source, nb_element="cell_code", hide_mode=hide)
    if output:
        made += nodes.container(nb_element="cell_code_output")
    return made


def joined(*parts: nodes.Node) -> list[str]:
    document = new_document("page")
    document += nodes.section("", *parts)
    folds.join_folds(None, document)
    return [each.astext() for each in document.findall(nodes.literal_block)]


def test_cells_that_show_nothing_join_the_one_that_does():
    assert joined(cell("a = 1"), cell("b = 2"), cell("a + b", output=True), cell("c = 3")) == [
        "a = 1\n\n\nb = 2\n\n\na + b",
        "c = 3",
    ]


@pytest.mark.parametrize(
    "between",
    [[nodes.paragraph("", "So.")], [cell("open", hide="")], [cell("answer", hide="all")]],
    ids=["text", "open code", "a solution"],
)
def test_what_stands_between_keeps_them_apart(between):
    assert "a = 1" in joined(cell("a = 1"), *between, cell("b = 2", output=True))


def test_a_solution_stays_alone():
    solved = "### BEGIN SOLUTION\nx = 1\n### END SOLUTION"
    one = cell(solved)
    assert joined(cell("y"), one, cell("x", output=True)) == ["y", solved, "x"]
    assert one["classes"] == ["solved"]
