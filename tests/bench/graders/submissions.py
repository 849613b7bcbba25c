"""What a class hands in: right answers, known mistakes and code that fails, 6 : 2 : 2."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import count, cycle
from types import ModuleType
from typing import Any

from labkit.course.assignment import load_assignment
from labkit.course.authoring.questions import QUESTIONS, SOLUTION
from tests.course.authoring.right_answers import RIGHT, source_of

KINDS = (*("right", "mistaken", "right", "failing", "right") * 2,)
MISTAKES_EACH = 4
FAILURES = (
    "def {name}(*arguments):\n    return undefined_name",
    "def {name}(*arguments):\n    return [][1]",
    "def {name}(x:\n    return x",
    "def {name}(*arguments):\n    raise NotImplementedError",
)

Answers = dict[str, str]


def lab_answers() -> Iterator[Answers]:
    """The functions of one submission after the other; "" holds what they share."""
    mistakes = cycle(_mistaken())
    names = cycle(question.function for question in load_assignment().questions)
    failures = cycle(FAILURES)
    for number, kind in zip(count(), cycle(KINDS)):
        answers = _functions(RIGHT[0]) | _functions(RIGHT[number % len(RIGHT)])
        if kind == "mistaken":
            answers |= dict(next(mistakes) for _ in range(MISTAKES_EACH))
        elif kind == "failing":
            name = next(names)
            answers |= {name: next(failures).format(name=name)}
        yield answers


def answered(release: str, answers: Mapping[str, str]) -> str:
    """The released notebook with each function in its cell, and what they share in the first."""
    notebook: dict[str, Any] = json.loads(release)
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    for cell in code:
        if cell["metadata"].get("nbgrader", {}).get("solution"):
            name = "".join(cell["source"]).partition("def ")[2].partition("(")[0]
            cell["source"] = answers[name]
    shared = code[0]["source"]
    code[0]["source"] = "".join(shared) + "\n" + answers.get("", "")
    return json.dumps(notebook)


@cache
def _functions(module: ModuleType) -> Answers:
    """The source of each function of a right submission; helpers and imports under ""."""
    asked = {question.function for question in load_assignment().questions}
    source = source_of(module)
    parts: dict[str, list[str]] = {}
    for statement in ast.parse(source).body[1:]:
        name = getattr(statement, "name", "")
        key = name if name in asked else ""
        text = ast.get_source_segment(source, statement) or ""
        if "align_weighted(" in text and name == "align":  # a cell of a later question
            parts[key] = [_source(source, "align_weighted")]
        parts.setdefault(key, []).append(text)
    return {name: "\n\n".join(those) for name, those in parts.items()}


def _source(source: str, name: str) -> str:
    tree = ast.parse(source)
    return next(
        ast.get_source_segment(source, one) or ""
        for one in tree.body
        if getattr(one, "name", "") == name
    )


@cache
def _mistaken() -> list[tuple[str, str]]:
    """Functions that make a known mistake, as students would have written them, with their name."""
    found = []
    for name, one in ((entry.right.__name__, one) for entry in QUESTIONS for one in entry.known):
        source = SOLUTION
        for text, wrong in one.wrong.items() if isinstance(one.wrong, Mapping) else ():
            source = source.replace(text, wrong)
        function = _source(source, name)
        if function != _source(SOLUTION, name):
            found.append((name, f"import numpy as np\n\n\n{function}"))
    return found
