"""The statements of a program, and which of them a function needs: a program slice [1]_.

A notebook holds plots, prints, experiments and half-finished loops beside the answers. Kept of
it are, for each function that is asked for, the statements that give a value to a name it uses,
and to the names that those use. What is left out cannot hang the grader, ask for input, or fail.

References
----------
.. [1] Weiser, "Program slicing", IEEE Transactions on Software Engineering 10(4), 1984.
"""

from __future__ import annotations

import ast
import symtable
import warnings
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from labkit.course.grading.extraction.cells import RawCell, tree

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
ANYWHERE = ""  # instead of the name of a file
Name = tuple[str, str]  # as a file uses it, and the file, or `ANYWHERE`
Places = defaultdict[Name, list[int]]


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


@dataclass(frozen=True, kw_only=True)
class Links:
    """What connects the statements of a program, each by its place in it.

    Attributes
    ----------
    program : sequence of Statement
    binders : mapping of names to places
        The statements that may change what a name stands for. A name means what its own file
        gives it, and what all of them do where that gives it none.
    setters : mapping of names to places
        The definitions of functions that may change it when they are called.
    users : mapping of names to places
        The statements that call a function where they stand, and the definitions that use it.
    """

    program: Sequence[Statement]
    binders: Places = field(default_factory=lambda: defaultdict(list))
    setters: Places = field(default_factory=lambda: defaultdict(list))
    users: Places = field(default_factory=lambda: defaultdict(list))

    def meant(self, name: str, file: str) -> Name:
        """A name that a file uses."""
        return (name, file) if (name, file) in self.binders else (name, ANYWHERE)


def links_of(program: Sequence[Statement], aside: Collection[int] = ()) -> Links:
    """The links of a program.

    Statements in `aside` (an untouched stub) are passed over. A call on an imported module
    (``np.random.seed(0)``, ``plt.show()``) changes no value of the submission's.
    """
    imported = {name for one in program if one.is_import for name in one.assigned}
    modules = imported.difference(*(one.assigned for one in program if not one.is_import))
    kept = [(place, one) for place, one in enumerate(program) if place not in aside]
    given = {(name, one.cell.file) for _, one in kept for name in one.assigned}
    links = Links(program=program)
    for place, one in kept:
        file = one.cell.file
        for name in one.assigned | (one.changed - modules):
            links.binders[name, ANYWHERE].append(place)
            if (name, file) in given:
                links.binders[name, file].append(place)
        for name in one.reaches - modules:
            links.setters[name, ANYWHERE].append(place)
            links.setters[name, file].append(place)
        for name in one.used if one.is_definition else one.calls:
            links.users[name, file].append(place)
    return links


def needed_by(
    function: str, file: str, links: Links, tried: Collection[int] | None = None
) -> set[int]:
    """The statements that a function of a file needs, by their place in the program.

    Those are left out that only call a function which is given in `tried`: they try an answer.
    Where `tried` is not given, no call counts.
    """
    needed: set[int] = set()
    open_names = [links.meant(function, file)]
    seen = {*open_names}
    passed = None if tried is None else {*tried}
    while open_names:
        name = open_names.pop()
        callers = () if passed is None else _callers(name, links, passed)
        for place in (*links.binders.get(name, ()), *callers):
            if place not in needed:
                needed.add(place)
                one = links.program[place]
                fresh = {links.meant(used, one.cell.file) for used in one.used} - seen
                seen |= fresh
                open_names.extend(fresh)
    return needed


def _callers(name: Name, links: Links, passed: set[int]) -> Iterator[int]:
    """The statements whose calls may change a name, but for calls of definitions in `passed`.

    Definitions that are looked at are added to `passed`.
    """
    pending = [*links.setters.get(name, ())]
    while pending:
        place = pending.pop()
        one = links.program[place]
        if not one.is_definition:
            yield place
        elif place not in passed:
            passed.add(place)
            for defined in one.assigned:
                pending += links.users.get((defined, one.cell.file), ())
