"""The statements of a cell: what each of them uses, gives a value to, changes and calls."""

from __future__ import annotations

import ast
import symtable
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from labkit.grading.extraction.cells import RawCell, tree

COMPILER: Any = symtable  # with its flags, which no type stub knows

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef

# Functions that change their first argument: numpy's, those of classes, and some others.
MUTATORS = {
    "at", "copyto", "delattr", "fill_diagonal", "heapify", "heappop", "heappush", "insort", "place",
    "put", "put_along_axis", "putmask", "setattr", "shuffle",
}  # fmt: skip
# Nodes by what they may do where they stand; into those of CLOSED nobody looks.
DEFINING = {ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef}
BINDING = DEFINING | {ast.Import, ast.ImportFrom, ast.Name}
CHANGING = {ast.Attribute, ast.Subscript, ast.Expr}
CLOSED = DEFINING | {ast.Lambda, ast.Name, ast.Constant}
EMPTY = {ast.Load, ast.Store, ast.Del}
CLASSES = {"bytearray", "defaultdict", "deque", "dict", "list", "ndarray", "object", "set"}


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
                top: Any = symtable.symtable(self.text, "cell", "exec")
        except RecursionError:  # it compiled, by a hair
            return frozenset()
        # The compiler's own tables: asked for a symbol, the module's objects go through all
        # functions each time, which takes minutes where there are many.
        tables = [top._table]
        names: set[str] = set()
        for table in tables:
            tables.extend(table.children)
            for name, flags in table.symbols.items():
                scope = flags >> COMPILER.SCOPE_OFF & COMPILER.SCOPE_MASK
                outside = scope == COMPILER.GLOBAL_IMPLICIT or table is top._table
                declared = scope == COMPILER.GLOBAL_EXPLICIT  # count += 1 after `global count`
                if declared or (flags & COMPILER.USE and outside):
                    names.add(name)
        return frozenset(names)

    @property
    def assigned(self) -> frozenset[str]:
        """Every name that it gives a value to."""
        return self._done_here[0]

    @property
    def changed(self) -> frozenset[str]:
        """Every name whose value it may change in place."""
        return self._done_here[1]

    @property
    def calls(self) -> frozenset[str]:
        """Every function that it calls by a name, where it stands."""
        return self._done_here[2]

    @cached_property
    def _done_here(self) -> tuple[frozenset[str], frozenset[str], frozenset[str]]:
        """What is assigned, changed and called, found on one way through the tree."""
        assigned: set[str] = set()
        changed: set[str] = set()
        calls: set[str] = set()
        for node in _outside(self.nodes):
            kind = type(node)
            if kind is ast.Call:
                if type(node.func) is ast.Name:
                    calls.add(node.func.id)
            elif kind in BINDING:
                assigned.update(_assigned(node))
            elif kind in CHANGING:
                changed.update(_changed(node))
        return frozenset(assigned), frozenset(changed), frozenset(calls)

    @cached_property
    def reaches(self) -> frozenset[str]:
        """Every global that a call of what it defines may give a value to, or change in place."""
        inside = [node for one in self._definitions for node in ast.walk(one)]
        told = {name for node in inside if isinstance(node, ast.Global) for name in node.names}
        return frozenset(told | {name for node in inside for name in _changed(node)} & self.used)

    @property
    def is_definition(self) -> bool:
        """Whether it defines a function or a class."""
        return bool(self._definitions)

    @property
    def _definitions(self) -> list[Definition]:
        return [node for node in self.nodes if isinstance(node, Definition)]

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


def _outside(statements: Sequence[ast.stmt]) -> Iterator[Any]:
    """What is done where the statements stand: not inside the functions that they define."""
    pending: list[Any] = [*statements]
    while pending:
        node = pending.pop()
        yield node
        if type(node) not in CLOSED:
            for field in node._fields:
                part = getattr(node, field, None)
                if type(part) is list:
                    pending += [one for one in part if isinstance(one, ast.AST)]
                elif isinstance(part, ast.AST) and type(part) not in EMPTY:
                    pending.append(part)


def _assigned(node: ast.AST) -> Iterator[str]:
    if isinstance(node, Definition):
        yield node.name
    elif isinstance(node, ast.Import | ast.ImportFrom):
        yield from ((alias.asname or alias.name).split(".")[0] for alias in node.names)
    elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
        yield node.id


def _changed(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Attribute | ast.Subscript) and not isinstance(node.ctx, ast.Load):
        yield from _root(node)
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        call = node.value
        if isinstance(call.func, ast.Attribute | ast.Subscript):
            yield from _root(call.func)  # table.append(...) changes `table`
        if call.args and _changes_its_argument(call.func):
            yield from _root(call.args[0])


def _changes_its_argument(function: ast.expr) -> bool:
    """Whether it is known to: ``setattr``, ``np.copyto``, ``dict.update``."""
    if isinstance(function, ast.Attribute):
        return function.attr in MUTATORS or _last_name(function.value) in CLASSES
    return _last_name(function) in MUTATORS


def _last_name(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def _root(node: ast.AST) -> Iterator[str]:
    """The name that a chain of attributes and indices starts from, if it is one."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    if isinstance(node, ast.Name):
        yield node.id


def _defined(statement: ast.stmt) -> Iterator[str]:
    pending: list[ast.AST] = [statement]
    while pending:
        node = pending.pop()
        if isinstance(node, Definition):
            yield node.name
        elif isinstance(node, ast.Assign):
            yield from (target.id for target in node.targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.If | ast.Try | ast.With | ast.For):
            pending += [part for part in ast.iter_child_nodes(node) if isinstance(part, ast.stmt)]
