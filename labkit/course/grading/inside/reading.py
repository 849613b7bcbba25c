"""From the files of a submission to the cells that are run: notebooks and scripts.

Magics are turned into Python by IPython's own transformer. A script is cut where its cells begin
(``# %%``, ``# In[3]:``), or else at its statements, so that one that fails takes no other along.
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
MAX_CELLS = 2000
MAX_PROGRAMS = 8
MAX_FINALLY = 5  # the compiler copies a block `finally` for each way into it
_MARK = re.compile(r"^# (?:%%|In\[[ \d]*\]:)", re.MULTILINE)


class Cell(NamedTuple):
    """A piece of a submission, run as a whole.

    Attributes
    ----------
    source : str
        As it stands in the file.
    label : str
        What a message calls it: "cell 7", "answers.py".
    first : int
        The line of the file at which it begins, counted from 0; 0 in a notebook.
    is_script : bool
        Whether it is a whole script, whose statements stand for themselves.
    """

    source: str
    label: str
    first: int = 0
    is_script: bool = False


def programs(
    files: Mapping[str, bytes], functions: Collection[str], notes: list[str]
) -> tuple[list[Cell], dict[str, str]]:
    r"""The cells to run, and the scripts that they may import, by name.

    Of several files those run that define a function that is asked for, the one with the most
    answers last: of two answers to one question, its counts.

    Examples
    --------
    >>> cells, scripts = programs({"a.py": b"def f(): pass", "b.py": b"k = 1"}, ["f"], [])
    >>> [cell.label for cell in cells], list(scripts)
    (['a.py'], ['a.py', 'b.py'])
    """
    read: dict[str, list[Cell]] = {}
    scripts: dict[str, str] = {}
    for name, data in files.items():
        try:
            if name.lower().endswith(NOTEBOOK):
                read[name] = list(notebook_cells(name if len(files) > 1 else "", data))
            else:
                text = decoded(data)
                scripts[name] = text
                read[name] = list(script_cells(name, text))
        except (ValueError, TypeError, LookupError, SyntaxError, RecursionError) as error:
            notes.append(f"{name} cannot be read: {error}")
    answers = {
        name: sum(
            bool(re.search(rf"^[ \t]*(?:def[ \t]+{one}\b|{one}[ \t]*=)", text, re.MULTILINE))
            for one in functions
        )
        for name, cells in read.items()
        if (text := "\n".join(cell.source for cell in cells)) or True
    }
    best = sorted((name for name in read if answers[name]), key=lambda name: answers[name])
    for name in best[:-MAX_PROGRAMS]:
        notes.append(f"{name} is not run: {MAX_PROGRAMS} other files hold more answers")
    chosen = best[-MAX_PROGRAMS:] or list(read)[:1]
    cells = [cell for name in chosen for cell in read[name]]
    if len(cells) > MAX_CELLS:
        notes.append(f"there are {len(cells)} cells; the last {MAX_CELLS} are run")
    return cells[-MAX_CELLS:], scripts


def notebook_cells(name: str, data: bytes) -> Iterator[Cell]:
    """The code cells of a notebook, of nbformat 3, too."""
    content = json.loads(data.decode("utf-8-sig"))
    if not isinstance(content, dict):
        raise ValueError("it is no notebook")
    sheets = [content, *(content.get("worksheets") or [])]
    cells = [cell for sheet in sheets for cell in sheet.get("cells") or []]
    if not cells and "cells" not in content and "worksheets" not in content:
        raise ValueError("it is no notebook: it has no cells")
    where = f" of {name}" if name else ""
    number = 0
    for cell in cells:
        if not isinstance(cell, dict) or cell.get("cell_type") != "code":
            continue
        number += 1
        source: Any = cell.get("source", cell.get("input", ""))
        text = source if isinstance(source, str) else "".join(map(str, source))
        yield Cell(text.replace("\r\n", "\n").replace("\r", "\n"), f"cell {number}{where}")


def script_cells(name: str, text: str) -> Iterator[Cell]:
    """The cells of a script: where they are marked, or all of it in one."""
    starts = [found.start() for found in _MARK.finditer(text)]
    if not starts:
        yield Cell(text, name, is_script=True)
        return
    for start, end in zip([0, *starts], [*starts, len(text)], strict=True):
        source = text[start:end]
        if source.strip() and "[markdown]" not in source.partition("\n")[0]:
            first = text.count("\n", 0, start)
            yield Cell(source, name, first=first, is_script=True)


def decoded(data: bytes) -> str:
    """The text of a script, in the encoding that it names; UTF-8 without one."""
    encoding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
    text = data.decode(encoding)
    return text.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\ufeff")


def statements(cell: Cell, transform: Callable[[str], str]) -> list[ast.stmt]:
    """The statements of a cell, each import of several packages taken apart.

    Parameters
    ----------
    cell : Cell
        What is run.
    transform : callable
        Turns magics into Python; see `load_transformer`.

    Raises
    ------
    SyntaxError
        Where it is no Python even after its magics are transformed; `ValueError` where it is
        nested too deeply to be compiled in time.
    """
    with warnings.catch_warnings(action="ignore"):
        try:
            tree = ast.parse(cell.source, cell.label)
        except SyntaxError as error:
            tree = _parsed_otherwise(cell, transform, error)
    ast.increment_lineno(tree, cell.first)
    found: list[ast.stmt] = []
    for node in tree.body:
        if _finally_depth(node) > MAX_FINALLY:
            raise ValueError(f"more than {MAX_FINALLY} blocks `finally` in one another")
        if isinstance(node, ast.Import):
            found += [ast.copy_location(ast.Import([alias]), node) for alias in node.names]
        else:
            found.append(node)
    return found


def _parsed_otherwise(
    cell: Cell, transform: Callable[[str], str], error: SyntaxError
) -> ast.Module:
    """A cell with magics; of a script that is no Python, the part before the error."""
    transformed = transform(cell.source)
    try:
        return ast.parse(transformed, cell.label)
    except SyntaxError:
        if not cell.is_script:
            raise error from None
    lines = transformed.splitlines(keepends=True)
    tops = [k for k, line in enumerate(lines[: error.lineno or 0]) if not line[:1].isspace()]
    for end in reversed(tops[-50:]):
        try:
            return ast.parse("".join(lines[:end]))
        except SyntaxError:
            continue
    raise error


def load_transformer() -> Callable[[str], str]:
    """IPython's `transform_cell`, without the rest of IPython, which is slow to import."""
    shells = ("IPython", "IPython.core", "IPython.utils")
    for name in shells:
        module = sys.modules[name] = types.ModuleType(name)
        module.__path__ = [str(Path(path, *name.split("."))) for path in sys.path]
    transform = importlib.import_module("IPython.core.inputtransformer2").TransformerManager()
    for name in [name for name in sys.modules if name.partition(".")[0] == "IPython"]:
        del sys.modules[name]
    found: Callable[[str], str] = transform.transform_cell
    return found


def _finally_depth(node: ast.AST) -> int:
    """How many blocks `finally` stand in one another."""
    deepest, open_nodes = 0, [(node, 0)]
    while open_nodes:
        one, depth = open_nodes.pop()
        own = depth + bool(getattr(one, "finalbody", None))
        deepest = max(deepest, own)
        open_nodes += [(below, own) for below in ast.iter_child_nodes(one)]
    return deepest
