"""Submissions that are nearly the same, by the passages that they share, and two side by side.

What was handed out says nothing and is left out, as is what many of a class wrote (the obvious
one-liner). Many means many of their own accord: those who copied from one another are a family,
and count once, however many they are. Whether somebody copied is for a person to judge, who
reads two submissions beside each other, question by question.
"""

from __future__ import annotations

import difflib
import keyword
import math
import re
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from labkit.grading.assignment.questions import Question
from labkit.grading.contract import SourceCell
from labkit.grading.extraction.passages import runs

COMMON = 0.1  # share of the families beyond which a passage is everybody's
FEW = 3  # ... and as many families share it at least
ENOUGH = 8  # rare passages that a submission must have to be compared
WHOLE = 40  # passages in which no two are the same by chance, rare or not
KEYS, ROWS = 40, 8  # sharing 8 of 10: one in common at 0.8 at least; 5 of 10: at 0.006
SHUFFLES = np.random.default_rng(0).integers(2**63, size=KEYS * ROWS, dtype=np.uint64) * 2 + 1

Passages = frozenset[int]
MAX_ROWS = 300  # of one question
_NAME = re.compile(r"\b[^\W\d]\w*")


@dataclass(frozen=True, kw_only=True)
class Group:
    """Students whose submissions are nearly the same.

    Attributes
    ----------
    students : tuple of str
        Two or more, in alphabetical order.
    share : float
        Each of them shares as much, at least, with another one: of the rare passages of the
        one that has fewer, or 1 where both are the same as a whole.
    """

    students: tuple[str, ...]
    share: float


def all_passages(sources: Iterable[str]) -> set[int]:
    """The hashes of every run of tokens, not only of some: of what was handed out."""
    return {one for source in sources for one in runs(source)}


def near_identical(
    submissions: Mapping[str, Iterable[int]],
    handed_out: Collection[int] = (),
    share: float = 0.8,
) -> list[Group]:
    """Groups of students who share at least `share` of their rare passages, most alike first.

    Parameters
    ----------
    submissions : mapping of str to iterable of int
        The `passages` of each student.
    handed_out : collection of int
        What is in the assignment already; see `all_passages`.
    share : float
        In (0, 1].

    Notes
    -----
    A passage is rare where few families wrote it. A family is one submission and those that
    share at least `share` of all passages with it, so that a copy does not make what was
    copied less rare. Submissions that are the same as a whole are a group even without
    anything rare, unless they are short.
    """
    authors: defaultdict[Passages, list[str]] = defaultdict(list)
    for student, found in submissions.items():
        authors[frozenset(found).difference(handed_out)].append(student)
    programs = sorted(authors, key=lambda one: (-len(one), min(authors[one])))
    rare = _rare(programs, share)
    links = [
        (1.0, place, place)
        for place, (whole, own) in enumerate(zip(programs, rare, strict=True))
        if len(authors[whole]) > 1 and (len(own) >= ENOUGH or len(whole) >= WHOLE)
    ]
    links += _links(rare, share)
    groups = []
    for places, least in _connected(links):
        students = sorted(student for place in places for student in authors[programs[place]])
        groups.append(Group(students=tuple(students), share=least))
    return sorted(groups, key=lambda group: (-group.share, group.students))


def _rare(programs: Sequence[Passages], share: float) -> list[Passages]:
    """Of each program the passages that few families wrote."""
    families: dict[int, set[int]] = {}
    found_by: defaultdict[bytes, list[int]] = defaultdict(list)
    for place, program in enumerate(programs):
        keys = _keys(program)
        for first in sorted({first for key in keys for first in found_by.get(key, ())}):
            longer = max(len(program), len(programs[first]))
            if len(program & programs[first]) >= share * longer:
                families[first] |= program
                break
        else:
            families[place] = set(program)
            for key in keys:
                found_by[key].append(place)
    spread = Counter(passage for family in families.values() for passage in family)
    limit = max(FEW, COMMON * len(families))
    return [frozenset(one for one in program if spread[one] <= limit) for program in programs]


def _keys(program: Passages) -> list[bytes]:
    """Keys by MinHash: those who share most have one in common, those who do not have none."""
    hashes = np.fromiter(program, np.uint64)[:, None] * SHUFFLES  # wraps round
    least = hashes.min(axis=0, initial=np.iinfo(np.uint64).max)
    return [bytes([key]) + rows.tobytes() for key, rows in enumerate(least.reshape(KEYS, ROWS))]


def _links(rare: Sequence[Passages], share: float) -> Iterator[tuple[float, int, int]]:
    """The pairs that share enough, with how much they share of the smaller one.

    Whoever holds `share` of a program cannot lack all of its rarest passages.
    """
    spread = Counter(passage for one in rare for passage in one)
    holders: defaultdict[int, list[int]] = defaultdict(list)
    for place in sorted(range(len(rare)), key=lambda place: -len(rare[place])):
        own = rare[place]
        if len(own) < ENOUGH:
            return
        rarest = sorted(own, key=lambda passage: (spread[passage], passage))
        lacking = len(own) - math.ceil(share * len(own))
        for other in {other for one in rarest[: lacking + 1] for other in holders.get(one, ())}:
            common = len(own & rare[other]) / len(own)
            if common >= share:
                yield common, other, place
        for passage in own:
            holders[passage].append(place)


def _connected(links: Iterable[tuple[float, int, int]]) -> list[tuple[list[int], float]]:
    """What the links join, and the weakest link that it takes, a spanning tree's."""
    parent: dict[int, int] = {}
    least: dict[int, float] = {}

    def root(one: int) -> int:
        while parent.setdefault(one, one) != one:
            parent[one] = parent[parent[one]]
            one = parent[one]
        return one

    for share, one, other in sorted(links, reverse=True):
        first, second = root(one), root(other)
        if first != second or one == other:
            parent[second], least[first] = first, share
    joined: defaultdict[int, list[int]] = defaultdict(list)
    for one in parent:
        joined[root(one)].append(one)
    return [(places, least[first]) for first, places in joined.items()]


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
