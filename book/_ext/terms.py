"""Links from words: terms to their meaning in the glossary, sections of chapters to their place."""

from __future__ import annotations

import re
from pathlib import Path

from docutils import nodes
from for_lab import meanings
from sphinx.application import Sphinx
from sphinx.util import logging

log = logging.getLogger(__name__)
CLASSES = {  # the colour of a term, by a part of its name
    "gate": "gate",
    "overlap": "overlap",
    "trim": "overlap",
    "huber": "delta",
    "source": "source",
    "target": "target",
}


def explain_terms(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Give each link to a term of the glossary the first sentence on it as the link's title."""
    links = [link for link in doctree.findall(nodes.reference) if _is_term(link)]
    if links:
        meaning_of = {
            re.sub(r"[^a-z0-9]+", "-", term).strip("-"): meaning
            for term, meaning in meanings(Path(app.srcdir, "book")).items()
        }
        for link in links:
            target = link.get("refid") or link["refuri"].partition("#")[2]
            link["reftitle"] = meaning_of[target.removeprefix("term-").lower()]
            colors = [color for part, color in CLASSES.items() if part in target.lower()]
            link["classes"] += [f"w-{color}" for color in colors[:1]]


def link_chapters(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Lead from a line such as *3 points; see chapter 1, “Rotation”* to that section."""
    for line in doctree.findall(nodes.emphasis):
        mention = re.search(r"(.*)(chapter (\d+))(, “(.+)”.*)", line.astext())
        if mention:
            beginning, name, number, end_of_line, title = mention.groups()
            (chapter,) = (page for page in app.env.tocs if _is_chapter(page, number))
            sections = app.env.tocs[chapter].findall(nodes.reference)
            anchors = [section["anchorname"] for section in sections if section.astext() == title]
            if not anchors:
                log.warning("%s has no section %r", chapter, title, location=page)
            address = app.builder.get_relative_uri(page, chapter) + "".join(anchors[:1])
            link = nodes.reference("", name, internal=True, refuri=address)
            line[:] = [nodes.Text(beginning), link, nodes.Text(end_of_line)]


def _is_chapter(page: str, number: str) -> bool:
    return page.startswith(f"notebooks/{number:0>2}_")


def _is_term(link: nodes.reference) -> bool:
    return any("std-term" in span["classes"] for span in link.findall(nodes.inline))
