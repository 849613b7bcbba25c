"""Formulas, drawn while the book is built: a page shows them at once and loads no program for it.

MathJax runs in QuickJS beside Python. Each formula becomes a drawing in the text's own colour, and
MathML that is read aloud; the shapes of the letters stand once at the end of the page.
"""

from __future__ import annotations

import html
import json
import re
from functools import cache
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import quickjs
from sphinx.application import Sphinx
from sphinx.util import logging

DRIVER = Path(__file__).with_suffix(".js").read_text("utf-8")
BROUGHT = "sphinx-mathjax-offline"
MATHJAX = Path(str(distribution(BROUGHT).locate_file(f"{BROUGHT}/static/mathjax")))
PARTS = ("startup", "core", "adaptors/liteDOM", "input/tex-full")
PARTS += ("output/svg", "output/svg/fonts/tex", "a11y/assistive-mml")
SETTINGS = (
    "var window = globalThis; var MathJax = { loader: { load: [] }, startup: { typeset: false } };"
)
# As Sphinx writes a formula for MathJax: its source in an element of its own. In a line, brackets
# and marks that touch a formula stay with it.
INLINE = re.compile(
    r'([(\[“‘]*)(<span class="[^"]*\bmath [^>]*>)\\\(([^<]*)\\\)</span>([^\s<>&]{0,3})'
)
BLOCK = re.compile(r'(<div class="[^"]*\bmath [^>]*>)\s*\\\[([^<]*)\\\]\s*</div>')
TAG = re.compile(r"\s*\\tag\{([^}]*)\}")  # the number, which stays in view where a formula scrolls
FORMULA = re.compile(r'<(?:span|div) class="[^"]*\bmath ')
USED = re.compile(r'<use[^>]*? href="#(g-[^"]+)"')
SHAPES = '<svg class="shapes" aria-hidden="true"><defs>{}</defs></svg>'

log = logging.getLogger(__name__)


class FormulaError(Exception):
    """A formula that cannot be drawn; the message is MathJax's."""


class Pen:
    """Draws formulas, each once."""

    def __init__(self) -> None:
        self._engine = quickjs.Context()
        parts = ((MATHJAX / f"{name}.js").read_text("utf-8") for name in PARTS)
        for code in (SETTINGS, *parts, DRIVER):
            self._engine.eval(f"{code};\n0")
        self._drawings: dict[tuple[str, bool], str] = {}
        self.shapes: dict[str, str] = {}

    def draw(self, tex: str, *, display: bool) -> str:
        """The drawing and the MathML of a formula, as HTML."""
        key = tex, display
        if key not in self._drawings:
            call = f"draw({json.dumps(tex)}, {json.dumps(display)})"
            drawing = json.loads(str(self._engine.eval(call)))
            if "error" in drawing:
                raise FormulaError(drawing["error"])
            self.shapes |= drawing["shapes"]
            svg = re.sub(r"></(use|path|rect|line)>", "/>", drawing["svg"])
            mathml = re.sub(r' (xmlns|data-mjx-\w+)="[^"]*"', "", drawing["mathml"])
            self._drawings[key] = f'{svg}<span class="read-aloud">{mathml}</span>'
        return self._drawings[key]


@cache
def pen() -> Pen:
    """The pen of this build."""
    return Pen()


def draw_formulas(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object
) -> None:
    """Put drawings in the place of the formulas' sources."""
    if body := context.get("body"):
        context["body"] = draw_all(body, page, pen())


def draw_all(body: str, page: str, with_pen: Pen) -> str:
    """The body of a page with its formulas drawn; one that cannot be is a warning."""

    def draw(start: str, source: str, *, display: bool) -> str:
        tex = html.unescape(source).strip()
        number = "".join(f'<span class="eqno">({tag})</span>' for tag in TAG.findall(tex))
        try:
            drawing = number + with_pen.draw(TAG.sub("", tex), display=display)
        except FormulaError as error:
            log.warning("%s in the formula %s", error, tex, location=page)
            drawing = source
        tex_in_html = html.escape(" ".join(tex.split()))
        return start.replace(">", f' data-tex="{tex_in_html}">', 1) + drawing

    def draw_in_line(match: re.Match[str]) -> str:
        brackets, start, source, marks = match.groups()
        drawing = f"{brackets}{draw(start, source, display=False)}</span>{marks}"
        return f'<span class="unbroken">{drawing}</span>' if brackets or marks else drawing

    def draw_block(match: re.Match[str]) -> str:
        return f"{draw(*match.groups(), display=True)}</div>"

    count = len(FORMULA.findall(body))
    body, inline = INLINE.subn(draw_in_line, body)
    body, blocks = BLOCK.subn(draw_block, body)
    if inline + blocks != count:
        raise AssertionError(f"{page}: {count} formulas, {inline + blocks} found")
    used = sorted(set(USED.findall(body)))
    shapes = "".join(f'<path id="{name}" d="{with_pen.shapes[name]}"/>' for name in used)
    return body + SHAPES.format(shapes) if used else body
