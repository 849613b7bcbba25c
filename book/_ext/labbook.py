"""The book's own Sphinx extension: pages that work with no network and no console error."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import Any

import api
import for_lab
import killian_map
from docutils import nodes
from excerpts import write_excerpts
from execution import start_notebooks
from figures import make_figures
from folds import tidy_cells
from formulas import draw_formulas
from killian_map import PICTURE
from launch import settle_buttons, settle_footer
from lighter import ICONS, lighten
from predictions import mark_all
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from stills import keep_stills
from terms import explain_terms, link_chapters

from labkit.plotting.style import css_variables
from labkit.support.warm import warm

MAP_PAGE = "book/intro"
UNUSED = re.compile("mathjax|thebe", re.IGNORECASE)


def compile_stages(*_: object) -> None:
    """Compile what is new before a notebook runs, which would show the line that says so."""
    warm()


def provide_map(app: Sphinx, env: BuildEnvironment, pages: list[str]) -> None:
    """Write what the map on the first page shows, where that page is built."""
    if MAP_PAGE in pages:
        killian_map.provide()


def write_colors(app: Sphinx, error: Exception | None) -> None:
    """Write labkit's colours as variables, and the classes of the words that wear them."""
    if error is None and app.builder.name == "html":
        Path(app.outdir, "_static", "colors.css").write_text(css_variables(), "utf-8")


def drop_unused(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object
) -> None:
    """Drop from a page what draws formulas, which are drawn already, and what runs code there."""
    for kind in ("script_files", "css_files"):
        context[kind] = [each for each in context[kind] if not UNUSED.search(str(each))]


def describe(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None
) -> None:
    """Tell what a page is about to those who list or share it: its title and first paragraph."""
    if doctree is not None:
        paragraph = next(iter(doctree.findall(nodes.paragraph)), None)
        description = " ".join(paragraph.astext().split())[:200] if paragraph else ""
        properties = {
            "og:title": app.env.titles[page].astext(),
            "og:type": "article",
            "og:description": description,
        }
        if app.config.html_baseurl:
            site = app.config.html_baseurl.rstrip("/")
            properties["og:image"] = f"{site}/_static/{PICTURE.name}"
        tags = [f'<meta name="description" content="{escape(description)}" />']
        for name, content in properties.items():
            tags.append(f'<meta property="{name}" content="{escape(content)}" />')
        context["metatags"] = "\n".join([context.get("metatags") or "", *tags])


STEPS = {
    "config-inited": (compile_stages, settle_buttons, settle_footer),
    "env-before-read-docs": (start_notebooks, provide_map),
    "source-read": (for_lab.restore,),
    "autodoc-process-signature": (api.hide_signature,),
    "doctree-read": (keep_stills, mark_all, make_figures, tidy_cells),
    "doctree-resolved": (explain_terms, link_chapters, api.link_names),
    "html-page-context": (draw_formulas, drop_unused, describe),
    "build-finished": (write_colors, write_excerpts, lighten),
}


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the steps and what the pages load."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-docstring", api.clean, priority=400)  # before napoleon
    for event, steps in STEPS.items():
        for step in steps:
            app.connect(event, step, priority=900 if event == "html-page-context" else 500)
    for sheet in ("colors.css", "labbook.css", ICONS):
        app.add_css_file(sheet)
    for script in ("formulas", "access", "map", "search", "predictions"):
        app.add_js_file(f"{script}.js")
    return {"parallel_read_safe": True, "parallel_write_safe": True}
