"""From a submission's files to the source that the sandbox runs.

Answers are found by the names of the functions that the assignment asks for, so cells may
be renamed, duplicated, deleted or reordered. Of two answers to one question the later one
counts, but an untouched stub never hides an answer.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import groupby

from labkit.grading.contract import SourceCell
from labkit.grading.extraction.cells import RawCell, cells_by_file
from labkit.grading.extraction.magics import tree
from labkit.grading.extraction.slicing import (
    Statement,
    binders_of,
    needed_by,
    only_lines,
    owners,
    statements,
)

MAX_NOTES = 40
MAX_NAMES = 1000  # among which a slip is looked for


@dataclass(frozen=True, kw_only=True)
class Extraction:
    """What of a submission is graded.

    Attributes
    ----------
    cells : tuple of SourceCell
        To be run in this order.
    notes : tuple of str
        What the student should know of how the submission was read.
    """

    cells: tuple[SourceCell, ...]
    notes: tuple[str, ...]


def extract(files: Mapping[str, bytes], functions: Mapping[str, str]) -> Extraction:
    r"""Find the answers in the files of one submission.

    Parameters
    ----------
    files : mapping of str to bytes
        Names and contents of its notebooks and scripts.
    functions : mapping of str to str
        The name of the function that each question asks for, by the question's id.

    Returns
    -------
    Extraction
        A file that cannot be read costs what stands in it, and is named in the notes.

    Examples
    --------
    >>> found = extract({"a.py": b"import os\ndef f(): return os.sep\nprint(f())"}, {"q": "f"})
    >>> [(cell.question, cell.source.strip()) for cell in found.cells]
    [(None, 'import os'), ('q', 'def f(): return os.sep')]
    """
    notes: list[str] = []
    read = cells_by_file(files, notes)
    modules = _modules(read)
    raw = [cell for name in read if name not in modules for cell in read[name]]
    whole = [(place, cell) for place, cell in enumerate(raw) if not cell.error]
    program = [one for place, cell in whole for one in statements(place, cell.source)]

    answers = _answers(program, functions)
    binders = binders_of(program, aside=_stubs(program, answers))
    needs = {question: needed_by(name, program, binders) for question, name in functions.items()}
    defining = {place: question for question, places in answers.items() for place in places}
    owner = owners(needs, defining)
    owner |= {place: None for place, one in enumerate(program) if one.is_import}

    cells = [_module_cell(name, read[name][0].source) for name in modules]
    cells += _source_cells(raw, program, owner)
    cells += _broken(raw, {q: f for q, f in functions.items() if not answers[q]}, notes)
    notes += _remarks(raw, program, answers, functions)
    if len(notes) > MAX_NOTES:
        notes[MAX_NOTES:] = [f"and {len(notes) - MAX_NOTES} remarks more"]
    return Extraction(cells=tuple(cells), notes=tuple(notes))


def _answers(program: Sequence[Statement], functions: Mapping[str, str]) -> dict[str, list[int]]:
    """Where each question's function is defined; stubs alone where there is nothing else."""
    defined: dict[str, list[int]] = {}
    for place, one in enumerate(program):
        for name in one.defines:
            defined.setdefault(name, []).append(place)
    answers: dict[str, list[int]] = {}
    for question, function in functions.items():
        places = defined.get(function, [])
        answers[question] = [p for p in places if not _untouched(program[p], function)] or places
    return answers


def _stubs(program: Sequence[Statement], answers: Mapping[str, list[int]]) -> set[int]:
    """Untouched stubs of functions that are answered elsewhere."""
    chosen = {place for places in answers.values() for place in places}
    return {
        place
        for place, one in enumerate(program)
        if place not in chosen and any(_untouched(one, name) for name in one.defines)
    }


def _untouched(statement: Statement, function: str) -> bool:
    """Whether a function still is the stub that was handed out."""
    for node in statement.nodes:
        if isinstance(node, ast.FunctionDef) and node.name == function:
            body = [line for line in node.body if not _is_constant(line)]
            return not body or (len(body) == 1 and _gives_up(body[0]))
    return False


def _is_constant(line: ast.stmt) -> bool:
    """A docstring, an ellipsis, or `pass`."""
    return isinstance(line, ast.Pass) or (
        isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)
    )


def _gives_up(line: ast.stmt) -> bool:
    return isinstance(line, ast.Raise) and any(
        isinstance(node, ast.Name) and node.id.startswith("NotImplemented")
        for node in ast.walk(line)
    )


def _source_cells(
    raw: Sequence[RawCell], program: Sequence[Statement], owner: Mapping[int, str | None]
) -> list[SourceCell]:
    """The needed statements, those of one cell and one owner together; each import alone."""

    def group(place: int) -> tuple[int, str | None, int]:
        one = program[place]
        return one.cell, owner[place], place if one.is_import else -1

    cells = []
    for (cell, question, _), places in groupby(sorted(owner), key=group):
        source = only_lines([program[place] for place in places])
        cells.append(SourceCell(source=source, question=question, label=raw[cell].label))
    return cells


def _broken(
    raw: Sequence[RawCell], missing: Mapping[str, str], notes: list[str]
) -> list[SourceCell]:
    """Cells with a syntax error: whole, for the question that finds its answer there alone."""
    cells = []
    for cell in raw:
        if not cell.error:
            continue
        notes.append(f"{cell.label} is not Python, so nothing in it counts: {cell.error}")
        cells += [
            SourceCell(source=cell.source, question=question, label=cell.label)
            for question, function in missing.items()
            if re.search(rf"^[ \t]*def[ \t]+{function}\b", cell.source, re.MULTILINE)
        ]
    return cells


def _remarks(
    raw: Sequence[RawCell],
    program: Sequence[Statement],
    answers: Mapping[str, list[int]],
    functions: Mapping[str, str],
) -> list[str]:
    """What is worth saying about missing and repeated answers."""
    defined = {name for one in program for name in one.bound}
    remarks = []
    for question, function in functions.items():
        labels = [raw[program[place].cell].label for place in answers[question]]
        if len(labels) > 1:
            remarks.append(
                f"`{function}` is defined {len(labels)} times; the last one counts, in {labels[-1]}"
            )
        elif function not in defined:
            near = get_close_matches(function, sorted(defined)[:MAX_NAMES], n=1, cutoff=0.8)
            if near:
                remarks.append(f"there is no `{function}`, but `{near[0]}`: is that a slip?")
    return remarks


def _modules(read: Mapping[str, list[RawCell]]) -> list[str]:
    """The scripts that another file of the submission imports, by name."""
    if len(read) == 1:
        return []
    imported = {
        (name.split(".")[0], file)
        for file, cells in read.items()
        for cell in cells
        if not cell.error
        for node in ast.walk(tree(cell.source))
        for name in _imported(node)
    }
    return [
        file
        for file, cells in read.items()
        if file.endswith(".py")
        and cells
        and any(stem == _stem(file) and other != file for stem, other in imported)
    ]


def _imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module or ""] if isinstance(node, ast.ImportFrom) else []


def _stem(file: str) -> str:
    return file.rsplit("/", 1)[-1].removesuffix(".py")


def _module_cell(file: str, source: str) -> SourceCell:
    """A script of the student's own, made importable without a file."""
    stem = _stem(file)
    return SourceCell(
        source=(
            f"import sys, types\n"
            f"{stem} = sys.modules[{stem!r}] = types.ModuleType({stem!r})\n"
            f"exec(compile({source!r}, {file!r}, 'exec'), {stem}.__dict__)\n"
            f"del {stem}, sys, types"
        ),
        question=None,
        label=file,
    )
