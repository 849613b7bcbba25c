"""Links from words: terms to their meaning in the glossary, sections of chapters to their place."""

from __future__ import annotations

import re
from pathlib import Path

from docutils import nodes
from for_lab import meanings
from sphinx.application import Sphinx
from sphinx.util import logging

log = logging.getLogger(__name__)
WORN = {
    "gate": "gate",
    "overlap": "overlap",
    "trim": "overlap",
    "huber": "delta",
    "source": "source",
    "target": "target",
}


def explain_terms(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Give each link to a term of the glossary the first sentence on it as the link's title."""
    links = [each for each in doctree.findall(nodes.reference) if _is_term(each)]
    if links:
        told = meanings(Path(app.srcdir, "book"))
        meaning_of = {
            re.sub(r"[^a-z0-9]+", "-", term).strip("-"): said for term, said in told.items()
        }
        for link in links:
            target = link.get("refid") or link["refuri"].partition("#")[2]
            link["reftitle"] = meaning_of[target.removeprefix("term-").lower()]
            link["classes"] += [f"w-{WORN[each]}" for each in WORN if each in target.lower()][:1]


def link_chapters(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Lead from a line such as *3 points; see chapter 1, “Rotation”* to that section."""
    for line in doctree.findall(nodes.emphasis):
        named = re.search(r"(.*)(chapter (\d+))(, “(.+)”.*)", line.astext())
        if named:
            before, words, number, after, title = named.groups()
            (chapter,) = (k for k in app.env.tocs if k.startswith(f"notebooks/{number:0>2}_"))
            links = app.env.tocs[chapter].findall(nodes.reference)
            anchors = [each["anchorname"] for each in links if each.astext() == title]
            if not anchors:
                log.warning("%s has no section %r", chapter, title, location=page)
            address = app.builder.get_relative_uri(page, chapter) + "".join(anchors[:1])
            link = nodes.reference("", words, internal=True, refuri=address)
            line[:] = [nodes.Text(before), link, nodes.Text(after)]


def _is_term(link: nodes.reference) -> bool:
    return any("std-term" in each["classes"] for each in link.findall(nodes.inline))
