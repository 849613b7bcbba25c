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


def test_cells_that_show_nothing_join_the_next_that_does():
    """Over text, too; what stands behind the last of them joins that."""
    assert joined(
        cell("a = 1"),
        nodes.paragraph("", "So."),
        cell("open", hide=""),
        cell("a", output=True),
        cell("c = 3"),
    ) == ["open", "a = 1\n\n\na\n\n\nc = 3"]


def test_a_solution_stays_alone_and_does_not_show_its_marks():
    one = cell("### BEGIN SOLUTION\nx = 1\n### END SOLUTION")
    assert joined(cell("y"), one, cell("x", output=True)) == ["x = 1\n", "y\n\n\nx"]
    assert one.parent[0].astext() == folds.IN_CODE


def test_what_the_check_of_a_solution_shows_is_folded_with_it():
    one, told = cell("### BEGIN SOLUTION\nx = 1\n### END SOLUTION"), cell("x", output=True)
    told["cell_metadata"] = {"nbgrader": {"grade": True}}
    alone = told.deepcopy()
    joined(one, told, nodes.paragraph("", "And so on."), alone)
    assert told.parent is one.parent
    assert alone.parent is not one.parent


@pytest.mark.parametrize(("said", "kept"), [("○ `f` is not written yet.", 1), ("12", 2)])
def test_the_check_of_an_unsolved_exercise_is_silent(said, kept):
    stub = cell("check(f)", hide="", output=True)
    stub["classes"].append("tag_stub")
    stub[1] += nodes.literal_block(said, said)
    joined(stub)
    assert len(stub) == kept


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
