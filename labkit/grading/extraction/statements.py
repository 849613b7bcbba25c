"""The statements of a cell: what each of them uses, gives a value to, changes and calls."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from symtable import symtable

from labkit.grading.extraction.cells import RawCell, tree

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef

# Functions that change their first argument: numpy's, those of classes, and some others.
MUTATORS = {
    "at", "copyto", "delattr", "fill_diagonal", "heapify", "heappop", "heappush", "insort", "place",
    "put", "put_along_axis", "putmask", "setattr", "shuffle",
}  # fmt: skip
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
                tables = [symtable(self.text, "cell", "exec")]
        except RecursionError:  # it compiled, by a hair
            return frozenset()
        names: set[str] = set()
        for table in tables:
            tables.extend(table.get_children())
            names |= {
                symbol.get_name()
                for symbol in table.get_symbols()
                if (symbol.is_referenced() and (symbol.is_global() or table.get_type() == "module"))
                or symbol.is_declared_global()  # count += 1
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
    def calls(self) -> frozenset[str]:
        """Every function that it calls by a name, where it stands."""
        called = (node.func for node in _outside(self.nodes) if isinstance(node, ast.Call))
        return frozenset(function.id for function in called if isinstance(function, ast.Name))

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


def _outside(statements: Sequence[ast.stmt]) -> Iterator[ast.AST]:
    """What is done where the statements stand: not inside the functions that they define."""
    pending: list[ast.AST] = [*statements]
    while pending:
        node = pending.pop()
        yield node
        if not isinstance(node, Definition | ast.Lambda):
            pending.extend(ast.iter_child_nodes(node))


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
