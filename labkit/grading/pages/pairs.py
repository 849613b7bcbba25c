"""Two submissions side by side, question by question: for a person to judge."""

from __future__ import annotations

import difflib
import keyword
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import zip_longest

from labkit.grading.assignment.questions import Question
from labkit.grading.contract import SourceCell

MAX_ROWS = 300  # of one question
_NAME = re.compile(r"\b[^\W\d]\w*")


@dataclass(frozen=True, kw_only=True)
class Row:
    """A line of each, and whether they are the same but for names, layout and comments."""

    left: str
    right: str
    same: bool


@dataclass(frozen=True, kw_only=True)
class Side:
    """One question of both.

    Attributes
    ----------
    title : str
        The question; "Shared code" for what several need.
    rows : tuple of Row
        Their lines, those that are the same beside one another.
    share : float
        How many of the lines of the shorter one are the same.
    """

    title: str
    rows: tuple[Row, ...]
    share: float


def side_by_side(
    left: Iterable[SourceCell], right: Iterable[SourceCell], questions: Iterable[Question]
) -> list[Side]:
    """Both submissions by question, the most alike first.

    Parameters
    ----------
    left, right : iterable of SourceCell
        Their cells.
    questions : iterable of Question
        What was asked; the lines of their stubs are left out.
    """
    listed = list(questions)
    handed_out = {_shape(line) for one in listed for line in one.stub.splitlines()} | {""}
    ours, theirs = _by_question(left, handed_out), _by_question(right, handed_out)
    titles: list[tuple[str | None, str]] = [(one.id, one.title) for one in listed]
    sides = [
        _side(title, ours.get(question, []), theirs.get(question, []))
        for question, title in [*titles, (None, "Shared code")]
        if question in ours or question in theirs
    ]
    return sorted(sides, key=lambda side: -side.share)


def _by_question(
    cells: Iterable[SourceCell], handed_out: Collection[str]
) -> dict[str | None, list[str]]:
    """The lines of each question, and those that several share, but for what was handed out."""
    found: dict[str | None, list[str]] = {}
    for cell in cells:
        lines = [line.rstrip() for line in cell.source.splitlines()]
        own = [line for line in lines if _shape(line) not in handed_out]
        found.setdefault(cell.question, []).extend(own)
    return {question: lines[:MAX_ROWS] for question, lines in found.items()}


def _side(title: str, left: list[str], right: list[str]) -> Side:
    ours, theirs = list(map(_shape, left)), list(map(_shape, right))
    rows: list[Row] = []
    same = 0
    for kind, a, b, c, d in difflib.SequenceMatcher(
        None, ours, theirs, autojunk=False
    ).get_opcodes():
        alike = kind == "equal"
        same += (b - a) * alike
        pairs = zip_longest(left[a:b], right[c:d], fillvalue="")
        rows += [Row(left=one, right=other, same=alike) for one, other in pairs]
    return Side(title=title, rows=tuple(rows), share=same / max(1, min(len(left), len(right))))


def _shape(line: str) -> str:
    """A line without its names, layout and comment.

    >>> _shape("    c = np.cos(a)  # turn") == _shape("  k=np.sin( angle )")
    True
    """
    code = line.partition("#")[0]
    named = _NAME.sub(lambda word: word[0] if keyword.iskeyword(word[0]) else "name", code)
    return "".join(named.split())
