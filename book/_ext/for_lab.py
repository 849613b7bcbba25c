"""Notebooks whose text any program draws: there is no MyST, no glossary, and no list of works.

A term becomes a word that tells its meaning under the mouse, a citation becomes "[Huber, 1964]",
a link names its file, and boxes become plain Markdown. What a cell said before stays in its
metadata: `restore` gives it back to the book, which does all this better.
"""

from __future__ import annotations

import hashlib
import html
import itertools
import json
import re
from collections.abc import Mapping
from pathlib import Path

import nbformat
from excerpts import symbols
from plain_markdown import plain
from pybtex.database import parse_file
from pybtex.richtext import Text
from sphinx.application import Sphinx

KEY = "labbook"
CELL_BY_CELL = (
    "\n\n*Go cell by cell, with Shift+Enter: Run All answers the questions before you do.*"
)
TERM = re.compile(r"\{term\}`([^`<]+?)(?:\s*<([^`>]+)>)?`")
CITATION = re.compile(r"\{cite:([pt])\}`([^`]+)`")
LINK = re.compile(r"(?<=\]\()(?!\w+:)([^)#\s]*)(#[^)\s]+)?(?=\))")
LABEL = re.compile(r"(?m)^(?:\(|:label: )([\w-]+)(?:\)=)?$")
ENTRY = re.compile(r"(?m)^(\S.*)\n((?:  .*\n|\n(?=  ))+)")


def resolve(notebook: nbformat.NotebookNode, path: Path, lookup: Mapping[str, str]) -> None:
    """Write what the book alone resolves as any program can draw it, in place.

    Links start in the folder of `path`, whose name begins with the number of the chapter.
    `lookup`, which `read_lookup` makes, tells what to write for a term or a work, and in which
    file a label is.
    """
    own_labels = {label for cell in notebook.cells for label in LABEL.findall(cell.source)}
    chapter = path.stem.partition("_")[0].lstrip("0")
    exercises = (f"{chapter}.{number}" for number in itertools.count(1))
    asks = any(":class: predict" in cell.source for cell in notebook.cells)

    def term(match: re.Match[str]) -> str:
        word, entry = match.groups()
        return _with_meaning(word, lookup[(entry or word).lower()])

    def citation(match: re.Match[str]) -> str:
        kind, keys = match.groups()
        return _citation(kind, keys.split(","), lookup)

    def address(match: re.Match[str]) -> str:
        target, anchor = match.groups(default="")
        return _address(target, anchor, own_labels, path.parent, lookup)

    for number, cell in enumerate(notebook.cells):
        if cell.cell_type == "markdown":
            original = cell.source
            resolved = LINK.sub(address, CITATION.sub(citation, TERM.sub(term, original)))
            cell.source = plain(resolved, exercises)
            if asks and number == 0:
                cell.source += CELL_BY_CELL
            if cell.source != original:
                cell.metadata[KEY] = {"written": original, "mark": _mark(cell.source)}


def restore(app: Sphinx, page: str, source: list[str]) -> None:
    """Give the book what its author wrote in each cell that nobody has changed since."""
    if not source[0].startswith("{"):
        return
    notebook = json.loads(source[0])
    for cell in notebook["cells"]:
        original = cell["metadata"].pop(KEY, None)
        if original and original["mark"] == _mark("".join(cell["source"])):
            cell["source"] = original["written"]
    source[0] = json.dumps(notebook)


def meanings(book: Path) -> dict[str, str]:
    """The first sentence of the glossary on each of its terms."""
    glossary = (book / "glossary.md").read_text("utf-8").partition(":::{glossary}\n")[2]
    return {
        term.lower(): _first_sentence(_without_markup(explanation))
        for term, explanation in ENTRY.findall(glossary)
    }


def read_lookup(root: Path) -> dict[str, str]:
    """Meanings of terms, author, year and title of works, and notebooks of labels, by key."""
    book = root / "book"
    lookup = meanings(book)
    for key, work in parse_file(book / "references.bib").entries.items():
        names = [" ".join(map(str, author.rich_last_names)) for author in work.persons["author"]]
        authors = f"{names[0]} et al." if len(names) > 2 else " and ".join(names)
        lookup[key] = f"{authors}, {work.fields['year']}|{Text.from_latex(work.fields['title'])}"
    for path in (root / "notebooks").glob("*.ipynb"):
        for cell in nbformat.read(path, as_version=4).cells:
            lookup |= {f"#{label}": path.name for label in LABEL.findall(cell.source)}
    for path in book.glob("*.md"):
        labels = LABEL.findall(path.read_text("utf-8"))
        lookup |= {f"#{label}": f"../book/{path.name}" for label in labels}
    return lookup


def _with_meaning(word: str, meaning: str) -> str:
    return f'<abbr title="{html.escape(meaning)}">{word}</abbr>'


def _citation(kind: str, keys: list[str], lookup: Mapping[str, str]) -> str:
    works = [lookup[key.strip()].split("|") for key in keys]
    if kind == "p":
        return "\\[" + ", ".join(_with_meaning(*work) for work in works) + "\\]"
    parts = [(*name.rsplit(", ", 1), title) for name, title in works]
    return ", ".join(f"{_with_meaning(name, title)} \\[{year}\\]" for name, year, title in parts)


def _address(
    target: str, anchor: str, own_labels: set[str], folder: Path, lookup: Mapping[str, str]
) -> str:
    """Where a link leads, with the ending of its file; an anchor works in its own notebook."""
    if not target:
        return anchor if anchor[1:] in own_labels else lookup[anchor]
    files = [f"{target}{ending}" for ending in ("", ".ipynb", ".md")]
    return next(file for file in files if (folder / file).is_file())


def _without_markup(passage: str) -> str:
    """A passage without markup, works and chapters."""
    passage = re.sub(r"\$([^$]*)\$", lambda tex: symbols(tex[1]), CITATION.sub("", passage))
    passage = re.sub(r"\s*\(\[chapter [^()]*\([^()]*\)\)|[`*]", "", passage)
    passage = re.sub(r"\{\w+\}|\[([^\]]*)\]\([^()]*\)", r"\1", passage)
    return re.sub(r" (?=[.,])", "", " ".join(passage.split()))


def _first_sentence(passage: str) -> str:
    """The first sentence: what is shown under the mouse stands on one line."""
    return re.split(r"(?<=\.) (?=[A-Z])|; ", passage)[0]


def _mark(source: str) -> str:
    return hashlib.sha256(source.encode()).hexdigest()[:16]
