"""Links from words: terms to their meaning in the glossary, sections of chapters to their place."""

from __future__ import annotations

import re

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging

GLOSSARY = "book/glossary"
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
    """Give each link to a term of the glossary its meaning as the link's title."""
    links = [each for each in doctree.findall(nodes.reference) if _is_term(each)]
    if links:
        meanings = meanings_in(app.env)
        for link in links:
            target = link.get("refid") or link["refuri"].partition("#")[2]
            link["reftitle"] = meanings[target]
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


def meanings_in(env: BuildEnvironment) -> dict[str, str]:
    """The meaning of each term, by the id of its entry."""
    return {
        target: _plain(item)
        for item in env.get_doctree(GLOSSARY).findall(nodes.definition_list_item)
        for term in item.findall(nodes.term)
        for target in term["ids"]
    }


def _is_term(link: nodes.reference) -> bool:
    return any("std-term" in each["classes"] for each in link.findall(nodes.inline))


def _plain(item: nodes.definition_list_item) -> str:
    """The words of an entry, without the works that it cites and the chapter that it names."""
    (definition,) = (each.deepcopy() for each in item.findall(nodes.definition))
    for link in list(definition.findall(addnodes.pending_xref)):
        link.parent.remove(link)
    text = re.sub(r"\s+", " ", definition.astext())
    return re.sub(r" ?\( ?\)|(?<=\w) (?=[.,:])", "", text).strip()
