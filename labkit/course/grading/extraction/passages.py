"""The passages of a program, whatever its variables are called: what copies have in common.

Winnowing [1]_: a program becomes a sequence of tokens in which every name is alike; of the
hashes of its runs of tokens, the smallest in each window is kept. Two programs that share
a passage share its hashes.

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
from collections.abc import Iterable, Iterator

RUN = 12  # tokens in a run: shorter passages are alike by chance
WINDOW = 8  # runs of which one is kept
SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.ENCODING, tokenize.ENDMARKER}


def passages(sources: Iterable[str]) -> tuple[int, ...]:
    r"""The fingerprint of a submission: hashes of some of its passages, in rising order.

    Examples
    --------
    >>> ours = "def f(a, b):\n    c = a + b\n    return c * a - b if a > b else c + a"
    >>> theirs = "def g(x,y): # mine\n  z = x+y\n  return z*x-y if x>y else z+x"
    >>> passages([ours]) == passages([theirs]) != ()
    True
    """
    hashes: list[int] = []
    for source in dict.fromkeys(sources):
        found = runs(source)
        hashes += [min(found[start : start + WINDOW]) for start in range(len(found) - WINDOW + 1)]
        hashes += [min(found)] if 0 < len(found) < WINDOW else []
    return tuple(sorted(set(hashes)))


def runs(source: str) -> list[int]:
    """The hash of every run of `RUN` tokens."""
    shape = list(_shape(source))
    return [
        zlib.crc32("\0".join(shape[start : start + RUN]).encode())
        for start in range(len(shape) - RUN + 1)
    ]


def _shape(source: str) -> Iterator[str]:
    """The tokens of a program, names and texts alike; up to where it is no Python."""
    try:
        for token in tokenize.generate_tokens(io.StringIO(source.lstrip("\n")).readline):
            if token.type == tokenize.ERRORTOKEN:  # Python 3.11 would try again at each blank
                return
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
