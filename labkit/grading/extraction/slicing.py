"""Which statements of a submission are its answers, and which ones those need.

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
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from labkit.grading.extraction.statements import Statement

ANYWHERE = ""  # instead of the name of a file
Name = tuple[str, str]  # as a file uses it, and the file, or `ANYWHERE`
Places = defaultdict[Name, list[int]]


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
