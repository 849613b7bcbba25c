"""The book's own Sphinx extension: pages that work with no network and no console error."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import Any

import api
import browser_files
import killian_map
from diagrams import MermaidDirective
from docutils import nodes
from excerpts import write_excerpts
from figures import make_figures
from folds import join_folds
from formulas import draw_formulas
from killian_map import PICTURE
from launch import settle_buttons
from lighter import ICONS, lighten
from predictions import mark_all
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.errors import ExtensionError
from terms import explain_terms, link_chapters

from labkit.plotting.style import css_variables

UNUSED = re.compile("mathjax|thebe", re.IGNORECASE)


def provide_browser_files(app: Sphinx, config: Config) -> None:
    """Fetch what the pages load, or stop the build."""
    try:
        browser_files.provide()
    except browser_files.BrowserFilesError as error:
        raise ExtensionError(str(error)) from error
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
        first = next(iter(doctree.findall(nodes.paragraph)), None)
        words = {"og:title": app.env.titles[page].astext(), "og:type": "article"}
        words["og:description"] = " ".join(first.astext().split())[:200] if first else ""
        if app.config.html_baseurl:
            words["og:image"] = f"{app.config.html_baseurl.rstrip('/')}/_static/{PICTURE.name}"
        told = [("name", "description", words["og:description"])]
        told += [("property", name, text) for name, text in words.items()]
        tags = [f'<meta {kind}="{name}" content="{escape(text)}" />' for kind, name, text in told]
        context["metatags"] = "\n".join([context.get("metatags") or "", *tags])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the steps above, the diagrams, and what the pages load."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-docstring", api.clean, priority=400)  # before napoleon
    app.connect("autodoc-process-signature", api.hide_signature)
    app.connect("config-inited", provide_browser_files)
    app.connect("config-inited", settle_buttons)
    app.connect("doctree-read", mark_all)
    app.connect("doctree-read", make_figures)
    app.connect("doctree-read", join_folds)
    app.connect("doctree-resolved", explain_terms)
    app.connect("doctree-resolved", link_chapters)
    app.connect("doctree-resolved", api.link_names)
    app.connect("html-page-context", draw_formulas, priority=900)
    app.connect("html-page-context", drop_unused, priority=900)
    app.connect("build-finished", write_colors)
    app.connect("build-finished", write_excerpts)
    app.connect("build-finished", lighten)
    app.connect("html-page-context", describe)
    app.add_directive("mermaid", MermaidDirective)
    app.add_css_file("colors.css")
    app.add_css_file("labbook.css")
    app.add_css_file(ICONS)
    app.add_js_file("formulas.js")
    app.add_js_file("access.js")
    app.add_js_file("map.js")
    app.add_js_file("search.js")
    app.add_js_file("predictions.js")
    return {"parallel_read_safe": True, "parallel_write_safe": True}
