"""Search a folder for traces of texts that must not be in it.

A text leaks where seven of its words in a row, or a shorter line of it, stand in a file,
whatever markup is between them, unless the same words stand in what is handed out on
purpose. Numbers alone are no trace: the values of a slider read like any list of numbers.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

SHORTEST, WINDOW = 4, 7  # words in a row: of a short line, and of anything else
_WORD = re.compile(r"[^\W_]+")
_LETTER = re.compile(r"[^\W\d_]")
_MARKUP = re.compile(r"<[^<>]*>")
_DRAWN = re.compile(
    r' data-tex="([^"]*)">(?:(?! data-tex=).)*?<span class="read-aloud">.*?</span>', re.DOTALL
)
_ESCAPES = re.compile(r"\\[ntr]|\\u003[ce]")
_UNREAD = {".png", ".webp", ".svg", ".pdf", ".woff", ".woff2", ".ttf", ".gz", ".zip"}


def only_secret(secret: Iterable[str], public: Iterable[str]) -> frozenset[str]:
    """Runs of words of the `secret` texts that no text handed out on purpose has.

    Examples
    --------
    >>> runs = only_secret(["so t is q minus R p and nothing else"], ["nothing else"])
    >>> sorted(runs)[0]
    'is q minus r p and nothing'
    """
    runs: set[str] = set()
    for solution in secret:
        runs.update(_runs(_split(solution), WINDOW))
        for line in solution.split("\n"):
            runs.update(_short_line(line))
    with_letters = (run for run in runs if _LETTER.search(run))
    return frozenset(with_letters).difference(*map(_all_runs, public))


def find_leaks(folder: Path, runs: frozenset[str]) -> list[str]:
    """The first trace in each file of text below a folder: its name, and the words."""
    leaks = []
    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
        if file.suffix not in _UNREAD:
            readings = _readings(file.read_text("utf-8", errors="replace"))
            traces = set().union(*(runs.intersection(_all_runs(reading)) for reading in readings))
            if traces:
                leaks.append(f"{file.relative_to(folder)}: {min(traces)!r}")
    return leaks


def _split(passage: str) -> list[str]:
    return [word.lower() for word in _WORD.findall(passage)]


def _runs(sequence: list[str], size: int) -> Iterator[str]:
    return map(" ".join, zip(*(sequence[start:] for start in range(size)), strict=False))


def _all_runs(passage: str) -> Iterator[str]:
    sequence = _split(passage)
    return chain.from_iterable(_runs(sequence, size) for size in range(SHORTEST, WINDOW + 1))


def _short_line(line: str) -> Iterator[str]:
    """The whole of a line that is too short for a window."""
    sequence = _split(line)
    if SHORTEST <= len(sequence) < WINDOW:
        yield " ".join(sequence)


def _readings(source: str) -> Iterator[str]:
    """A source as it stands, without the escapes of JSON, and either without markup."""
    for reading in dict.fromkeys((source, _ESCAPES.sub(" ", source))):
        yield reading
        # a formula that is drawn is its source, as its author wrote it
        yield html.unescape(_MARKUP.sub(" ", _DRAWN.sub(r">\1 ", reading)))
