"""Which statements of a submission its answers need.

A notebook holds plots, prints, experiments and half-finished loops beside the answers. A
program slice [1]_ leaves those out: of each function that is asked for, only the
statements that give a value to a name it uses, and to the names that those use. Imports
are always kept. What is left out cannot hang the grader, ask for input, or fail.

References
----------
.. [1] Weiser, "Program slicing", IEEE Transactions on Software Engineering 10(4), 1984.
"""

from __future__ import annotations

import ast
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from symtable import symtable

from labkit.grading.extraction.cells import RawCell
from labkit.grading.extraction.magics import tree

ANYWHERE = ""  # instead of the name of a file
Binders = Mapping[tuple[str, str], Sequence[int]]  # by name and file, or name and `ANYWHERE`


@dataclass(frozen=True, kw_only=True)
class Statement:
    """One top-level statement, or several that share a line.

    Attributes
    ----------
    cell : RawCell
        Where it stands.
    first, last : int
        Its lines there, counted from 1, both included.
    text : str
        Those lines.
    nodes : tuple of ast.stmt
        What they say.
    """

    cell: RawCell
    first: int
    last: int
    text: str
    nodes: tuple[ast.stmt, ...]

    @cached_property
    def is_import(self) -> bool:
        """Whether it is nothing but imports, or a `try` around some."""
        return all(
            isinstance(node, ast.Import | ast.ImportFrom)
            or (isinstance(node, ast.Try) and isinstance(node.body[0], ast.Import | ast.ImportFrom))
            for node in self.nodes
        )

    @cached_property
    def used(self) -> frozenset[str]:
        """Every global name that it reads, at whatever depth; no function's own variables."""
        try:
            with warnings.catch_warnings(action="ignore"):
                tables = [symtable(self.text, "cell", "exec")]
        except RecursionError:  # it compiled, by a hair
            return frozenset()
        names: set[str] = set()
        for table in tables:
            tables.extend(table.get_children())
            names |= {
                symbol.get_name()
                for symbol in table.get_symbols()
                if symbol.is_referenced() and (symbol.is_global() or table.get_type() == "module")
            }
        return frozenset(names)

    @cached_property
    def assigned(self) -> frozenset[str]:
        """Every name that it gives a value to."""
        return frozenset(name for node in _outside(self.nodes) for name in _assigned(node))

    @cached_property
    def changed(self) -> frozenset[str]:
        """Every name whose value it may change in place."""
        return frozenset(name for node in _outside(self.nodes) for name in _changed(node))

    @cached_property
    def defines(self) -> frozenset[str]:
        """The functions and classes that it defines, and the names it makes an alias of one."""
        return frozenset(name for node in self.nodes for name in _defined(node))


def statements(cell: RawCell) -> list[Statement]:
    """The top-level statements of a cell, in order; those that share a line are one."""
    try:
        body = tree(cell.source).body
    except RecursionError:  # it compiled, by a hair
        return []
    lines = cell.source.split("\n")
    spans: list[tuple[int, int, list[ast.stmt]]] = []
    for node in body:
        decorators = getattr(node, "decorator_list", [])
        first = min([node.lineno, *(decorator.lineno for decorator in decorators)])
        nodes: list[ast.stmt] = []
        if spans and first <= spans[-1][1]:
            first, _, nodes = spans.pop()
        nodes.append(node)
        spans.append((first, node.end_lineno or node.lineno, nodes))
    return [
        Statement(
            cell=cell,
            first=first,
            last=last,
            text="\n".join(lines[first - 1 : last]),
            nodes=tuple(nodes),
        )
        for first, last, nodes in spans
    ]


def binders_of(program: Sequence[Statement], aside: Collection[int] = ()) -> Binders:
    """The statements that may change what a name stands for, by their place in `program`.

    A name means what its own file gives it, and what all of them do where that gives it none.
    Statements in `aside` (an untouched stub) are passed over. A call on an imported module
    (``np.random.seed(0)``, ``plt.show()``) changes no value of the submission's.
    """
    imported = {name for one in program if one.is_import for name in one.assigned}
    modules = imported.difference(*(one.assigned for one in program if not one.is_import))
    binders: dict[tuple[str, str], list[int]] = {}
    given: set[tuple[str, str]] = set()
    for place, statement in enumerate(program):
        if place not in aside:
            file = statement.cell.file
            given |= {(name, file) for name in statement.assigned}
            for name in statement.assigned | (statement.changed - modules):
                binders.setdefault((name, file), []).append(place)
                binders.setdefault((name, ANYWHERE), []).append(place)
    return {
        name: places for name, places in binders.items() if name in given or name[1] == ANYWHERE
    }


def needed_by(function: str, file: str, program: Sequence[Statement], binders: Binders) -> set[int]:
    """The statements that a function of a file needs, by their place in `program`."""

    def meant(name: str, file: str) -> tuple[str, str]:
        return (name, file) if (name, file) in binders else (name, ANYWHERE)

    needed: set[int] = set()
    open_names = [meant(function, file)]
    seen = {*open_names}
    while open_names:
        for place in binders.get(open_names.pop(), ()):
            if place not in needed:
                needed.add(place)
                one = program[place]
                fresh = {meant(name, one.cell.file) for name in one.used} - seen
                seen |= fresh
                open_names.extend(fresh)
    return needed


def only_lines(kept: Sequence[Statement]) -> str:
    """Statements of one cell, with all other lines empty, so that a line keeps its number."""
    parts, last = [], 1
    for statement in kept:
        parts += ["\n" * (statement.first - last), statement.text]
        last = statement.last
    return "".join(parts)


def owners(needs: Mapping[str, set[int]], defining: Mapping[int, str]) -> dict[int, str | None]:
    """Whom each needed statement belongs to: a question, or None where several share it.

    A statement that defines a question's function is that question's, whoever calls it.
    """
    owner: dict[int, str | None] = {}
    for question, places in needs.items():
        for place in places:
            owner[place] = None if place in owner else question
    owner.update({place: question for place, question in defining.items() if place in owner})
    return owner


def _outside(statements: Sequence[ast.stmt]) -> Iterator[ast.AST]:
    """What is done where the statements stand: not inside the functions that they define."""
    pending: list[ast.AST] = [*statements]
    while pending:
        node = pending.pop()
        yield node
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Lambda):
            pending.extend(ast.iter_child_nodes(node))


def _assigned(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        yield node.name
    elif isinstance(node, ast.Import | ast.ImportFrom):
        yield from ((alias.asname or alias.name).split(".")[0] for alias in node.names)
    elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
        yield node.id


def _changed(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Attribute | ast.Subscript) and not isinstance(node.ctx, ast.Load):
        yield from _root(node)
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield from _root(node.value.func)  # table.append(...) changes `table`


def _root(node: ast.AST) -> Iterator[str]:
    """The name that a chain of attributes and indices starts from; none for a bare name."""
    start = node
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    if isinstance(node, ast.Name) and node is not start:
        yield node.id


def _defined(statement: ast.stmt) -> Iterator[str]:
    pending: list[ast.AST] = [statement]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign):
            yield from (target.id for target in node.targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.If | ast.Try | ast.With | ast.For):
            pending += [part for part in ast.iter_child_nodes(node) if isinstance(part, ast.stmt)]
