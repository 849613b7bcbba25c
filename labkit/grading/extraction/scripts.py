"""The scripts of a submission that its other files import, and the files that answers take in."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence

from labkit.grading.extraction.cells import RawCell, tree
from labkit.grading.extraction.slicing import Statement

Imports = Mapping[str, Collection[str]]  # the own scripts that each file imports


def own_imports(read: Mapping[str, Sequence[RawCell]]) -> Imports:
    """The scripts of the submission that each of its files imports, by name."""
    if len(read) == 1:
        return {}
    scripts: defaultdict[str, list[str]] = defaultdict(list)
    for file in read:
        if file.endswith(".py"):
            scripts[_stem(file)].append(file)
    return {
        file: {
            script
            for cell in cells
            if not cell.error
            for node in ast.walk(tree(cell.source))
            for name in _imported(node)
            for script in scripts.get(name.split(".")[0], ())
            if script != file
        }
        for file, cells in read.items()
    }


def taken_from(
    modules: Mapping[str, Sequence[Statement]], program: Sequence[Statement]
) -> set[str]:
    """What the program takes from the student's own scripts by name, or by ``*``."""
    own = {_stem(file): statements for file, statements in modules.items()}
    taken: set[str] = set()
    for node in [node for one in program if one.is_import for node in one.nodes]:
        if isinstance(node, ast.ImportFrom) and node.module in own:
            taken |= {alias.asname or alias.name for alias in node.names}
            if "*" in taken:
                taken |= {name for one in own[node.module] for name in one.defines}
    return taken


def at_work(files: Collection[str], used: Collection[str], imports: Imports) -> set[str]:
    """Those of the files that hold or import what is used, and the scripts that these import.

    A whole repository holds many others, which may need what is not there. Where nothing is
    used, all are at work.
    """
    reached = [_reached(file, imports) for file in files]
    found = [reach for reach in reached if not reach.isdisjoint(used)]
    return set().union(*(found or reached))


def module_source(file: str, source: str) -> str:
    """Python that makes a script importable where there is no file."""
    stem = _stem(file)
    return (
        f"import sys, types\n"
        f"{stem} = sys.modules[{stem!r}] = types.ModuleType({stem!r})\n"
        f"{stem}.__file__ = {file!r}\n"
        f"exec(compile({source!r}, {file!r}, 'exec'), {stem}.__dict__)\n"
        f"del {stem}, sys, types"
    )


def _reached(file: str, imports: Imports) -> set[str]:
    """A file and all scripts that it imports, and those that they import."""
    found = [file]
    seen = {file}
    for one in found:
        fresh = {*imports.get(one, ())} - seen
        seen |= fresh
        found.extend(fresh)
    return seen


def _imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module or ""] if isinstance(node, ast.ImportFrom) else []


def _stem(file: str) -> str:
    return file.rsplit("/", 1)[-1].removesuffix(".py")
