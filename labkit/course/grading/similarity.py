"""Submissions that have much in common, by the passages that they share, and two side by side.

What was handed out says nothing and is left out, as is what many of a class wrote (the obvious
one-liner). Many means many of their own accord: those who copied from one another are a family,
and count once, however many they are. Whether somebody copied is for a person to judge, who
reads two submissions beside each other, question by question.
"""

from __future__ import annotations

import difflib
import keyword
import re
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest

import numpy as np

from labkit.course.grading.assignment.questions import Question
from labkit.course.grading.contract import SourceCell
from labkit.course.grading.extraction.passages import runs

COMMON = 0.1  # share of the families beyond which a passage is everybody's
FEW, MOST = 3, 20  # ... and as many families share it at least, or need to in a large class
SAME = 0.8  # two that share as much are one work
ENOUGH = 16  # rare passages that a submission must have for that
PART = 0.3  # of the rare passages: a few functions of a submission, or all of it in disguise
MANY = 40  # passages in which no two are the same by chance; here independent ones share 11
KEYS, ROWS = 40, 8  # sharing 8 of 10: one in common at 0.8 at least; 5 of 10: at 0.006
SHUFFLES = np.random.default_rng(0).integers(2**63, size=KEYS * ROWS, dtype=np.uint64) * 2 + 1

Passages = frozenset[int]
MAX_ROWS = 300  # of one question
_NAME = re.compile(r"\b[^\W\d]\w*")


@dataclass(frozen=True, kw_only=True)
class Group:
    """Students whose submissions have much in common.

    Attributes
    ----------
    students : tuple of str
        Two or more, in alphabetical order.
    pairs : tuple of (str, str, float)
        Two of them and the share of the rare passages of the one that has fewer that they have in
        common; 1 where both are the same as a whole. As few as connect all, most alike first.
    """

    students: tuple[str, ...]
    pairs: tuple[tuple[str, str, float], ...]

    @property
    def share(self) -> float:
        """Each of them shares as much, at least, with another one."""
        return self.pairs[-1][2]


def all_passages(sources: Iterable[str]) -> set[int]:
    """The hashes of every run of tokens, not only of some: of what was handed out."""
    return {one for source in sources for one in runs(source)}


def groups_alike(
    submissions: Mapping[str, Iterable[int]], handed_out: Collection[int] = ()
) -> list[Group]:
    """Groups of students who share much that few others wrote, most alike first.

    Parameters
    ----------
    submissions : mapping of str to iterable of int
        The `passages` of each student.
    handed_out : collection of int
        What is in the assignment already; see `all_passages`.

    Notes
    -----
    A passage is rare where few families wrote it. A family is one submission and those that
    share at least `SAME` of all passages with it, so that a copy does not make what was copied
    less rare. Two belong together that share `SAME` of the rare passages of the smaller one, or
    `PART` of them where these are `MANY`. Submissions that are the same as a whole are a group
    even without anything rare, unless they are short.
    """
    authors: defaultdict[Passages, list[str]] = defaultdict(list)
    for student, found in sorted(submissions.items()):
        authors[frozenset(found).difference(handed_out)].append(student)
    programs = sorted(authors, key=lambda one: (-len(one), authors[one][0]))
    rare = _rare(programs)
    links = [
        (1.0, authors[whole][0], other)
        for whole, own in zip(programs, rare, strict=True)
        for other in authors[whole][1:]
        if len(own) >= ENOUGH or len(whole) >= MANY
    ]
    first = [authors[program][0] for program in programs]
    links += [(share, first[one], first[other]) for share, one, other in _links(rare)]
    groups = [
        Group(
            students=tuple(sorted({student for _, one, other in tree for student in (one, other)})),
            pairs=tuple((min(one, other), max(one, other), share) for share, one, other in tree),
        )
        for tree in _trees(links)
    ]
    return sorted(groups, key=lambda group: (-group.share, group.students))


def _rare(programs: Sequence[Passages]) -> list[Passages]:
    """Of each program the passages that few families wrote."""
    families: dict[int, set[int]] = {}
    found_by: defaultdict[bytes, list[int]] = defaultdict(list)
    for place, program in enumerate(programs):
        keys = _keys(program)
        for first in sorted({first for key in keys for first in found_by.get(key, ())}):
            longer = max(len(program), len(programs[first]))
            if len(program & programs[first]) >= SAME * longer:
                families[first] |= program
                break
        else:
            families[place] = set(program)
            for key in keys:
                found_by[key].append(place)
    spread = Counter(passage for family in families.values() for passage in family)
    limit = min(max(FEW, COMMON * len(families)), MOST)
    return [frozenset(one for one in program if spread[one] <= limit) for program in programs]


def _keys(program: Passages) -> list[bytes]:
    """Keys by MinHash: those who share most have one in common, those who do not have none."""
    hashes = np.fromiter(program, np.uint64)[:, None] * SHUFFLES  # wraps round
    least = hashes.min(axis=0, initial=np.iinfo(np.uint64).max)
    return [bytes([key]) + rows.tobytes() for key, rows in enumerate(least.reshape(KEYS, ROWS))]


def _links(rare: Sequence[Passages]) -> Iterator[tuple[float, int, int]]:
    """The pairs that share enough, with how much they share of the smaller one."""
    holders: defaultdict[int, list[int]] = defaultdict(list)
    for place in sorted(range(len(rare)), key=lambda place: -len(rare[place])):
        own = rare[place]
        if len(own) < ENOUGH:
            return
        shared = Counter(chain.from_iterable(holders.get(passage, ()) for passage in own))
        for other, count in shared.items():
            if count >= min(SAME * len(own), max(PART * len(own), MANY)):
                yield count / len(own), other, place
        for passage in own:
            holders[passage].append(place)


def _trees(links: Iterable[tuple[float, str, str]]) -> list[list[tuple[float, str, str]]]:
    """Of all that links join, the strongest ones that do: a spanning tree each."""
    parent: dict[str, str] = {}

    def root(one: str) -> str:
        while parent.setdefault(one, one) != one:
            parent[one] = parent[parent[one]]
            one = parent[one]
        return one

    kept = []
    for share, one, other in sorted(links, key=lambda link: (-link[0], link[1:])):
        first, second = root(one), root(other)
        if first != second:
            parent[second] = first
            kept.append((share, one, other))
    trees: defaultdict[str, list[tuple[float, str, str]]] = defaultdict(list)
    for link in kept:
        trees[root(link[1])].append(link)
    return list(trees.values())


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
