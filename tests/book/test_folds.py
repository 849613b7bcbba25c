"""Folded cells that become one fold, and solutions in one."""

from __future__ import annotations

import folds
import pytest
from docutils import nodes
from docutils.utils import new_document

REGION = "### BEGIN SOLUTION\nx = 1\n### END SOLUTION"


def cell(code: str, *, hide: str = "input", said: str = "") -> nodes.container:
    """A cell as MyST-NB reads it."""
    source = nodes.container("", nodes.literal_block(code, code), nb_element="cell_code_source")
    made = nodes.container("", source, nb_element="cell_code", hide_mode=hide)
    if said:
        made += nodes.container("", nodes.literal_block(said, said))
    return made


def dropdown(title: str) -> nodes.container:
    made = nodes.container("", nodes.rubric("", title), design_component="dropdown")
    made += nodes.paragraph("", "Because.")
    return made


def tidied(*parts: nodes.Node) -> list[list[str]]:
    """The words of what is left, part by part."""
    document = new_document("page")
    document += nodes.section("", *parts)
    folds.tidy_cells(None, document)
    return [each.astext().split() for each in document[0]]


def test_cells_that_show_nothing_join_the_next_that_does():
    """Over text, too."""
    one, text, last = cell("a = 1"), nodes.paragraph("", "So."), cell("b", said="2")
    assert tidied(one, text, cell("c", hide=""), last, cell("d")) == [
        ["So."],
        ["c"],
        ["a", "=", "1", "b", "2"],
        ["d"],
    ]
    assert last.astext().startswith("a = 1\n\n\nb")


@pytest.mark.parametrize("above", [["Solution"], ["Hint"], []])
def test_the_cells_of_a_solution_go_into_its_dropdown_or_one_of_their_own(above):
    parts = [*map(dropdown, above), cell(REGION), cell("y", hide="all", said="1")]
    *others, last = tidied(nodes.paragraph("", "Why?"), *parts, cell("z", said="3"))[:-1]
    title = ["Solution", "Because."] if above == ["Solution"] else folds.IN_CODE.split()
    assert last == [*title, "x", "=", "1", "y", "1"]
    assert others == [["Why?"], *([["Hint", "Because."]] if above == ["Hint"] else [])]


@pytest.mark.parametrize(("said", "kept"), [("○ `f` is not written yet.", 1), ("12", 2)])
def test_the_check_of_an_unsolved_exercise_is_silent(said, kept):
    stub = cell("check(f)", hide="", said=said)
    stub["classes"].append("tag_stub")
    tidied(stub)
    assert len(stub) == kept
