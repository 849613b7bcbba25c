"""Cases with their answers, drawn until they tell right from wrong and one mistake from another.

A submission may compute in single precision. So a draw is taken if arguments in single precision
move the right answer by no more than a sixteenth of the question's tolerance, the rest of which is
for the roundings on the way. What is not taken is drawn again from the same generator, so that a
seed always leads to the same cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from labkit.course.authoring.entries import Exact, Recipe, Rng, question
from labkit.course.exercises.entries import Arguments, Function, answers
from labkit.grading.box.inside.data import plain
from labkit.grading.judge.compare import assess, is_answer_of, is_right
from labkit.grading.judge.kinds import read
from labkit.grading.judge.verdict import Outcome, Status
from labkit.grading.questions import Case
from labkit.support.errors import LabkitError

TRIES, SETS = 300, 20
MARGIN = 16.0
MOST = 5 / 6  # of the points, that a known mistake may keep


def visible_cases(entry: question) -> tuple[Case, ...]:
    """The cases that everybody sees; they need not reveal every mistake."""
    rng = Rng(np.random.PCG64([2024, *entry.right.__name__.encode()]))
    table = enumerate(entry.visible.items(), start=1)
    return tuple(draw_case(entry, f"v{k}", *row, rng) for k, row in table)


def hidden_cases(
    entry: question, visible: Sequence[Case], *, secret: bytes = b""
) -> tuple[Case, ...]:
    """The hidden cases, drawn from the secret; without one anybody draws the same.

    Raises `LabkitError` if no draw tells all mistakes apart, and takes a sixth of the points for
    each of them.
    """
    rng = Rng(np.random.PCG64([4711, 0, *entry.right.__name__.encode(), *secret]))
    for _ in range(SETS):
        cases = tuple(
            replace(draw_case(entry, f"h{k}", about, recipe, rng), group=group)
            for k, (group, about, recipe) in enumerate(entry.hidden_rows, start=1)
        )
        objection = objection_to(entry, (*visible, *cases))
        if not objection:
            return cases
    raise LabkitError(f"{entry.right.__name__}: {objection} (in each of {SETS} draws)")


def draw_case(entry: question, id: str, about: str, recipe: Recipe, rng: Rng) -> Case:
    """One case with its answers, drawn until its right answer does not hang on a rounding.

    The answers of mistakes that do are left out: they are others on each machine. Raises
    `LabkitError` if no draw will do, as where the solution and its oracle disagree.
    """
    asked_question = entry.asked_for
    rights = entry.apply_edits({})
    objection = ""
    is_exact = isinstance(recipe, Exact)
    drawn = recipe.drawn if isinstance(recipe, Exact) else recipe
    for _ in range(TRIES):
        arguments = drawn(rng) if callable(drawn) else drawn
        arguments = arguments if is_exact else rounded(arguments)
        expected = rounded(answers(rights, arguments))
        sizes = [
            np.nan_to_num(np.abs(read(asked_question.answer, value))).max() for value in expected
        ]
        case = Case(
            id=id,
            hidden=id.startswith("h"),
            about=about,
            arguments=arguments,
            expected=expected,
            tolerance=entry.tolerance * float(max(1.0, *sizes)),
            mistaken=rounded(entry.answers_of_mistakes(arguments)),
        )
        strict = replace(case, tolerance=case.tolerance / MARGIN)
        single = in_single_precision(arguments)
        again = entry.answers_of_mistakes(single)
        if not agree(entry, case, entry.oracles, arguments):
            objection = f"the solution and its oracle disagree, as for {arguments}"
        elif not agree(entry, strict, rights, single):
            objection = "its answer hangs on a rounding; ease its recipe"
        else:
            steady = {
                id: answers_of
                for id, answers_of in case.mistaken.items()
                if id in again
                and all(is_answer_of(id, asked_question, case, value) for value in again[id])
            }
            return replace(case, mistaken=steady)
    raise LabkitError(f"no draw of {asked_question.id}, {about!r}, will do: {objection}")


def agree(entry: question, case: Case, functions: Sequence[Function], arguments: Arguments) -> bool:
    """True if each function has the answer of its reading of the question."""
    results = answers(functions, arguments)
    return bool(results) and all(
        is_right(entry.asked_for, replace(case, expected=(expected_value,)), value)
        for expected_value, value in zip(case.expected, results, strict=False)
    )


def objection_to(entry: question, cases: Sequence[Case]) -> str:
    """The mistake that these cases do not call by its name, or hardly charge; empty for none."""
    for value in entry.known:
        for outcomes in outcomes_of(value.id, cases):
            verdict = assess(entry.asked_for, cases, outcomes)
            if verdict.misconception != value.id:
                return f"{value.id} is taken for {verdict.misconception or 'none'}; add a case"
            if verdict.score > MOST * entry.points:
                points_kept = f"{verdict.score:g} of {entry.points:g} points"
                return f"{value.id} keeps {points_kept}; add hidden cases that it fails"
    return ""


def outcomes_of(id: str, cases: Sequence[Case]) -> list[list[Outcome]]:
    """Outcomes of a mistake, one for each way that it can come out."""
    variants = range(max(len(case.mistaken.get(id, ())) for case in cases))
    failed = Outcome(status=Status.RAISED, error="ValueError")
    return [
        [
            Outcome(value=case.mistaken[id][variant]) if id in case.mistaken else failed
            for case in cases
        ]
        for variant in variants
    ]


def in_single_precision(arguments: Arguments) -> Arguments:
    """The arguments, with every entry of a float array as single precision holds it."""
    return tuple(
        value.astype(np.float32).astype(np.float64)
        if isinstance(value, np.ndarray) and value.dtype.kind == "f"
        else value
        for value in arguments
    )


def rounded(value: Any, decimals: int = 12) -> Any:
    """The value as plain data with few digits: what is left does not hang on the machine."""
    if isinstance(value, dict):
        return {id: rounded(value, decimals) for id, value in value.items()}
    value = plain(value)
    if isinstance(value, tuple):
        return tuple(rounded(value, decimals) for value in value)
    if isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
        return np.round(value, decimals) + 0.0
    return value
