"""The directive ``mermaid``: a diagram drawn when the book is built, as SVG inside the page.

The picture needs no script and no network, its words can be searched and selected, and
its colours are those of the page (`labbook.css`), light or dark.
"""

from __future__ import annotations

import hashlib
import html
from typing import ClassVar

import mermaidx
from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util.docutils import SphinxDirective

# mermaid computes with colours, so it is given real ones; the page's own take their place.
COLOURS = {
    "primaryColor": ("#e8f1fa", "var(--diagram-fill)"),
    "primaryBorderColor": ("#2f6f9f", "var(--diagram-border)"),
    "primaryTextColor": ("#12212e", "var(--diagram-text)"),
    "lineColor": ("#7a8794", "var(--diagram-line)"),
    "edgeLabelBackground": ("#fefefe", "var(--diagram-background)"),
}
FONT = {"fontFamily": "Helvetica, Arial, sans-serif", "fontSize": "15px"}
CONFIG = {
    "theme": "base",
    "themeVariables": FONT | {name: fixed for name, (fixed, _) in COLOURS.items()},
    "flowchart": {"wrappingWidth": 420, "rankSpacing": 28, "padding": 10},
}


def draw(source: str) -> str:
    """The diagram as an SVG element whose ids are unlike those of any other diagram."""
    svg = str(mermaidx.render(source, config=CONFIG).svg())
    name = "diagram-" + hashlib.sha256(source.encode()).hexdigest()[:8]
    svg = svg.replace("my-svg", name).replace('role="graphics-document document"', "")
    for fixed, variable in COLOURS.values():
        svg = svg.replace(fixed, variable)
    return svg


class MermaidDirective(SphinxDirective):
    """Draw the content; ``:alt:``, which must be given, says what it shows."""

    has_content = True
    option_spec: ClassVar = {"alt": directives.unchanged_required}

    def run(self) -> list[nodes.Node]:
        """The figure, for HTML."""
        if "alt" not in self.options:
            raise self.error("a diagram needs :alt:, its content in words")
        try:
            svg = draw("\n".join(self.content))
        except Exception as error:  # whatever the drawing engine raises, the place is what helps
            raise self.error(f"mermaid cannot draw this: {error}") from error
        label = html.escape(self.options["alt"])
        figure = f'<figure class="diagram" role="img" aria-label="{label}">{svg}</figure>'
        return [nodes.raw("", figure, format="html")]
