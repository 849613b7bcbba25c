"""What the search shows of its hits where the book is a folder: there no page may read another.

A web server's search reads each page that it found. For a folder the text of all pages stands in
one script, which only the search loads (`access.js`).
"""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx

FILE = "excerpts.js"
UNREAD = (nodes.comment, nodes.raw, nodes.target, nodes.substitution_definition)


def write_excerpts(app: Sphinx, error: Exception | None) -> None:
    """Write the script when the pages are built: a page's name → its text, in sections."""
    if error is None and app.builder.name == "html":
        texts = {
            page: sections_of(app.env.get_doctree(page)) for page in sorted(app.env.found_docs)
        }
        told = json.dumps(texts, ensure_ascii=False, separators=(",", ":"))
        Path(app.outdir, FILE).write_text(f"labbookExcerpts({told});\n", "utf-8")


def sections_of(node: nodes.Element) -> str:
    """The text below a node, as the little HTML in which the search looks for a section.

    Examples
    --------
    >>> page = nodes.section("", nodes.title("", "Scans"), nodes.section("", ids=["a < b"]))
    >>> sections_of(page)
    'Scans <section id="a &lt; b"></section>'
    """
    parts = []
    for child in node.children:
        if isinstance(child, nodes.section):
            name = html.escape((child["ids"] or [""])[0])
            parts.append(f'<section id="{name}">{sections_of(child)}</section>')
        elif not isinstance(child, UNREAD) and "cell_output" not in child.get("classes", ()):
            parts.append(html.escape(re.sub(r"\s+", " ", child.astext()), quote=False))
    return " ".join(parts)
