"""Notebook lines that are no Python: magics, shell commands and help requests.

A cell that parses as it stands is left alone. In one that does not, those lines give way
to Python that does nothing, so that every other line keeps its number. As in IPython, they
begin where a statement may: a line inside brackets or a string that begins with ``%`` is none.
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Iterator

# Cell magics whose body is Python of this notebook; the body of any other one is not.
TRANSPARENT = {"time", "timeit", "capture", "prun", "memit", "mprun"}

LONGEST = 300  # no magic is as long; what is longer would only cost time

_CELL_MAGIC = re.compile(r"\s*%%(\w+)[^\n]*")
_LINE = re.compile(r"(?P<indent>\s*)(?:[%!?].*|[^#'\"]*[^#'\"\s?]\?{1,2}\s*)$")
_ASSIGNED = re.compile(r"(?P<target>\s*[\w.,\s]+=\s*)[%!].*$")
# What tells where a statement ends: comments, strings, brackets and line breaks.
_PART = re.compile(
    r"""\#[^\n]*|'{3}(?:\\.|[^\\])*?(?:'{3}|\Z)|"{3}(?:\\.|[^\\])*?(?:"{3}|\Z)"""
    r"""|'(?:\\.|[^\\\n'])*'?|"(?:\\.|[^\\\n"])*"?|\\\n|[][(){}\n]""",
    re.DOTALL,
)


def neutralise(source: str) -> tuple[str, str]:
    r"""Python for a cell of a notebook, line by line, and whether it is any.

    Parameters
    ----------
    source : str
        The cell as the notebook stores it.

    Returns
    -------
    source : str
        The same lines with magics, shell commands and help requests taken out; nothing
        for a cell in another language (``%%bash``).
    error : str
        What still keeps it from being Python, a syntax error of the student's; mostly "".

    Examples
    --------
    >>> print(neutralise("%matplotlib inline\nfiles = !ls\nif files:\n    !pwd")[0])
    <BLANKLINE>
    files = None
    if files:
        pass
    """
    source = source.replace("\r\n", "\n").replace("\r", "\n")
    error = syntax_error(source)
    magic = _CELL_MAGIC.match(source) if error else None
    if magic and magic[1] not in TRANSPARENT:
        return "", ""
    if magic:
        source = source[magic.end() :].rjust(
            len(source[magic.end() :]) + magic[0].count("\n"), "\n"
        )
        error = syntax_error(source)
    if error:
        source = "\n".join(_plain(source))
        error = syntax_error(source)
    return source, error


def syntax_error(source: str) -> str:
    """What keeps a text from being Python, and in which line; empty where nothing does."""
    try:
        with warnings.catch_warnings(action="ignore"):
            compile(source, "cell", "exec")
    except SyntaxError as error:
        return f"{error.msg} (line {error.lineno})" if error.lineno else error.msg
    except (ValueError, MemoryError, RecursionError) as error:
        return str(error) or "it is nested too deeply"
    return ""


def tree(source: str) -> ast.Module:
    """The syntax tree of a text that parses."""
    with warnings.catch_warnings(action="ignore"):
        return ast.parse(source)


def _plain(source: str) -> Iterator[str]:
    """The text in pieces of whole lines; those that are no Python give way to some."""
    start = 0
    while start <= len(source):
        end = source.find("\n", start) % (len(source) + 1)  # -1: the last line
        plain = _plain_line(source[start:end])
        if plain == source[start:end]:
            end = _end_of_statement(source, start)
            plain = source[start:end]
        yield plain
        start = end + 1


def _end_of_statement(source: str, start: int) -> int:
    """Where the first line break outside of brackets and strings is."""
    depth = 0
    for part in _PART.finditer(source, start):
        depth += (part[0] in "([{") - (part[0] in ")]}")
        if part[0] == "\n" and depth <= 0:
            return part.start()
    return len(source)


def _plain_line(line: str) -> str:
    if len(line) > LONGEST:
        return line
    if assigned := _ASSIGNED.match(line):
        return assigned["target"] + "None"
    if command := _LINE.match(line):
        return command["indent"] + ("pass" if command["indent"] else "")
    return line
