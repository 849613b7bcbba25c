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


def resolve(notebook: nbformat.NotebookNode, path: Path, words: Mapping[str, str]) -> None:
    """Write what the book alone resolves as any program can draw it, in place.

    Links start in the folder of `path`, whose name begins with the number of the chapter.
    `words`, which `words_of` reads, tells what to write for a term or a work, and in which file
    a label is.
    """
    own = {label for cell in notebook.cells for label in LABEL.findall(cell.source)}
    chapter = path.stem.partition("_")[0].lstrip("0")
    exercises = (f"{chapter}.{number}" for number in itertools.count(1))
    asks = any(":class: predict" in cell.source for cell in notebook.cells)
    for number, cell in enumerate(notebook.cells):
        if cell.cell_type == "markdown":
            written = cell.source
            text = TERM.sub(lambda m: _explained(m[1], words[(m[2] or m[1]).lower()]), written)
            text = CITATION.sub(lambda m: _cited(m[1], m[2].split(","), words), text)
            text = LINK.sub(lambda m: _address(m[1], m[2] or "", own, path.parent, words), text)
            cell.source = plain(text, exercises) + CELL_BY_CELL * (asks and number == 0)
            if cell.source != written:
                cell.metadata[KEY] = {"written": written, "mark": _mark(cell.source)}


def restore(app: Sphinx, page: str, source: list[str]) -> None:
    """Give the book what its author wrote in each cell that nobody has changed since."""
    if not source[0].startswith("{"):
        return
    notebook = json.loads(source[0])
    for cell in notebook["cells"]:
        kept = cell["metadata"].pop(KEY, None)
        if kept and kept["mark"] == _mark("".join(cell["source"])):
            cell["source"] = kept["written"]
    source[0] = json.dumps(notebook)


def meanings(book: Path) -> dict[str, str]:
    """The first sentence of the glossary on each of its terms."""
    glossary = (book / "glossary.md").read_text("utf-8").partition(":::{glossary}\n")[2]
    return {term.lower(): _first(_plain(said)) for term, said in ENTRY.findall(glossary)}


def words_of(root: Path) -> dict[str, str]:
    """Meanings of terms, author, year and title of works, and notebooks of labels, by key."""
    book = root / "book"
    words = meanings(book)
    for key, work in parse_file(book / "references.bib").entries.items():
        names = [" ".join(map(str, each.rich_last_names)) for each in work.persons["author"]]
        first = f"{names[0]} et al." if len(names) > 2 else " and ".join(names)
        words[key] = f"{first}, {work.fields['year']}|{Text.from_latex(work.fields['title'])}"
    for path in (root / "notebooks").glob("*.ipynb"):
        for cell in nbformat.read(path, as_version=4).cells:
            words |= {f"#{label}": path.name for label in LABEL.findall(cell.source)}
    for path in book.glob("*.md"):
        found = LABEL.findall(path.read_text("utf-8"))
        words |= {f"#{label}": f"../book/{path.name}" for label in found}
    return words


def _explained(word: str, meaning: str) -> str:
    return f'<abbr title="{html.escape(meaning)}">{word}</abbr>'


def _cited(kind: str, keys: list[str], words: Mapping[str, str]) -> str:
    works = [words[key.strip()].split("|") for key in keys]
    if kind == "p":
        return "\\[" + ", ".join(_explained(*work) for work in works) + "\\]"
    parts = [(*name.rsplit(", ", 1), title) for name, title in works]
    return ", ".join(f"{_explained(name, title)} \\[{year}\\]" for name, year, title in parts)


def _address(
    target: str, anchor: str, own: set[str], folder: Path, words: Mapping[str, str]
) -> str:
    """Where a link leads, with the ending of its file; an anchor works in its own notebook."""
    if not target:
        return anchor if anchor[1:] in own else words[anchor]
    endings = ("", ".ipynb", ".md")
    return target + next(each for each in endings if (folder / f"{target}{each}").is_file())


def _plain(text: str) -> str:
    """A text without markup, works and chapters."""
    text = re.sub(r"\$([^$]*)\$", lambda m: symbols(m[1]), CITATION.sub("", text))
    text = re.sub(r"\s*\(\[chapter [^()]*\([^()]*\)\)|[`*]", "", text)
    text = re.sub(r"\{\w+\}|\[([^\]]*)\]\([^()]*\)", r"\1", text)
    return re.sub(r" (?=[.,])", "", " ".join(text.split()))


def _first(text: str) -> str:
    """The first sentence: what is shown under the mouse stands on one line."""
    return re.split(r"(?<=\.) (?=[A-Z])|; ", text)[0]


def _mark(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
