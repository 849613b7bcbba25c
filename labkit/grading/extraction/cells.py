"""The code cells of a notebook or a script, as their author left them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from labkit.errors import LabkitError
from labkit.grading.extraction.magics import neutralise

MAX_CELLS = 5000


@dataclass(frozen=True, kw_only=True)
class RawCell:
    """One code cell.

    Attributes
    ----------
    source : str
        Python, magics taken out.
    error : str
        What keeps the source from being Python all the same; mostly "".
    label : str
        What a message calls it.
    grade_id : str
        nbgrader's name of it; empty where it has none.
    """

    source: str
    error: str
    label: str
    grade_id: str = ""


def cells_of(name: str, data: bytes) -> list[RawCell]:
    """Read a file of a submission.

    Parameters
    ----------
    name : str
        Its name; the suffix tells a notebook from a script.
    data : bytes
        What it holds.

    Returns
    -------
    list of RawCell
        A script is one cell.

    Raises
    ------
    LabkitError
        For a file that is no notebook or no text; the message is for the student.
    """
    text = _decode(name, data)
    if not name.lower().endswith(".ipynb"):
        source, error = neutralise(text)
        return [RawCell(source=source, error=error, label=name)]
    try:
        notebook = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise LabkitError(
            f"{name} is no notebook ({error}); save it again and hand it in"
        ) from None
    found: list[RawCell] = []
    for cell in _cells(name, notebook):
        if isinstance(cell, dict) and cell.get("cell_type") == "code":
            source, fault = neutralise(_text(cell.get("source", cell.get("input", ""))))
            found.append(
                RawCell(
                    source=source,
                    error=fault,
                    label=f"code cell {len(found) + 1} of {name}",
                    grade_id=_grade_id(cell),
                )
            )
    return found


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
