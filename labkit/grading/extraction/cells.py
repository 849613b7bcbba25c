"""The code cells of a notebook or a script, as their author left them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from labkit.errors import LabkitError
from labkit.grading.extraction.magics import neutralise

MAX_CELLS = 5000
MAX_CODE = 1 << 18  # characters of code in one file
MAX_ALL_CODE = 4 * MAX_CODE  # ... and in all files of a submission
LINE = 50  # as many characters does a line cost, however short it is
MAX_PARTS = 2_000_000  # objects and lists in the JSON of a notebook: far more than plots need


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


def cells_by_file(files: Mapping[str, bytes], notes: list[str]) -> dict[str, list[RawCell]]:
    """The cells of each file; none, and a note, where it cannot be read or is one too many."""
    read: dict[str, list[RawCell]] = {}
    left = MAX_ALL_CODE
    for name, data in files.items():
        read[name] = []
        try:
            read[name] = cells_of(name, data, left)
        except LabkitError as error:
            notes.append(str(error))
        left -= _cost(cell.source for cell in read[name])
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
        How many characters of code may still be read; a line costs `LINE` at least.

    Returns
    -------
    list of RawCell
        A script is one cell.

    Raises
    ------
    LabkitError
        For a file that is no notebook or no text, or holds too much code; the message is for
        the student.
    """
    text = _decode(name, data)
    if not name.lower().endswith(".ipynb"):
        _check_length(name, [text], left)
        source, error = neutralise(text)
        return [RawCell(source=source, error=error, file=name, label=name)]
    if text.count("{") + text.count("[") > MAX_PARTS:
        raise LabkitError(f"{name} is too large a notebook; clear its outputs and hand it in again")
    try:
        notebook = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise LabkitError(
            f"{name} is no notebook ({error}); save it again and hand it in"
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
    """Refuse what would keep the grader busy for minutes: it reads code outside of a sandbox."""
    cost = _cost(texts)
    if cost > MAX_CODE:
        raise LabkitError(
            f"{name} holds {sum(map(len, texts))} characters of code, at most {MAX_CODE} in "
            f"{MAX_CODE // LINE} lines are read; keep data and outputs out of the code"
        )
    if cost > left:
        raise LabkitError(f"the files hold too much code together; {name} is not read")


def _cost(texts: Iterable[str]) -> int:
    return sum(max(len(text), LINE * text.count("\n")) for text in texts)


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
            raise LabkitError(f"{name} has {len(cells)} cells; at most {MAX_CELLS} are read")
    raise LabkitError(f"{name} is no notebook: it has no list of cells; save it again")


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
    raise LabkitError(f"{name} is no text: byte {place} is not UTF-8; save it again as UTF-8")
