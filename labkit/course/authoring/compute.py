"""Cases with their answers, drawn until they tell right from wrong and one mistake from another.

A set of cases is good when every known mistake fails at least one of them, no two mistakes
give the same answers to all, and no answer hangs on a rounding. A set that is not is drawn
again from the same generator, so that a seed always leads to the same cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from labkit.course.authoring.entries import Arguments, Exact, Mistake, Recipe, Rng
from labkit.course.authoring.references import answers, perturbed, round_up, tolerance
from labkit.course.authoring.sections import ENTRIES
from labkit.course.grading.assignment.questions import Case, Question
from labkit.course.grading.inside.data import plain
from labkit.course.grading.judging.compare import is_answer_of, is_right, recognise
from labkit.course.grading.judging.verdict import Outcome
from labkit.se2 import apply, transform
from labkit.support.errors import LabkitError

TRIES, SETS = 200, 20
ALIKE = 3  # draws among which one as hard as another variant's is looked for
LARGEST = 1e-3  # a tolerance beyond it says more about rounding than about skill: drawn anew
DECIMALS = 12
OF_SCANS = ("icp_step", "icp")


def visible_cases(question: Question) -> tuple[Case, ...]:
    """The cases that everybody sees; they need not reveal every mistake."""
    rng = Rng(np.random.PCG64([2024, *question.id.encode()]))
    table = enumerate(ENTRIES[question.id].visible.items(), start=1)
    return tuple(draw_case(question, f"v{k}", *row, rng) for k, row in table)


def hidden_cases(
    question: Question,
    variant: int,
    visible: Sequence[Case],
    *,
    secret: bytes = b"",
    like: Sequence[Case] = (),
) -> tuple[Case, ...]:
    """The hidden cases of one variant, drawn from the secret; without one anybody draws the same.

    Cases that are `like` those of another variant are as hard: two scans are its scans, `turned`;
    of other cases those are taken that the same known mistakes pass.

    Raises
    ------
    LabkitError
        If no draw tells all mistakes apart: the recipes need another case.
    """
    rng = Rng(np.random.PCG64([4711, variant, *question.id.encode(), *secret]))
    table = ENTRIES[question.id].hidden.items()
    for _ in range(SETS):
        cases: list[Case] = []
        for k, (about, recipe) in enumerate(table, start=1):
            if like and question.id in OF_SCANS:
                recipe = turned(recipe, like[k - 1].arguments)  # noqa: PLW2901
            best = draw_case(question, f"h{k}", about, recipe, rng)
            if like:
                model = passing(question, like[k - 1])
                for _ in range(ALIKE - 1):
                    if passing(question, best) != model:
                        other = draw_case(question, f"h{k}", about, recipe, rng)
                        best = min(best, other, key=lambda one: len(passing(question, one) ^ model))
            cases.append(best)
        confused = confusion(question, (*visible, *cases))
        if not confused:
            return tuple(cases)
    raise LabkitError(
        f"no draw of the cases of {question.id} tells its mistakes apart: {confused}; "
        f"add a case that does"
    )


def turned(recipe: Recipe, arguments: Arguments) -> Recipe:
    """Two scans and a guess in frames that are turned alike: other numbers, as hard for any loop.

    Numbers on a limit are turned by right angles, which keeps them exact.
    """
    source, target, T, *limits = cast("tuple[Any, ...]", arguments)
    is_exact = isinstance(recipe, Exact)

    def draw(rng: Rng) -> Arguments:
        quarters = rng.integers(1, 4) if is_exact else rng.uniform(0.2, 3.8)
        G = transform(0.0, 0.0, quarters * np.pi / 2.0)
        G = np.rint(G) if is_exact else G
        return apply(G, source), apply(G, target), G @ T @ G.T, *limits

    return Exact(draw) if is_exact else draw


def passing(question: Question, case: Case) -> set[tuple[str, int]]:
    """The known mistakes that pass a case, each with the way in which it comes out."""
    return {
        (id, way)
        for id, wrong in case.mistaken.items()
        for way, answer in enumerate(wrong)
        if is_right(question, case, answer)
    }


def draw_case(question: Question, id: str, about: str, recipe: Recipe, rng: Rng) -> Case:
    """One case with its answers and tolerance, drawn until none of them hangs on a rounding.

    The answers of mistakes that slightly other arguments change are left out: they end where
    rounding leads them, somewhere else on each machine.

    Raises
    ------
    LabkitError
        If no draw is stable.
    """
    exact, drawn = (True, recipe.drawn) if isinstance(recipe, Exact) else (False, recipe)
    for _ in range(TRIES):
        arguments = drawn(rng) if callable(drawn) else drawn
        if not exact:
            arguments = rounded(arguments)
        allowed = 2.0**-18 if exact else tolerance(question.id, question.answer, arguments)
        if allowed > LARGEST:
            continue
        case = Case(
            id=id,
            hidden=id.startswith("h"),
            about=about,
            arguments=arguments,
            expected=rounded(answers(question.id, arguments)),
            tolerance=round_up(allowed),
            mistaken={},
        )
        if exact:
            return replace(case, mistaken=mistaken(question, arguments))
        moved = answers(question.id, perturbed(arguments, np.random.default_rng(2)))
        if all(is_right(question, case, one) for one in moved):
            return settled(question, case)
    raise LabkitError(f"no draw of {question.id}, {about!r}, is stable; ease its recipe")


def settled(question: Question, case: Case) -> Case:
    """The case with the answers of all mistakes that slightly other arguments do not change."""
    case = replace(case, mistaken=mistaken(question, case.arguments))
    again = mistaken(question, perturbed(case.arguments, np.random.default_rng(1)))
    kept = {
        id: wrong
        for id, wrong in case.mistaken.items()
        if id in again and all(is_answer_of(id, question, case, one) for one in again[id])
    }
    return replace(case, mistaken=kept)


def mistaken(question: Question, arguments: Arguments) -> dict[str, Arguments]:
    """The answers of all mistakes that give one."""
    found = {one.id: answers_of(one, arguments) for one in ENTRIES[question.id].mistakes}
    return {id: wrong for id, wrong in found.items() if wrong}


def answers_of(one: Mistake, arguments: Arguments) -> Arguments:
    """Answers of a mistake to the arguments; none where it fails."""
    try:
        with np.errstate(all="ignore"):
            return tuple(rounded(way(*arguments)) for way in one.ways)
    except (ArithmeticError, ValueError, IndexError):
        return ()


def rounded(value: Any) -> Any:
    """The value as plain data, to 12 decimals: what is left does not hang on the machine."""
    value = plain(value)
    if isinstance(value, tuple):
        return tuple(map(rounded, value))
    if isinstance(value, float):
        return round(value, DECIMALS) + 0.0
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        return np.round(value, DECIMALS) + 0.0
    return value


def confusion(question: Question, cases: Sequence[Case]) -> str:
    """The mistake that is not called by its name on these cases; empty where each is."""
    for one in question.misconceptions:
        for outcomes in outcomes_of(one.id, cases):
            known = recognise(question, cases, outcomes)
            if known is None or known.id != one.id:
                return f"{one.id} is taken for {known.id if known else 'none'}"
    return ""


def outcomes_of(id: str, cases: Sequence[Case]) -> list[list[Outcome]]:
    """Outcomes of a mistake, one for each way that it can come out."""
    ways = max(len(case.mistaken.get(id, ())) for case in cases)
    return [
        [
            Outcome(value=case.mistaken[id][way])
            if id in case.mistaken
            else Outcome(error="ValueError")
            for case in cases
        ]
        for way in range(ways)
    ]
