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


def dropdown(title: str) -> nodes.container:
    made = nodes.container("", nodes.rubric("", title), design_component="dropdown")
    made += nodes.paragraph("", "Because.")
    return made


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0)], ids=["text first", "code first"])
def test_the_cells_of_a_solution_go_into_its_dropdown(order):
    parts = [dropdown("Solution"), cell("x = 1", hide="all"), cell("y = 2", hide="all")]
    section = nodes.section("", nodes.paragraph("", "Why?"), *(parts[i] for i in order))
    document = new_document("page")
    document += section
    folds.join_folds(None, document)
    assert [each.astext() for each in section] == ["Why?", parts[0].astext()]
    assert parts[0].astext().split() == ["Solution", "Because.", "x", "=", "1", "y", "=", "2"]
    assert not any(each.get("hide_mode") for each in parts)


def test_a_solution_without_text_gets_a_dropdown_but_not_a_hint_s():
    hint, one = dropdown("Hint"), cell("x = 1", hide="all")
    section = nodes.section("", hint, one)
    document = new_document("page")
    document += section
    folds.join_folds(None, document)
    assert [each[0].astext() for each in section] == ["Hint", folds.IN_CODE]
    assert one.parent is section[1]
