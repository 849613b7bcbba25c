"""Search a folder for traces of texts that must not be in it.

A text leaks where seven of its words in a row, or a shorter line of it, stand in a file,
whatever markup is between them, unless the same words stand in what is handed out on
purpose. Looked into are pages, sources and scripts; notebooks and other JSON; and
whatever lies packed inside a file, by base64, zip, gzip or zlib. The search index holds
single words, so there a text leaks where three words that only it has belong to one page.
"""

from __future__ import annotations

import base64
import binascii
import gzip
import html
import io
import json
import re
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from sphinx.search.en import SearchEnglish

SHORTEST, WINDOW = 4, 7  # words in a row: of a short line, and of anything else
NESTED = 4  # how many packings inside one another are opened
_WORD = re.compile(r"[^\W_]+")
WORDS_OF_A_PAGE = 3  # that stand in no public text: what makes a leak of the search index
_INDEXED = re.compile(r"\w{3,}")
_BASE64 = re.compile(rb"[A-Za-z0-9+/]{60,}={0,2}")
_INDEX = re.compile(rb"Search\.setIndex\((.*)\)\s*$", re.DOTALL)
_MARKUP = re.compile(r"<[^<>]*>")
_DRAWN = re.compile(
    r' data-tex="([^"]*)">(?:(?! data-tex=).)*?<span class="read-aloud">.*?</span>', re.DOTALL
)
_ESCAPES = re.compile(r"\\[ntr]|\\u003[ce]")
_PICTURES = (b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"wOF")


@dataclass(frozen=True, kw_only=True)
class Leak:
    """One trace: the file, and the words that should not be in it."""

    file: Path
    words: str

    def __str__(self) -> str:
        return f"{self.file}: {self.words!r}"


@dataclass(frozen=True, kw_only=True)
class Secrets:
    """What to search for.

    Attributes
    ----------
    windows : frozenset of str
        Runs of words that stand in secret texts only.
    stems : frozenset of str
        Words, as the search index writes them, that stand in secret texts only.
    """

    windows: frozenset[str]
    stems: frozenset[str]

    @classmethod
    def of(cls, secret: Iterable[str], public: Iterable[str]) -> Secrets:
        """What tells the `secret` texts from those that are handed out on purpose.

        Examples
        --------
        >>> secrets = Secrets.of(["so t is q minus R p and nothing else"], ["nothing else"])
        >>> sorted(secrets.windows)[0]
        'is q minus r p and nothing'
        """
        hidden, shown = list(secret), list(public)
        lines = [line for text in hidden for line in text.split("\n")]
        stem = SearchEnglish({}).stem
        return cls(
            windows=frozenset(
                {each for text in hidden for each in _windows(_words(text), WINDOW)}
                | {each for line in lines for each in _short(line)}
            ).difference(*map(_all_windows, shown)),
            stems=frozenset(map(stem, _vocabulary(hidden))).difference(
                map(stem, _vocabulary(shown))
            ),
        )


def find_leaks(folder: Path, secrets: Secrets) -> list[Leak]:
    """Every trace of the secrets in the files below a folder, at most one a file and kind."""
    leaks = []
    for file in sorted(each for each in folder.rglob("*") if each.is_file()):
        for words in _traces(file.read_bytes(), secrets):
            leaks.append(Leak(file=file.relative_to(folder), words=words))
    return leaks


def _traces(content: bytes, secrets: Secrets) -> Iterator[str]:
    for part in _unpacked(content, NESTED):
        for text in _readings(part):
            found = secrets.windows.intersection(_all_windows(text))
            if found:
                yield min(found)
                break
    if index := _INDEX.search(content):
        for page, found in _indexed(json.loads(index[1]), secrets.stems).items():
            if len(found) >= WORDS_OF_A_PAGE:
                yield f"{page}, in the search index: {', '.join(sorted(found)[:5])}"


def _words(text: str) -> list[str]:
    return [word.lower() for word in _WORD.findall(text)]


def _windows(words: list[str], size: int) -> Iterator[str]:
    """Every run of so many words."""
    return map(" ".join, zip(*(words[first:] for first in range(size)), strict=False))


def _vocabulary(texts: list[str]) -> set[str]:
    """The words that the search index would list one by one."""
    return {word.lower() for text in texts for word in _INDEXED.findall(text)}


def _all_windows(text: str) -> Iterator[str]:
    words = _words(text)
    return chain.from_iterable(_windows(words, size) for size in range(SHORTEST, WINDOW + 1))


def _short(line: str) -> Iterator[str]:
    """The whole of a line that is too short for a window."""
    words = _words(line)
    if SHORTEST <= len(words) < WINDOW:
        yield " ".join(words)


def _readings(content: bytes) -> Iterator[str]:
    """A file's text as it stands, without markup, and without the escapes of JSON."""
    if content.startswith(_PICTURES):
        return
    text = content.decode("utf-8", errors="replace")
    yield text
    if "<" in text or "&" in text:
        yield _unmarked(text)
    if "\\" in text:
        plain = _ESCAPES.sub(" ", text)
        yield plain
        yield _unmarked(plain)


def _unmarked(text: str) -> str:
    """A text without its markup; a formula that is drawn is its source, as its author wrote it."""
    return html.unescape(_MARKUP.sub(" ", _DRAWN.sub(r">\1 ", text)))


def _unpacked(content: bytes, depth: int) -> Iterator[bytes]:
    """The content, and whatever is packed in it."""
    yield content
    if depth == 0 or content.startswith(_PICTURES):
        return
    for match in _BASE64.finditer(content):
        try:
            yield from _unpacked(base64.b64decode(match[0], validate=True), depth - 1)
        except binascii.Error:
            continue
    if content.startswith(b"PK\x03\x04"):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for name in archive.namelist():
                yield from _unpacked(archive.read(name), depth - 1)
    elif content.startswith(b"\x1f\x8b"):
        yield from _unpacked(gzip.decompress(content), depth - 1)
    elif content.startswith(b"# Sphinx inventory"):
        yield zlib.decompress(content.split(b"\n", 4)[4])


def _indexed(index: dict[str, Any], stems: frozenset[str]) -> dict[str, set[str]]:
    """Which of the stems Sphinx's search index has for each page."""
    found: dict[str, set[str]] = defaultdict(set)
    for table in (index.get("terms", {}), index.get("titleterms", {})):
        for stem in stems.intersection(table):
            pages = table[stem] if isinstance(table[stem], list) else [table[stem]]
            for page in pages:
                found[index["docnames"][page]].add(stem)
    return found
