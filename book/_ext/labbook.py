"""The book's own Sphinx extension: pages that work with no network and no console error."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import browser_files
from diagrams import MermaidDirective
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.errors import ExtensionError

HERE = Path(__file__).parent
VENDOR = HERE.parent / "_static" / "vendor"

ADVICE = """\
The book carries the browser files that it needs (book/_ext/browser_files.toml), and the first
build fetches them. Connect to the network and run the same command again; later builds need
no network. Behind a proxy or a mirror: npm and pip follow their own configuration files."""


def provide_browser_files(app: Sphinx, config: Config) -> None:
    """Fetch what the pages load, or stop the build."""
    try:
        browser_files.provide(VENDOR)
    except browser_files.BrowserFilesError as error:
        raise ExtensionError(f"{error}\n\n{ADVICE}") from error


def declare_thebe_once(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object
) -> None:
    """Drop the second copy of a script body that two extensions both put on the page."""
    kept, seen = [], False
    for file in context.get("script_files", []):
        is_thebe = "THEBE_JS_URL" in (getattr(file, "attributes", {}).get("body") or "")
        if not (is_thebe and seen):
            kept.append(file)
        seen = seen or is_thebe
    context["script_files"] = kept


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the two steps above, the diagrams, and what the pages load."""
    app.connect("config-inited", provide_browser_files)
    app.connect("html-page-context", declare_thebe_once, priority=900)
    app.add_directive("mermaid", MermaidDirective)
    app.add_css_file("labbook.css")
    app.add_js_file("mathjax-hub.js", priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
