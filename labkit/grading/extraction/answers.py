"""Which statements of a submission are its answers, and which are stubs that nobody filled in."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable, Mapping, Sequence

from labkit.grading.extraction.statements import Statement


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


def stubs_of(program: Sequence[Statement], answers: Mapping[str, list[int]]) -> set[int]:
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
