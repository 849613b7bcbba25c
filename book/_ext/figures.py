"""Figures with numbers: a picture and the words under it become one figure of the book.

Under a picture, drawn by a cell or written as an image, stands its caption as a paragraph that
begins in italics, so that JupyterLab shows it there, too. In the book the italic words become
the figure's caption, and Sphinx numbers it by its chapter ("Figure 4.2"). What follows the
italic words in the same paragraph stays text.
"""

from __future__ import annotations

from collections.abc import Iterator

from docutils import nodes
from sphinx.application import Sphinx

LIVE = "killian-map"  # above this picture stands the map that `map.js` draws: its room is kept


def make_figures(app: Sphinx, doctree: nodes.document) -> None:
    """Turn every picture with words under it into a figure with a caption."""
    pairs = list(_pictures_with_paragraphs(doctree))
    for number, (picture, paragraph) in enumerate(pairs, start=1):
        figure = nodes.figure("", ids=[f"figure-{number}"])
        picture.replace_self(figure)
        italic = paragraph[0]
        paragraph.remove(italic)
        figure += [picture, nodes.caption("", "", *italic.children)]
        if not paragraph.astext().strip():
            paragraph.parent.remove(paragraph)
        if any(LIVE in image["uri"] for image in picture.findall(nodes.image)):
            room = nodes.raw("", '<div class="map-live"></div>', format="html")
            figure.parent.insert(figure.parent.index(figure), room)


def _pictures_with_paragraphs(
    doctree: nodes.document,
) -> Iterator[tuple[nodes.Element, nodes.paragraph]]:
    """Pictures and the paragraphs under them that begin in italics."""
    for paragraph in doctree.findall(nodes.paragraph):
        if paragraph.children and isinstance(paragraph[0], nodes.emphasis):
            above = paragraph.parent.index(paragraph) - 1
            picture = _picture(paragraph.parent[above]) if above >= 0 else None
            if picture is not None:
                yield picture, paragraph


def _picture(node: nodes.Node) -> nodes.Element | None:
    """The last picture that a cell draws, or that a paragraph consists of."""
    if isinstance(node, nodes.paragraph) and len(node) == 1 and isinstance(node[0], nodes.image):
        return node
    picture = None
    if isinstance(node, nodes.container) and node.get("nb_element") == "cell_code":
        for output in node.findall(nodes.container):
            if output.get("nb_element") == "mime_bundle" and any(map(_is_image, output)):
                picture = output
    return picture


def _is_image(output: nodes.Node) -> bool:
    return isinstance(output, nodes.container) and output["mime_type"].startswith("image/")
