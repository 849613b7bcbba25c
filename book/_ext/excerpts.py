"""What the search looks in: the sections of all pages, terms, exercises, and messages of errors.

They stand in one script, which only the search loads (`search.js`), so that it finds the same
where the book is a folder: there no page may read another. Its index is lunr's, a library that
comes with mkdocs.
"""

from __future__ import annotations

import json
import re
import shutil
import unicodedata
from collections.abc import Iterator
from importlib.metadata import distribution
from pathlib import Path

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

FILE = "excerpts.js"
LUNR = Path(
    str(distribution("mkdocs").locate_file("mkdocs/contrib/search/templates/search/lunr.js"))
)
MESSAGES = "what you see"  # the head of a table whose rows begin with a message
UNREAD = (nodes.comment, nodes.raw, nodes.target, nodes.substitution_definition)
UNREAD += (nodes.literal_block, nodes.math_block)
Entry = tuple[str, str, str, str, str]  # anchor, kind, title, text, page that explains the term


def write_excerpts(app: Sphinx, error: Exception | None) -> None:
    """Write the script when the pages are built, and the library that searches it.

    A row has the page, its title, the parts of an `Entry`, and the names of Greek letters.
    """
    if error is None and app.builder.name == "html":
        rows = []
        for page in sorted(app.env.found_docs):
            tree = app.env.get_doctree(page)
            title = app.env.titles[page].astext() if page in app.env.titles else page
            rows += [[page, title, *entry, greek(" ".join(entry[:4]))] for entry in entries(tree)]
        table = json.dumps(rows, ensure_ascii=False, separators=(",", ":"))
        Path(app.outdir, FILE).write_text(f"window.labbookExcerpts = {table};\n", "utf-8")
        shutil.copy(str(LUNR), Path(app.outdir, "_static"))


def entries(tree: nodes.Element) -> Iterator[Entry]:
    """The sections of a page, the terms and messages that it explains, and its exercises.

    Examples
    --------
    >>> scans = nodes.section("", nodes.title("", "Scans"), nodes.paragraph("", "Many."), ids=["s"])
    >>> list(entries(scans))
    [('s', 'section', 'Scans', 'Many.', '')]
    """
    for node in tree.findall(_is_entry):
        if isinstance(node, nodes.row):
            yield _section_of(node)["ids"][-1], "message", node[0].astext(), node[1].astext(), ""
            continue
        target = next(iter(node.findall(nodes.term)), node)
        ids = target["ids"] or node["ids"] or [""]
        title = _text(node[0]).strip() if len(node) else ""
        if isinstance(node, nodes.Admonition):
            title = title.removeprefix("Exercise").strip() or "Exercise"
        passage = " ".join(" ".join(map(_text, node.children[1:])).split())
        kind = _kind_of(node)
        chapter = _chapter_of(node) if kind == "term" else ""
        yield ids[-1], kind, title, re.sub(r" (?=[.,;)])", "", passage), chapter


def _is_entry(node: nodes.Node) -> bool:
    if isinstance(node, nodes.section):
        return "exercise-content" not in node["ids"]
    if isinstance(node, nodes.definition_list_item):
        return bool(node[0].get("ids"))
    if isinstance(node, nodes.row):
        head = next(iter(node.parent.parent.findall(nodes.entry)))
        return isinstance(node.parent, nodes.tbody) and head.astext() == MESSAGES
    return isinstance(node, nodes.Admonition) and "exercise" in node.get("classes", ())


def _kind_of(node: nodes.Node) -> str:
    if isinstance(node, nodes.section):
        return "section"
    return "term" if isinstance(node, nodes.definition_list_item) else "exercise"


def _chapter_of(node: nodes.Element) -> str:
    """The chapter to which an explanation leads, by its page; "" where it leads to none."""
    for link in node.findall(addnodes.pending_xref):
        if match := re.search(r"notebooks/\w+", link["reftarget"]):
            return match[0]
    return ""


def _section_of(node: nodes.Element) -> nodes.Element:
    return node if isinstance(node, nodes.section) else _section_of(node.parent)


def _text(node: nodes.Node) -> str:
    """The words of a node, without code and without what is an entry of its own."""
    if isinstance(node, nodes.Text):
        return re.sub(r"\s+", " ", node.astext())
    if isinstance(node, nodes.math):
        return symbols(node.astext())
    if isinstance(node, UNREAD) or _is_entry(node) or _is_code_or_citation(node):
        return ""
    between = "" if isinstance(node, nodes.TextElement) else " "
    return between.join(map(_text, node.children))


def _is_code_or_citation(node: nodes.Element) -> bool:
    if isinstance(node, addnodes.pending_xref):
        return node.get("refdomain") == "cite"  # its text is still the work's key
    if isinstance(node, nodes.paragraph) and len(node) == 1:
        return isinstance(node[0], nodes.literal)  # the file that is listed below
    return {"cell_output", "literal-block-wrapper"} & set(node.get("classes", ())) != set()


def symbols(tex: str) -> str:
    r"""A short formula in letters; of others the search shows nothing.

    Examples
    --------
    >>> symbols(r"\delta = 0.2"), symbols(r"d_{\max}"), symbols(r"\frac{a}{b}")
    ('δ = 0.2', 'd_max', '…')
    """
    formula = re.sub(r"\\([a-z]+)", lambda name: _greek(name[1]), tex)
    formula = re.sub(r"[{}]|\\,", "", formula)
    return "…" if "\\" in formula else formula


def greek(passage: str) -> str:
    """Names of the Greek letters in a passage, by which a keyboard without them asks.

    Examples
    --------
    >>> greek("Huber's δ and ρ, δ = 0.1")
    'delta rho'
    """
    letters = sorted(set(re.findall("[α-ω]", passage)))
    names = [unicodedata.name(letter) for letter in letters]  # GREEK SMALL LETTER DELTA
    return " ".join(name.rpartition(" ")[2].lower() for name in names)


def _greek(name: str) -> str:
    if name in {"max", "min"}:
        return name
    try:
        return unicodedata.lookup(f"GREEK SMALL LETTER {name}")
    except KeyError:
        return f"\\{name}"
