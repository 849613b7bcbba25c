"""From the files of a submission to the statements that are run: notebooks and scripts.

Magics are turned into Python by IPython's own transformer. A script is cut where its cells begin
(``# %%``, ``# In[3]:``); without these marks it is one cell.
"""

from __future__ import annotations

import ast
import importlib
import io
import json
import re
import sys
import tokenize
import types
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

NOTEBOOK = (".ipynb", ".ipynb.txt", ".ipynb.json")
MARK = re.compile(r"^(?=# (?:%%|In\[[ \d]*\]:))", re.MULTILINE)


class Cell(NamedTuple):
    """A piece of a submission: its source, and what a message calls it ("cell 7", "a.py")."""

    source: str
    label: str
    is_script: bool = False


def programs(
    files: Mapping[str, bytes], functions: Collection[str], notes: list[str]
) -> tuple[list[Cell], dict[str, str]]:
    """The cells to run, and the scripts that they may import, by name.

    Of several files those run that define a function that is asked for, the one with the most
    answers last: of two answers to one question, its counts.

    Examples
    --------
    >>> cells, scripts = programs({"a.py": b"def f(): pass", "b.py": b"k = 1"}, ["f"], [])
    >>> [cell.label for cell in cells], list(scripts)
    (['a.py'], ['a.py', 'b.py'])
    """
    names = "|".join(functions)
    answer = re.compile(rf"^[ \t]*(?:def[ \t]+({names})\b|({names})[ \t]*=)", re.MULTILINE)
    read: dict[str, list[Cell]] = {}
    answers: dict[str, int] = {}
    scripts: dict[str, str] = {}
    for name, data in files.items():
        try:
            if name.lower().endswith(NOTEBOOK):
                read[name] = list(notebook_cells(name if len(files) > 1 else "", data))
            else:
                scripts[name] = decoded(data)
                read[name] = list(script_cells(name, scripts[name]))
            found = (answer.findall(cell.source) for cell in read[name])
            answers[name] = len(set().union(*found))
        except Exception as error:
            notes.append(f"{name} cannot be read: {error}")
    chosen = sorted(filter(answers.get, answers), key=answers.__getitem__) or list(read)[:1]
    return [cell for name in chosen for cell in read[name]], scripts


def notebook_cells(name: str, data: bytes) -> Iterator[Cell]:
    """The code cells of a notebook, of nbformat 3, too."""
    content: Any = json.loads(data.decode("utf-8-sig"))
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


def statements(cell: Cell, transform: Callable[[str], str]) -> list[ast.stmt]:
    """The statements of a cell, each import of several packages taken apart.

    `transform` turns magics into Python. Of a script that is no Python even then, the part before
    the error is taken; a notebook's cell raises `SyntaxError`.
    """
    source = cell.source
    above = len(source) - len(source.lstrip("\n"))
    with warnings.catch_warnings(action="ignore"):
        try:
            nodes = ast.parse(source, cell.label).body
        except SyntaxError as first:
            nodes, source = [], "\n" * above + transform(source)
            while source:
                try:
                    nodes, source = ast.parse(source).body, ""
                except SyntaxError as error:
                    if not cell.is_script:
                        raise first from None
                    lines = source.splitlines(keepends=True)
                    source = "".join(lines[: min(error.lineno or 1, len(lines)) - 1])
    found: list[ast.stmt] = []
    for node in nodes:
        parts = node.names if isinstance(node, ast.Import) else ()
        found += [ast.copy_location(ast.Import([alias]), node) for alias in parts] or [node]
    return found


def load_transformer() -> Callable[[str], str]:
    """IPython's `transform_cell`, without the rest of IPython, which is slow to import."""
    for name in ("IPython", "IPython.core", "IPython.utils"):
        module = sys.modules[name] = types.ModuleType(name)
        module.__path__ = [str(Path(path, *name.split("."))) for path in sys.path]
    transform = importlib.import_module("IPython.core.inputtransformer2").TransformerManager()
    for name in [name for name in sys.modules if name.partition(".")[0] == "IPython"]:
        del sys.modules[name]
    found: Callable[[str], str] = transform.transform_cell
    return found
