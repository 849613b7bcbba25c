"""Which cells of a notebook others need: those that set what they read, and so on."""

from __future__ import annotations

import dis
from collections.abc import Collection, Iterator, Sequence
from types import CodeType

from IPython.core.inputtransformer2 import TransformerManager

CHANGES = {"STORE_SUBSCR", "STORE_ATTR"}  # as `errors[name] = 1.0` does to `errors`


def needed(cells: Sequence[str], wanted: Collection[int]) -> list[int]:
    """The rows of `wanted`, and of all cells of code before them that they hang on.

    Examples
    --------
    >>> needed(["import math", "x = 1", "y = math.pi", "x = y", "print(x)", "z = x"], {4})
    [0, 2, 3, 4]
    """
    kept, open_names = [], set[str]()
    for row in reversed(range(len(cells))):
        reads, sets, changes = names(cells[row])
        if row in wanted or open_names & (sets | changes):
            kept.append(row)
            open_names = (open_names - sets) | reads
    return kept[::-1]


def names(cell: str) -> tuple[set[str], set[str], set[str]]:
    """The names that a cell reads before it sets them, sets, and may change the values of."""
    reads, sets, changes = set[str](), set[str](), set[str]()
    code = compile(TransformerManager().transform_cell(cell), "cell", "exec")
    for step in dis.get_instructions(code):
        if step.opname == "STORE_NAME":
            sets.add(step.argval)
        elif step.opname == "LOAD_NAME" and step.argval not in sets:
            reads.add(step.argval)
        elif step.opname in CHANGES:
            changes |= reads
    inside = {name for part in parts(code) for name in read_inside(part)}
    return reads | (inside - sets), sets, changes


def parts(code: CodeType) -> Iterator[CodeType]:
    """The functions and comprehensions in a piece of code."""
    for part in code.co_consts:
        if isinstance(part, CodeType):
            yield part
            yield from parts(part)


def read_inside(code: CodeType) -> set[str]:
    """The names that a function takes from the notebook."""
    return {
        step.argval
        for step in dis.get_instructions(code)
        if step.opname in ("LOAD_GLOBAL", "LOAD_NAME")
    }
