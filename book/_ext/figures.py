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
    for number, (picture, words) in enumerate(list(_captioned(doctree)), start=1):
        figure = nodes.figure("", ids=[f"figure-{number}"])
        picture.replace_self(figure)
        italic = words[0]
        words.remove(italic)
        figure += [picture, nodes.caption("", "", *italic.children)]
        if not words.astext().strip():
            words.parent.remove(words)
        if any(LIVE in image["uri"] for image in picture.findall(nodes.image)):
            room = nodes.raw("", '<div class="map-live"></div>', format="html")
            figure.parent.insert(figure.parent.index(figure), room)


def _captioned(doctree: nodes.document) -> Iterator[tuple[nodes.Element, nodes.paragraph]]:
    """Pictures and the paragraphs under them that begin in italics."""
    for words in doctree.findall(nodes.paragraph):
        if words.children and isinstance(words[0], nodes.emphasis):
            above = words.parent.index(words) - 1
            picture = _picture(words.parent[above]) if above >= 0 else None
            if picture is not None:
                yield picture, words


def _picture(node: nodes.Node) -> nodes.Element | None:
    """The last picture that a cell draws, or that a paragraph consists of."""
    if isinstance(node, nodes.paragraph) and len(node) == 1 and isinstance(node[0], nodes.image):
        return node
    drawn = None
    if isinstance(node, nodes.container) and node.get("nb_element") == "cell_code":
        for output in node.findall(nodes.container):
            if output.get("nb_element") == "mime_bundle" and any(map(_is_image, output)):
                drawn = output
    return drawn


def _is_image(output: nodes.Node) -> bool:
    return isinstance(output, nodes.container) and output["mime_type"].startswith("image/")
