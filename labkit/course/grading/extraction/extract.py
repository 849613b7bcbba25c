"""From a submission's files to the source that the sandbox runs.

Answers are found by the names of the functions that the assignment asks for, so cells may
be renamed, duplicated, deleted or reordered. Of two answers to one question the later one
counts, or of two in different files the one in the file that answers more questions: beside
the assignment, a chapter or a report changes nothing. Neither an untouched stub nor an import
ever hides an answer.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import groupby

from labkit.course.grading.extraction.cells import RawCell, cells_by_file
from labkit.course.grading.extraction.passages import passages
from labkit.course.grading.extraction.scripts import at_work, modules_of, own_imports, taken_from
from labkit.course.grading.extraction.slicing import (
    ANYWHERE,
    Statement,
    links_of,
    needed_by,
    statements,
)

MAX_NOTES = 40
MAX_NAMES = 1000  # among which a slip is looked for
HANDED_OUT = {"np": "import numpy as np"}  # what the assignment imports for its answers


@dataclass(frozen=True, kw_only=True)
class SourceCell:
    """A piece of a submission, run as a whole.

    Attributes
    ----------
    source : str
        Plain Python; notebook magics are already neutralised.
    question : str or None
        The question that pays if this cell hangs or crashes; None for shared code
        (imports, helpers). Cells run in the order given, shared or not.
    label : str
        What a message calls it: "cell 7", "line 30 of answer.py".
    modules : tuple of str
        Where other cells import it, by which names: it runs when they do.
    """

    source: str
    question: str | None
    label: str
    modules: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Extraction:
    """What of a submission is graded.

    Attributes
    ----------
    cells : tuple of SourceCell
        To be run in this order.
    notes : tuple of str
        What the student should know of how the submission was read.
    unread : tuple of str
        What could not be read, and why: for the student and the instructor.
    passages : tuple of int
        Marks of the code; see `labkit.course.grading.extraction.passages`.
    """

    cells: tuple[SourceCell, ...] = ()
    notes: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()
    passages: tuple[int, ...] = ()


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
        A file that cannot be read costs what stands in it, and is named.

    Examples
    --------
    >>> found = extract({"a.py": b"import os\ndef f(): return os.sep\nprint(f())"}, {"q": "f"})
    >>> [(cell.question, cell.source.strip()) for cell in found.cells]
    [(None, 'import os'), ('q', 'def f(): return os.sep')]
    """
    notes: list[str] = []
    unread: list[str] = []
    read = cells_by_file(files, unread)
    imports = own_imports(read)
    imported = set().union(*imports.values())
    modules = {file: _statements(read[file]) for file in read if read[file] and file in imported}
    parts = [_statements(read[name]) for name in read if name not in modules]
    program = [one for part in by_answers(parts, functions.values()) for one in part]

    answers = answers_of(program, functions, taken_from(modules, program))
    owner = owners(_needs(program, answers, functions), answers)
    used = {program[place].cell.file for place in owner}
    asked = {*functions.values()}
    used |= {name for name in modules if any(one.defines & asked for one in modules[name])}
    working = at_work([name for name in read if name not in modules], used, imports)
    owner |= {
        place: None
        for place, one in enumerate(program)
        if one.is_import and one.cell.file in working
    }

    cells = _put_back(program, owner, notes)
    cells += [
        SourceCell(source=read[name][0].source, question=None, label=name, modules=modules_of(name))
        for name in modules
        if name in working
    ]
    cells += _source_cells(program, owner)
    broken = [cell for name in read if name not in modules for cell in read[name] if cell.error]
    cells += _broken(broken, {q: f for q, f in functions.items() if not answers[q]}, notes)
    notes += _remarks(program, answers, functions)
    return Extraction(
        cells=tuple(cells),
        notes=_first(notes),
        unread=_first(unread),
        passages=passages(cell.source for cell in cells),
    )


def _first(remarks: Sequence[str]) -> tuple[str, ...]:
    more = len(remarks) - MAX_NOTES
    return (*remarks[:MAX_NOTES], f"and {more} remarks more") if more > 0 else tuple(remarks)


def _statements(cells: Sequence[RawCell]) -> list[Statement]:
    return [one for cell in cells if not cell.error for one in statements(cell)]


def by_answers(
    files: Iterable[Sequence[Statement]], functions: Collection[str]
) -> list[Sequence[Statement]]:
    """The files, those that answer more questions later: there the assignment is written.

    Among equals in that, those come later that hold more of its functions at all.
    """

    def weight(file: Sequence[Statement]) -> tuple[int, int]:
        asked = [(one, name) for one in file for name in one.defines if name in functions]
        answered = {name for one, name in asked if not is_untouched(one, name)}
        return len(answered), len({name for _, name in asked})

    return sorted(files, key=weight)


def answers_of(
    program: Sequence[Statement], functions: Mapping[str, str], imported: Collection[str]
) -> dict[str, list[int]]:
    """Where each question's function is defined; stubs alone where there is nothing else.

    `imported` names those that come from a script of the student's own.
    """
    defined: dict[str, list[int]] = {}
    for place, one in enumerate(program):
        for name in one.defines:
            defined.setdefault(name, []).append(place)
    answers: dict[str, list[int]] = {}
    for question, function in functions.items():
        places = defined.get(function, [])
        written = [place for place in places if not is_untouched(program[place], function)]
        answers[question] = written or ([] if function in imported else places)
    return answers


def stubs_of(program: Sequence[Statement], answers: Mapping[str, Sequence[int]]) -> set[int]:
    """Untouched stubs of functions that are answered elsewhere."""
    chosen = {place for places in answers.values() for place in places}
    return {
        place
        for place, one in enumerate(program)
        if place not in chosen and any(map(_is_stub, one.nodes))
    }


def is_untouched(statement: Statement, function: str) -> bool:
    """Whether a function still is the stub that was handed out."""
    return any(_is_stub(node) and getattr(node, "name", "") == function for node in statement.nodes)


def _is_stub(node: ast.stmt) -> bool:
    if not isinstance(node, ast.FunctionDef):
        return False
    body = [line for line in node.body if not _is_constant(line)]
    return not body or (len(body) == 1 and _gives_up(body[0]))


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


def _needs(
    program: Sequence[Statement],
    answers: Mapping[str, Sequence[int]],
    functions: Mapping[str, str],
) -> dict[str, set[int]]:
    """The statements that each question's answer needs, but for those that only try answers."""
    links = links_of(program, aside=stubs_of(program, answers))
    files = {q: program[at[-1]].cell.file if at else ANYWHERE for q, at in answers.items()}
    own = [needed_by(name, files[question], links) for question, name in functions.items()]
    tried = set().union(*own)
    return {q: needed_by(name, files[q], links, tried) for q, name in functions.items()}


def owners(
    needs: Mapping[str, set[int]], answers: Mapping[str, Sequence[int]]
) -> dict[int, str | None]:
    """Whom each needed statement belongs to: a question, or None where several share it.

    A statement that defines a question's function is that question's, whoever calls it.
    """
    owner: dict[int, str | None] = {}
    for question, places in needs.items():
        for place in places:
            owner[place] = None if place in owner else question
    defining = {place: question for question, places in answers.items() for place in places}
    owner.update({place: question for place, question in defining.items() if place in owner})
    return owner


def _source_cells(
    program: Sequence[Statement], owner: Mapping[int, str | None]
) -> list[SourceCell]:
    """The needed statements, those of one cell and one owner together.

    Each import stands alone, and before all else: so it replaces nothing that is defined.
    """

    def group(place: int) -> tuple[str, str | None, int]:
        one = program[place]
        return one.cell.label, owner[place], place if one.is_import else -1

    cells = []
    order = sorted(owner, key=lambda place: (not program[place].is_import, place))
    for (label, question, _), places in groupby(order, key=group):
        source = only_lines([program[place] for place in places])
        cells.append(SourceCell(source=source, question=question, label=label))
    return cells


def only_lines(kept: Sequence[Statement]) -> str:
    """Statements of one cell, with all other lines empty, so that a line keeps its number."""
    parts, last = [], 1
    for statement in kept:
        parts += ["\n" * (statement.first - last), statement.text]
        last = statement.last
    return "".join(parts)


def _broken(
    broken: Sequence[RawCell], missing: Mapping[str, str], notes: list[str]
) -> list[SourceCell]:
    """Cells with a syntax error: whole, for the question that finds its answer there alone."""
    cells = []
    for cell in broken:
        notes.append(f"{cell.label} is not Python, so nothing in it counts: {cell.error}")
        cells += [
            SourceCell(source=cell.source, question=question, label=cell.label)
            for question, function in missing.items()
            if re.search(rf"^[ \t]*def[ \t]+{function}\b", cell.source, re.MULTILINE)
        ]
    return cells


def _remarks(
    program: Sequence[Statement],
    answers: Mapping[str, list[int]],
    functions: Mapping[str, str],
) -> list[str]:
    """What is worth saying about missing and repeated answers."""
    defined = {name for one in program for name in one.assigned | one.changed}
    remarks = []
    for question, function in functions.items():
        cells = [program[place].cell for place in answers[question]]
        if len(cells) > 1:
            one_file = cells[0].file == cells[-1].file
            which = "last one" if one_file else "one beside most other answers"
            remarks.append(
                f"`{function}` is defined {len(cells)} times; the {which} counts, "
                f"in {cells[-1].label}"
            )
        elif function not in defined:
            near = get_close_matches(function, sorted(defined)[:MAX_NAMES], n=1, cutoff=0.8)
            if near:
                remarks.append(f"there is no `{function}`, but `{near[0]}`: is that a slip?")
    return remarks


def _put_back(
    program: Sequence[Statement], owner: Mapping[int, str | None], notes: list[str]
) -> list[SourceCell]:
    """The handed-out imports that the answers use and that are gone, and a note on each."""
    used = set().union(*(program[place].used for place in owner))
    given = set().union(*(one.assigned for one in program))
    cells = []
    for name, source in HANDED_OUT.items():
        if name in used and name not in given and "*" not in given:
            notes.append(
                f"`{name}` is used and never imported: put `{source}` back; it was run here"
            )
            cells.append(SourceCell(source=source, question=None, label=source))
    return cells
