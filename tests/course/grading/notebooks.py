"""Notebooks as students hand them in: the handed-out one with answers in it, and changed."""

import ast
import json
from pathlib import Path

from right_answers import solution, source_of

HANDED_OUT = Path(__file__).parents[3] / "notebooks/assignment.ipynb"
NUMPY = "import numpy as np\n\n"


def functions(module=solution):
    """The source of each function of a right submission; helpers under their own names."""
    source = source_of(module)
    found = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = ast.get_source_segment(source, node)
    return found


RIGHT = functions()


def cell(source, kind="code", **metadata):
    return {"cell_type": kind, "source": source, "metadata": metadata, "outputs": []}


def notebook(cells, **metadata):
    """The bytes of a notebook."""
    return json.dumps(
        {"nbformat": 4, "nbformat_minor": 5, "metadata": metadata, "cells": cells}
    ).encode()


def answered(changed=None, *, before=(), after=(), closing=True):
    """The handed-out notebook with right answers, some of them changed, and more cells around.

    `after` stands behind all that was handed out, the closing cells included.
    """
    answers = RIGHT | (changed or {})
    cells, handed_out = [], json.loads(HANDED_OUT.read_text(encoding="utf-8"))["cells"]
    for one in handed_out:
        source = "".join(one["source"])
        name = source.removeprefix("def ").partition("(")[0]
        if not closing and source.startswith("## Your functions on Killian"):
            break
        if one["cell_type"] == "code" and source.startswith("def ") and name in RIGHT:
            one["source"] = answers[name]
        cells.append(one)
    extra = [cell(source) for source in after]
    return notebook([cells[0], *map(cell, before), *cells[1:], *extra])
