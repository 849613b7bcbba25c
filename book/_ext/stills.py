"""The picture that a widget brings: the page keeps it for paper, and for where no script runs."""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx

WIDGET = "application/vnd.jupyter.widget-view+json"
ALT = "The widget as it stands at first."


def keep_stills(app: Sphinx, doctree: nodes.document) -> None:
    """Put the picture of each widget below it; the style sheet says when it is shown."""
    for bundle in list(doctree.findall(_is_widget)):
        for picture in [part for part in bundle if part["mime_type"].startswith("image/")]:
            bundle.remove(picture)
            for image in picture.findall(nodes.image):
                image["alt"] = ALT
            still = nodes.container("", *picture.children, classes=["still"])
            bundle.parent.insert(bundle.parent.index(bundle) + 1, still)


def _is_widget(node: nodes.Node) -> bool:
    if not isinstance(node, nodes.container) or node.get("nb_element") != "mime_bundle":
        return False
    return any(part["mime_type"] == WIDGET for part in node)
