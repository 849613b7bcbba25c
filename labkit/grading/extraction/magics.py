"""Notebook lines that are no Python: magics, shell commands and help requests.

A cell that parses as it stands is left alone. In one that does not, those lines give way
to Python that does nothing, so that every other line keeps its number.
"""

from __future__ import annotations

import ast
import re
import warnings

# Cell magics whose body is Python of this notebook; the body of any other one is not.
TRANSPARENT = {"time", "timeit", "capture", "prun", "memit", "mprun"}

LONGEST = 300  # no magic is as long; what is longer would only cost time

_CELL_MAGIC = re.compile(r"\s*%%(\w+)[^\n]*")
_LINE = re.compile(r"(?P<indent>\s*)(?:[%!?].*|[^#'\"]*[^#'\"\s?]\?{1,2}\s*)$")
_ASSIGNED = re.compile(r"(?P<target>\s*[\w.,\s]+=\s*)[%!].*$")


def neutralise(source: str) -> str:
    r"""Python for a cell of a notebook, line by line.

    Parameters
    ----------
    source : str
        The cell as the notebook stores it.

    Returns
    -------
    str
        The same lines with magics, shell commands and help requests taken out; nothing
        for a cell in another language (``%%bash``). It may still hold a syntax error of
        the student's.

    Examples
    --------
    >>> print(neutralise("%matplotlib inline\nfiles = !ls\nif files:\n    !pwd"))
    <BLANKLINE>
    files = None
    if files:
        pass
    """
    source = source.replace("\r\n", "\n").replace("\r", "\n")
    if parses(source):
        return source
    magic = _CELL_MAGIC.match(source)
    if magic and magic[1] not in TRANSPARENT:
        return ""
    if magic:
        source = source[magic.end() :].rjust(
            len(source[magic.end() :]) + magic[0].count("\n"), "\n"
        )
    return source if parses(source) else "\n".join(map(_plain_line, source.split("\n")))


def parses(source: str) -> bool:
    """Whether a text is Python."""
    return not syntax_error(source)


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


def _plain_line(line: str) -> str:
    if len(line) > LONGEST:
        return line
    if assigned := _ASSIGNED.match(line):
        return assigned["target"] + "None"
    if command := _LINE.match(line):
        return command["indent"] + ("pass" if command["indent"] else "")
    return line
