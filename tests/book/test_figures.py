"""Pictures that become figures, and links that tell what a word means."""

from __future__ import annotations

import figures
import pytest
import terms
from docutils import nodes
from docutils.utils import new_document
from sphinx import addnodes


def cell(*mime_types: str) -> nodes.container:
    """A cell of code as MyST-NB reads it, with one output in several forms."""
    bundle = nodes.container(nb_element="mime_bundle")
    bundle += [nodes.container(mime_type=each) for each in mime_types]
    output = nodes.container("", bundle, nb_element="cell_code_output")
    return nodes.container("", output, nb_element="cell_code")


def words(*parts: nodes.Node) -> nodes.paragraph:
    return nodes.paragraph("", "", *parts)


def italic(text: str) -> nodes.emphasis:
    return nodes.emphasis("", "", nodes.Text(text))


def page(*parts: nodes.Node) -> nodes.document:
    document = new_document("page")
    document += nodes.section("", *parts)
    figures.make_figures(None, document)
    return document


def captions(document: nodes.document) -> list[str]:
    return [each.astext() for each in document.findall(nodes.caption)]


def test_a_drawn_picture_and_the_italic_words_below_it_are_a_figure():
    document = page(
        cell("text/plain", "image/png"), words(italic("A wall.")), words(nodes.Text("So."))
    )
    (figure,) = document.findall(nodes.figure)
    assert captions(document) == ["A wall."]
    assert figure.parent["nb_element"] == "cell_code_output"
    assert figure[0]["nb_element"] == "mime_bundle"
    assert [each.astext() for each in document.findall(nodes.paragraph)] == ["So."]


def test_what_follows_the_italic_words_stays_text():
    document = page(cell("image/png"), words(italic("A wall."), nodes.Text(" It is proven.")))
    assert captions(document) == ["A wall."]
    assert [each.astext().strip() for each in document.findall(nodes.paragraph)] == [
        "It is proven."
    ]


def test_each_figure_of_a_page_has_an_id_of_its_own():
    one = [cell("image/png"), words(italic("One."))]
    two = [words(nodes.image(uri="map.png")), words(italic("Two."))]
    ids = [each["ids"] for each in page(*one, *two).findall(nodes.figure)]
    assert ids == [["figure-1"], ["figure-2"]]


def test_a_picture_for_paper_gets_no_number():
    picture = cell("image/png")
    picture["classes"].append("tag_on-paper")
    assert captions(page(picture, words(italic("On paper.")))) == []


@pytest.mark.parametrize(
    "parts",
    [
        [cell("text/plain"), words(italic("No picture."))],
        [
            cell("application/vnd.jupyter.widget-view+json", "text/plain"),
            words(italic("A slider.")),
        ],
        [cell("image/png"), words(nodes.Text("Between.")), words(italic("Too late."))],
    ],
    ids=["text", "slider", "apart"],
)
def test_other_words_are_no_caption(parts):
    assert captions(page(*parts)) == []


def test_a_meaning_is_told_without_citations_and_chapters():
    link = addnodes.pending_xref("", nodes.Text("chapter 8"))
    meaning = nodes.paragraph("", "", nodes.Text("How far it is\noff ("), link, nodes.Text(")."))
    entry = nodes.definition_list_item(
        "", nodes.term("", "ATE", ids=["term-ATE"]), nodes.definition("", meaning)
    )
    assert terms._plain(entry) == "How far it is off."
