"""The API page: docstrings by Sphinx's autodoc, and links to them from the chapters' words."""

from __future__ import annotations

import re
from enum import EnumType

from docutils import nodes
from sphinx.application import Sphinx

PAGE = "book/api"


def clean(  # noqa: PLR0917 (as autodoc calls it)
    app: Sphinx, kind: str, name: str, value: object, options: object, lines: list[str]
) -> None:
    """Drop the text of modules, for which the page has words; keep |Δψ|, [1] and (A) as such."""
    if kind == "module":
        lines.clear()
    if kind == "property":
        lines[:0] = ["..", ""]  # or napoleon takes what stands before a colon for a type
    for number, line in enumerate(lines):
        if ">>>" not in line and "``" not in line:
            lines[number] = re.sub(r"(?:\.\. )?(\[\d\])_?", r"\1", line).replace("|", r"\|")
        lines[number] = re.sub(r"^(?=\([A-I]\) )", r"\\", lines[number])  # a stage, not a list


def hide_signature(  # noqa: PLR0917 (as autodoc calls it)
    app: Sphinx, kind: str, name: str, value: object, options: object, arguments: str, result: str
) -> tuple[str, str] | None:
    """Show an enumeration without the arguments by which Python makes one."""
    return ("", "") if isinstance(value, EnumType) else None


def link_names(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Lead from the first mention of a function or class in a chapter to its docstring."""
    if not page.startswith("notebooks/"):
        return
    api = {
        short: (full, entry)
        for full, entry in app.env.get_domain("py").objects.items()
        if entry.docname == PAGE and entry.objtype in ("function", "class", "exception")
        for short in (full, full.rpartition(".")[2])
    }
    for literal in list(doctree.findall(nodes.literal)):
        name = literal.astext().removesuffix("()")
        if name in api and isinstance(literal.parent, nodes.paragraph):
            full, entry = api.pop(name)
            address = f"{app.builder.get_relative_uri(page, PAGE)}#{entry.node_id}"
            link = nodes.reference("", "", internal=True, refuri=address, reftitle=full)
            literal.parent.replace(literal, link)
            link += literal
