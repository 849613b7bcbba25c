"""Submissions that are nearly the same, whatever their variables are called.

Winnowing [1]_: a program becomes a sequence of tokens in which every name is alike; of the
hashes of its runs of tokens, the smallest in each window is kept. Two programs that share
a passage share its hashes. What many of a class share (the stubs, the obvious one-liner)
says nothing and is left out.

References
----------
.. [1] Schleimer, Wilkerson, Aiken, "Winnowing: local algorithms for document
       fingerprinting", SIGMOD 2003.
"""

from __future__ import annotations

import io
import keyword
import tokenize
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

from labkit.grading.contract import SourceCell

RUN = 12  # tokens in a run: shorter passages are alike by chance
WINDOW = 8  # runs of which one is kept
COMMON = 0.1  # share of the class beyond which a passage is everybody's
FEW = 3  # ... and as many students share it at least
ENOUGH = 8  # rare passages that a submission must have to be compared
SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.ENCODING, tokenize.ENDMARKER}


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two students, and the share of the smaller submission that the other one holds too."""

    students: tuple[str, str]
    share: float


def passages(cells: Iterable[SourceCell]) -> tuple[int, ...]:
    r"""The fingerprint of a submission: hashes of some of its passages, in rising order.

    Examples
    --------
    >>> def cell(text):
    ...     return SourceCell(source=text, question=None, label="cell 1")
    >>> ours = cell("def f(a, b):\n    c = a + b\n    return c * a - b if a > b else c + a")
    >>> theirs = cell("def g(x,y): # mine\n  z = x+y\n  return z*x-y if x>y else z+x")
    >>> passages([ours]) == passages([theirs]) != ()
    True
    """
    hashes: list[int] = []
    for cell in cells:
        shape = list(_shape(cell.source))
        runs = [
            zlib.crc32("\0".join(shape[start : start + RUN]).encode())
            for start in range(len(shape) - RUN + 1)
        ]
        hashes += [min(runs[start : start + WINDOW]) for start in range(len(runs) - WINDOW + 1)]
        hashes += [min(runs)] if 0 < len(runs) < WINDOW else []
    return tuple(sorted(set(hashes)))


def near_identical(submissions: Mapping[str, Iterable[int]], share: float = 0.8) -> list[Pair]:
    """The pairs that share at least `share` of their rare passages, most alike first.

    Parameters
    ----------
    submissions : mapping of str to iterable of int
        The `passages` of each student.
    share : float
        In (0, 1].
    """
    spread = Counter(one for found in submissions.values() for one in set(found))
    limit = max(FEW, COMMON * len(submissions))
    holders: defaultdict[int, list[str]] = defaultdict(list)
    rare: Counter[str] = Counter()
    for student, found in submissions.items():
        for one in set(found):
            if spread[one] <= limit:
                rare[student] += 1
                holders[one].append(student)
    common = Counter(
        pair for students in holders.values() for pair in combinations(sorted(students), 2)
    )
    pairs = [
        Pair(students=pair, share=count / min(rare[pair[0]], rare[pair[1]]))
        for pair, count in common.items()
        if min(rare[pair[0]], rare[pair[1]]) >= ENOUGH
    ]
    return sorted(
        (pair for pair in pairs if pair.share >= share), key=lambda p: (-p.share, p.students)
    )


def _shape(source: str) -> Iterator[str]:
    """The tokens of a program, names and texts alike; up to where it is no Python."""
    try:
        for token in tokenize.generate_tokens(io.StringIO(source.lstrip("\n")).readline):
            if token.type in SILENT:
                continue
            if token.type == tokenize.NAME and not keyword.iskeyword(token.string):
                yield "name"
            elif token.type == tokenize.STRING:
                yield "text"
            elif token.type in {tokenize.INDENT, tokenize.DEDENT}:
                yield tokenize.tok_name[token.type]
            else:
                yield token.string
    except (tokenize.TokenError, IndentationError, SyntaxError):
        return
