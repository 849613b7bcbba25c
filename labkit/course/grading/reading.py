"""From the files of a submission to the cells that are run: notebooks and scripts.

A script is cut where its cells begin (``# %%``, ``# In[3]:``); without these marks it is one cell.
"""

from __future__ import annotations

import io
import json
import re
import tokenize
from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

NOTEBOOK = (".ipynb", ".ipynb.txt", ".ipynb.json")
MARK = re.compile(r"^(?=# (?:%%|In\[[ \d]*\]:))", re.MULTILINE)


class Cell(NamedTuple):
    """A piece of a submission: its source, and what a message calls it ("cell 7", "a.py")."""

    source: str
    label: str
    is_script: bool = False


class Program(NamedTuple):
    """Cells and scripts of a submission."""

    cells: list[Cell]  # to run, from top to bottom
    scripts: dict[str, str]  # that they may import or run, by file name
    code: str  # all of it, run or not
    notes: list[str]  # what cannot be read, and why


def read_program(files: Mapping[str, bytes], functions: Collection[str]) -> Program:
    """Read the cells of all files, and choose those that are run.

    Of several files those run that define a function that is asked for, the one with the most
    answers last: of two answers to one question, its counts.

    Examples
    --------
    >>> program = read_program({"a.py": b"def f(): pass", "b.py": b"k = 1"}, ["f"])
    >>> [cell.label for cell in program.cells], list(program.scripts)
    (['a.py'], ['a.py', 'b.py'])
    """
    names = "|".join(functions)
    answer = re.compile(rf"^[ \t]*(?:def[ \t]+({names})\b|({names})[ \t]*=)", re.MULTILINE)
    read: dict[str, list[Cell]] = {}
    answers: dict[str, int] = {}
    scripts: dict[str, str] = {}
    notes: list[str] = []
    for name, data in files.items():
        try:
            if name.lower().endswith(NOTEBOOK):
                read[name] = list(notebook_cells(name if len(files) > 1 else "", data))
                scripts[name] = "\n\n".join(cell.source for cell in read[name])
            else:
                scripts[name] = decoded(data)
                read[name] = list(script_cells(name, scripts[name]))
            found = (answer.findall(cell.source) for cell in read[name])
            answers[name] = len(set().union(*found))
        except Exception as error:  # untrusted
            notes.append(f"{name} cannot be read: {error}")
    code = "\n\n".join(cell.source.lstrip("\n") for cells in read.values() for cell in cells)
    chosen = sorted(filter(answers.get, answers), key=answers.__getitem__) or list(read)[:1]
    cells = [cell for name in chosen for cell in read[name]]
    return Program(cells, scripts, code.encode("utf-8", "replace").decode(), notes)


def notebook_cells(name: str, data: bytes) -> Iterator[Cell]:
    """The code cells of a notebook, of nbformat 3, too."""
    content: Any = json.loads(data)  # in UTF-8, 16 or 32
    if not isinstance(content, dict) or not content.keys() & {"cells", "worksheets"}:
        raise ValueError("it is no notebook")
    sheets = [content, *content.get("worksheets", [])]
    cells = [cell for sheet in sheets for cell in sheet.get("cells", [])]
    codes = [cell for cell in cells if cell.get("cell_type") == "code"]
    for number, cell in enumerate(codes, start=1):
        text = "".join(cell.get("source", cell.get("input", "")))
        yield Cell(_unix(text), f"cell {number} of {name}" if name else f"cell {number}")


def script_cells(name: str, text: str) -> Iterator[Cell]:
    """The cells of a script, each with as many empty lines before it as its line number says."""
    above = 0
    for part in MARK.split(text):
        yield Cell("\n" * above + part, name, is_script=True)
        above += part.count("\n")


def decoded(data: bytes) -> str:
    """The text of a script, in the encoding that it names; UTF-8 without one."""
    encoding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
    return _unix(data.decode(encoding)).removeprefix("\ufeff")


def _unix(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")
