"""The scripts of a submission that its other files import, and the files that answers take in."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import accumulate

from labkit.course.grading.extraction.cells import RawCell, tree
from labkit.course.grading.extraction.slicing import Statement

Imports = Mapping[str, Collection[str]]  # the own scripts that each file imports
DEEPEST, LONGEST = 20, 1000  # parts of a path, and letters of a name, beyond which nobody goes


def modules_of(file: str) -> tuple[str, ...]:
    """The names that a script may be imported by, the longest first.

    >>> modules_of("my work/lab/geometry.py"), modules_of("lab/__init__.py")
    (('lab.geometry', 'geometry'), ('lab',))
    """
    parts = _package(file.removesuffix(".py").removesuffix("/__init__"))
    return tuple(".".join(parts[start:]) for start in range(len(parts)))


def own_imports(read: Mapping[str, Sequence[RawCell]]) -> Imports:
    """The scripts of the submission that each of its files imports, by name."""
    if len(read) == 1:
        return {}
    scripts: defaultdict[str, list[str]] = defaultdict(list)
    for file in read:
        for name in modules_of(file) if file.endswith(".py") else ():
            scripts[name].append(file)
    return {
        file: {
            script
            for cell in cells
            if not cell.error
            for node in ast.walk(tree(cell.source))
            for name in _imported(node, file)
            for script in scripts.get(name, ())
            if script != file
        }
        for file, cells in read.items()
    }


def taken_from(
    modules: Mapping[str, Sequence[Statement]], program: Sequence[Statement]
) -> set[str]:
    """What the program takes from the student's own scripts by name, or by ``*``."""
    scripts = {name: file for file in modules for name in modules_of(file)}
    taken: set[str] = set()
    looked_into: set[str] = set()
    pending = [*program]
    for one in pending:
        for node in one.nodes if one.is_import else ():
            if not isinstance(node, ast.ImportFrom):
                continue
            own = scripts.get(_origin(node, one.cell.file))
            names = {alias.asname or alias.name for alias in node.names} if own else set()
            taken |= names
            if own and "*" in names and own not in looked_into:
                looked_into.add(own)
                taken |= {name for inner in modules[own] for name in inner.defines}
                pending += modules[own]
    return taken


def at_work(files: Collection[str], used: Collection[str], imports: Imports) -> set[str]:
    """Those of the files that hold or import what is used, and the scripts that these import.

    A whole repository holds many others, which may need what is not there. Where nothing is
    used, all are at work.
    """
    reached = [_reached(file, imports) for file in files]
    found = [reach for reach in reached if not reach.isdisjoint(used)]
    return set().union(*(found or reached))


def _reached(file: str, imports: Imports) -> set[str]:
    """A file and all scripts that it imports, and those that they import."""
    found = [file]
    seen = {file}
    for one in found:
        fresh = {*imports.get(one, ())} - seen
        seen |= fresh
        found.extend(fresh)
    return seen


def _imported(node: ast.AST, file: str) -> Iterator[str]:
    """All that may be a module of what an import names: ``a.b`` needs ``a``, too."""
    names: list[str] = []
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        origin = _origin(node, file)[:LONGEST]
        names = [f"{origin}.{alias.name[:LONGEST]}".lstrip(".") for alias in node.names]
    for name in names:
        yield from accumulate(name[: 2 * LONGEST].split("."), lambda above, part: f"{above}.{part}")


def _origin(node: ast.ImportFrom, file: str) -> str:
    """The module from which it imports, for ``from . import x`` the package of the file."""
    above = _package(file.rsplit("/", node.level)[0]) if file.count("/") >= node.level > 0 else []
    return ".".join([*above, *([node.module] if node.module else [])])


def _package(folder: str) -> list[str]:
    """The last parts of a path that can be names in Python."""
    parts: list[str] = []
    for part in reversed(folder.split("/")):
        if not part.isidentifier() or len(parts) == DEEPEST:
            break
        parts.insert(0, part)
    return parts
