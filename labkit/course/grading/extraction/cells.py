"""The code cells of a notebook or a script, without the lines that are no Python.

Those are magics, shell commands and help requests. A cell that parses as it stands is left
alone. In one that does not, those lines give way to Python that does nothing, so that every
other line keeps its number. As in IPython, they begin where a statement may: a line inside
brackets or a string that begins with ``%`` is none.
"""

from __future__ import annotations

import ast
import json
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

MAX_CELLS = 5000
MAX_CODE = 1 << 18  # characters of code in one file
MAX_ALL_CODE = 4 * MAX_CODE  # ... and in all files of a submission
COSTS = {  # as many characters of code does each count for, however short it is
    "characters of code": 1,
    "lines of code": 50,  # and semicolons
    "functions and loops": 100,  # and classes and comprehensions
    "words and signs": 6,  # the parser makes a node of each
}
MAX_SCOPES_AND_NAMES = 10_000_000  # the product, in a cell
MAX_REREAD = 200_000_000  # characters of f-strings times their fields, of names times their dots
MAX_PARTS = 2_000_000  # objects and lists in the JSON of a notebook: far more than plots need

# Cell magics whose body is Python of this notebook, as is that of a script that is written (and
# imported, mostly); the body of any other one is not.
TRANSPARENT = {"time", "timeit", "capture", "prun", "memit", "mprun"}

LONGEST = 300  # no magic is as long; what is longer would only cost time

_SCOPE, _WORD = re.compile(r"\b(?:lambda|def|class|for)\b|(?<=\d)for\b"), re.compile(r"\w+")
_DOTTED = re.compile(r"(?:\b\w++[\s\\]*+\.[\s\\]*+)+")
_PIECE = re.compile(r"\d[\w.]*|\w+|[^\w\s]")
_CELL_MAGIC = re.compile(r"\s*%%\w[^\n]*")
_PYTHON = re.compile(rf"\s*%%(?:(?:{'|'.join(sorted(TRANSPARENT))})\b|writefile\b.*\.py\s*$)", re.M)
_NOTEBOOK = re.compile(r"\.ipynb(\.txt|\.json)?$", re.IGNORECASE)  # as browsers save it
_LINE = re.compile(r"(?P<indent>\s*)(?:[%!?].*|[^#'\"]*[^#'\"\s?]\?{1,2}\s*)$")
_ASSIGNED = re.compile(r"(?P<target>\s*[\w.,\s]+=\s*)[%!].*$")
# What tells where a statement ends: comments, strings, brackets and line breaks.
_PART = re.compile(
    r"""\#[^\n]*|'{3}(?:\\.|[^\\])*?(?:'{3}|\Z)|"{3}(?:\\.|[^\\])*?(?:"{3}|\Z)"""
    r"""|'(?:\\.|[^\\\n'])*'?|"(?:\\.|[^\\\n"])*"?|\\\n|[][(){}\n]""",
    re.DOTALL,
)


class UnreadableError(ValueError):
    """A file that is no notebook or no script; the message is for the student."""


@dataclass(frozen=True, kw_only=True)
class RawCell:
    """One code cell.

    Attributes
    ----------
    source : str
        Python, magics taken out.
    error : str
        What keeps the source from being Python all the same; mostly "".
    file : str
        The file that it stands in.
    label : str
        What a message calls it.
    grade_id : str
        nbgrader's name of it; empty where it has none.
    """

    source: str
    error: str
    file: str
    label: str
    grade_id: str = ""


def cells_by_file(files: Mapping[str, bytes], unread: list[str]) -> dict[str, list[RawCell]]:
    """The cells of each file; none, and a word on it, where it cannot be read or is too long."""
    read: dict[str, list[RawCell]] = {}
    left = MAX_ALL_CODE
    for name, data in files.items():
        read[name] = []
        try:
            read[name] = cells_of(name, data, left)
        except UnreadableError as error:
            unread.append(str(error))
        left -= cost_of(cell.source for cell in read[name])
    return read


def cells_of(name: str, data: bytes, left: int = MAX_CODE) -> list[RawCell]:
    """Read a file of a submission.

    Parameters
    ----------
    name : str
        Its name; the suffix tells a notebook from a script.
    data : bytes
        What it holds.
    left : int
        How many characters of code may still be read, as `cost_of` counts them.

    Returns
    -------
    list of RawCell
        A script is one cell.

    Raises
    ------
    UnreadableError
        For a file that is no notebook or no text, or holds too much code; the message is for
        the student.
    """
    text = _decode(name, data)
    if not _NOTEBOOK.search(name):
        _check_length(name, [text], left)
        source, error = neutralise(text)
        return [RawCell(source=source, error=error, file=name, label=name)]
    if text.count("{") + text.count("[") > MAX_PARTS:
        raise UnreadableError(
            f"{name} is too large a notebook; clear its outputs and hand it in again"
        )
    try:
        notebook = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise UnreadableError(
            f"{name} is no notebook, or not a whole one: its JSON breaks in line "
            f"{getattr(error, 'lineno', 1)}; save it again and hand it in"
        ) from None
    cells = [
        cell
        for cell in _cells(name, notebook)
        if isinstance(cell, dict) and cell.get("cell_type") == "code"
    ]
    texts = [_text(cell.get("source", cell.get("input", ""))) for cell in cells]
    _check_length(name, texts, left)
    found: list[RawCell] = []
    for number, (cell, written) in enumerate(zip(cells, texts, strict=True), 1):
        source, fault = neutralise(written)
        label = f"code cell {number} of {name}"
        grade_id = _grade_id(cell)
        found.append(RawCell(source=source, error=fault, file=name, label=label, grade_id=grade_id))
    return found


def _check_length(name: str, texts: list[str], left: int) -> None:
    """Refuse what would keep the grader busy for more than a second."""
    cost = cost_of(texts)
    if cost > MAX_CODE:
        together = Counter[str]()
        for text in texts:
            together.update(_sizes(text))
        kind = max(together, key=lambda kind: together[kind] * COSTS[kind])
        most = MAX_CODE // COSTS[kind]
        limit = f"{most} at most" if together[kind] > most else "beside all the rest"
        raise UnreadableError(
            f"{name} is too long to be read, by its {together[kind]} {kind} ({limit}); keep data "
            f"and outputs out of the code"
        )
    if cost > left:
        raise UnreadableError(f"the files hold too much code together; {name} is not read")


def cost_of(texts: Iterable[str]) -> int:
    """How many characters of code texts count for: short lines and short words cost more."""
    return sum(max(n * COSTS[kind] for kind, n in _sizes(text).items()) for text in texts)


def _sizes(text: str) -> dict[str, int]:
    """How much there is in a text of all that costs time."""
    return {
        "characters of code": len(text),
        "lines of code": sum(map(text.count, "\n\r;")),
        "functions and loops": len(_SCOPE.findall(text)),
        "words and signs": len(_PIECE.findall(text)),
    }


def _cells(name: str, notebook: Any) -> list[Any]:
    """The cells of a notebook in today's format (4), or in the one before."""
    if isinstance(notebook, dict):
        sheets = notebook.get("worksheets")
        if isinstance(sheets, list) and sheets and isinstance(sheets[0], dict):
            notebook = sheets[0]
        cells = notebook.get("cells")
        if isinstance(cells, list) and len(cells) <= MAX_CELLS:
            return cells
        if isinstance(cells, list):
            raise UnreadableError(f"{name} has {len(cells)} cells; at most {MAX_CELLS} are read")
    raise UnreadableError(f"{name} is no notebook: it has no list of cells; save it again")


def _text(source: Any) -> str:
    if isinstance(source, list):
        return "".join(part for part in source if isinstance(part, str))
    return source if isinstance(source, str) else ""


def _grade_id(cell: dict[str, Any]) -> str:
    metadata = cell.get("metadata")
    nbgrader = metadata.get("nbgrader") if isinstance(metadata, dict) else None
    grade_id = nbgrader.get("grade_id") if isinstance(nbgrader, dict) else None
    return grade_id if isinstance(grade_id, str) else ""


def _decode(name: str, data: bytes) -> str:
    for encoding in ("utf-8-sig", "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8"):
        try:
            return data.decode(encoding)
        except UnicodeDecodeError as error:
            place = error.start
    raise UnreadableError(f"{name} is no text: byte {place} is not UTF-8; save it again as UTF-8")


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
    if magic and not _PYTHON.match(magic[0]):
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
    if why := too_involved(source):
        return why
    try:
        with warnings.catch_warnings(action="ignore"):
            compile(source, "cell", "exec")
    except SyntaxError as error:
        return f"{error.msg} (line {error.lineno})" if error.lineno else error.msg
    except (ValueError, MemoryError, RecursionError) as error:
        return str(error) or "it is nested too deeply"
    return ""


def too_involved(source: str) -> str:
    """Why a text would keep the compiler busy for seconds; empty for all that people write.

    It looks for each field of an f-string from the string's start, copies all names of a
    function for each function within, and a name that is imported at each of its dots.
    """
    scopes = len(_SCOPE.findall(source))
    if scopes * len(set(_WORD.findall(source))) > MAX_SCOPES_AND_NAMES:
        return f"it holds {scopes} functions and comprehensions and many names, too many to be read"
    if sum(len(name[0]) * name[0].count(".") for name in _DOTTED.finditer(source)) > MAX_REREAD:
        return "it holds a name with more dots than can be read"
    cost = 0
    for part in _PART.finditer(source):
        prefix = source[max(0, part.start() - 2) : part.start()].lower()
        if part[0][0] in "'\"" and "f" in prefix:
            cost += len(part[0]) * part[0].count("{")
    return "its f-strings hold more fields than can be read" if cost > MAX_REREAD else ""


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
