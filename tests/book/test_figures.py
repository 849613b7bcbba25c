"""Pictures that become figures."""

from __future__ import annotations

import figures
import pytest
from docutils import nodes
from docutils.utils import new_document


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


def test_pictures_and_the_italic_words_below_them_are_figures_each_with_an_id_of_its_own():
    """What follows the italic words stays text."""
    one = [cell("text/plain", "image/png"), words(italic("One."), nodes.Text(" It is proven."))]
    two = [words(nodes.image(uri="map.png")), words(italic("Two.")), words(nodes.Text("So."))]
    document = page(*one, *two)
    drawn, _ = document.findall(nodes.figure)
    assert [each["ids"] for each in document.findall(nodes.figure)] == [["figure-1"], ["figure-2"]]
    assert captions(document) == ["One.", "Two."]
    assert drawn.parent["nb_element"] == "cell_code_output"
    assert drawn[0]["nb_element"] == "mime_bundle"
    texts = [each.astext().strip() for each in document.findall(nodes.paragraph)]
    assert [text for text in texts if text] == ["It is proven.", "So."]


ON_PAPER = cell("image/png")
ON_PAPER["classes"].append("tag_on-paper")
SLIDER = cell("application/vnd.jupyter.widget-view+json", "text/plain")


@pytest.mark.parametrize(
    "parts",
    [
        [cell("text/plain"), words(italic("No picture."))],
        [SLIDER, words(italic("A slider."))],
        [cell("image/png"), words(nodes.Text("Between.")), words(italic("Too late."))],
        [ON_PAPER, words(italic("On paper."))],
    ],
    ids=["text", "slider", "apart", "on paper"],
)
def test_other_words_are_no_caption(parts):
    assert captions(page(*parts)) == []
