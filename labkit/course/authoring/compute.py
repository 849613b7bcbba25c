"""Cases with their answers, drawn until they tell right from wrong and one mistake from another.

A draw is taken if no answer hangs on a rounding. A submission may compute in single precision: its
inputs then carry a relative error of up to ε = 2⁻²⁴ each. Such errors may move a right answer by no
more than a sixteenth of the question's tolerance, the rest of which is for the roundings on the
way, and they may not change whether a known mistake passes. What is not taken is drawn again from
the same generator, so that a seed always leads to the same cases.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from labkit.course.authoring.entries import Exact, Recipe, Rng, question
from labkit.course.exercises.entries import Arguments, Function, answers
from labkit.course.exercises.families import Family
from labkit.grading.box.inside.data import Value, plain
from labkit.grading.judge.compare import assess, is_answer_of, is_right
from labkit.grading.judge.kinds import read
from labkit.grading.judge.verdict import Outcome, Status
from labkit.grading.questions import Case, Question
from labkit.support.errors import LabkitError

Wrong = Mapping[str, tuple[Value, ...]]  # the answers of mistakes, by their ids

TRIES, SETS = 300, 20
DRAWS, MANY = 2, 4  # of perturbed arguments; many where two ways out may tie
EPSILON = 2.0**-24
MARGIN = 16.0


def visible_cases(entry: question) -> tuple[Case, ...]:
    """The cases that everybody sees; they need not reveal every mistake."""
    rng = Rng(np.random.PCG64([2024, *entry.right.__name__.encode()]))
    table = enumerate(entry.visible.items(), start=1)
    return tuple(draw_case(entry, f"v{k}", *row, rng) for k, row in table)


def hidden_cases(
    entry: question,
    variant: int,
    visible: Sequence[Case],
    *,
    secret: bytes = b"",
    like: Sequence[Case] = (),
) -> tuple[Case, ...]:
    """The hidden cases of one variant, drawn from the secret; without one anybody draws the same.

    Cases that are `like` those of another variant are passed by the same known mistakes. Raises
    `LabkitError` if no draw tells all mistakes apart.
    """
    rng = Rng(np.random.PCG64([4711, variant, *entry.right.__name__.encode(), *secret]))
    for _ in range(SETS):
        cases = tuple(
            draw_case(entry, f"h{k}", about, recipe, rng, like[k - 1] if like else None)
            for k, (about, recipe) in enumerate(entry.hidden.items(), start=1)
        )
        confused = confusion(entry, (*visible, *cases))
        if not confused:
            return cases
    raise LabkitError(f"{entry.right.__name__}: {confused} (in each of {SETS} draws)")


def draw_case(
    entry: question, id: str, about: str, recipe: Recipe, rng: Rng, like: Case | None = None
) -> Case:
    """One case with its answers, drawn until none of them hangs on a rounding.

    The answers of mistakes that slightly other arguments change are left out: they end where
    rounding leads them, somewhere else on each machine. Raises `LabkitError` if no draw will do, as
    where the solution and its oracle disagree.
    """
    asked, rights, why = entry.asked_for, entry.edited({}), ""
    exact, drawn = (True, recipe.drawn) if isinstance(recipe, Exact) else (False, recipe)
    for _ in range(TRIES):
        if like and entry.alike and not exact:
            arguments = entry.alike(rng, like.arguments)
        else:
            arguments = drawn(rng) if callable(drawn) else drawn
        arguments = arguments if exact else rounded(arguments)
        expected = rounded(answers(rights, arguments))
        sizes = [np.nan_to_num(np.abs(read(asked.answer, one))).max() for one in expected]
        case = Case(
            id=id,
            hidden=id.startswith("h"),
            about=about,
            arguments=arguments,
            expected=expected,
            tolerance=entry.tolerance * float(max(1.0, *sizes)),
            mistaken=rounded(entry.mistaken(arguments)),
        )
        strict = replace(case, tolerance=case.tolerance / MARGIN)
        near = [] if exact else perturbed(arguments, DRAWS)
        again = [entry.mistaken(one) for one in near]
        if not agree(entry, case, entry.oracles, arguments):
            why = f"the solution and its oracle disagree, as for {arguments}"
        elif not all(agree(entry, strict, rights, one) for one in near):
            why = "its answer hangs on a rounding; ease its recipe"
        elif any(passing(entry, case, one) != passing(entry, case) for one in again):
            why = "whether a mistake passes hangs on a rounding; ease its recipe"
        elif like and passing(entry, case) != passing(entry, like):
            why = "other mistakes pass than in the first variant; narrow its recipe"
        else:
            return replace(case, mistaken=settled(asked, case, again))
    raise LabkitError(f"no draw of {asked.id}, {about!r}, will do: {why}")


def agree(entry: question, case: Case, functions: Sequence[Function], arguments: Arguments) -> bool:
    """True if each function has the answer of its reading of the question."""
    found = answers(functions, arguments)
    return bool(found) and all(
        is_right(entry.asked_for, replace(case, expected=(wanted,)), one)
        for wanted, one in zip(case.expected, found, strict=False)
    )


def passing(entry: question, case: Case, mistaken: Wrong | None = None) -> set[tuple[str, int]]:
    """The known mistakes that pass a case, each with the way in which it comes out."""
    return {
        (id, way)
        for id, wrong in (case.mistaken if mistaken is None else mistaken).items()
        for way, answer in enumerate(wrong)
        if is_right(entry.asked_for, case, answer)
    }


def settled(asked: Question, case: Case, again: Sequence[Wrong]) -> Wrong:
    """The answers of those mistakes that answer the same `again`."""
    return {
        id: wrong
        for id, wrong in case.mistaken.items()
        if all(
            id in each and all(is_answer_of(id, asked, case, one) for one in each[id])
            for each in again
        )
    }


def steady_families(entry: question, case: Case) -> dict[Family, tuple[Value, ...]]:
    """The answers of the families of mistakes in the arguments that slightly other arguments do
    not change; with as many digits as tell them apart."""
    exact, found = isinstance(entry.visible[case.about], Exact), entry.families(case.arguments)
    near = [] if exact else perturbed(case.arguments, MANY)
    again = [{family.id: one for family, one in entry.families(each).items()} for each in near]
    wrong = {family.id: one for family, one in found.items()}
    known = settled(entry.asked_for, replace(case, mistaken=wrong), again)
    return {family: rounded(one, 8) for family, one in found.items() if family.id in known}


def confusion(entry: question, cases: Sequence[Case]) -> str:
    """The mistake that is not called by its name on these cases; empty where there is none."""
    for one in entry.known:
        for outcomes in outcomes_of(one.id, cases):
            named = assess(entry.asked_for, cases, outcomes).misconception
            if named != one.id:
                return f"{one.id} is taken for {named or 'none'}; add a case"
    return ""


def outcomes_of(id: str, cases: Sequence[Case]) -> list[list[Outcome]]:
    """Outcomes of a mistake, one for each way that it can come out."""
    ways = range(max(len(case.mistaken.get(id, ())) for case in cases))
    failed = Outcome(status=Status.RAISED, error="ValueError")
    return [
        [Outcome(value=case.mistaken[id][way]) if id in case.mistaken else failed for case in cases]
        for way in ways
    ]


def perturbed(arguments: Arguments, draws: int) -> list[Arguments]:
    """The arguments as often, with every entry of a float array off by up to one ε of itself."""
    rng = np.random.default_rng(0)
    return [
        tuple(
            value * (1.0 + EPSILON * rng.uniform(-1.0, 1.0, value.shape))
            if isinstance(value, np.ndarray) and value.dtype.kind == "f"
            else value
            for value in arguments
        )
        for _ in range(draws)
    ]


def rounded(value: Any, decimals: int = 12) -> Any:
    """The value as plain data with few digits: what is left does not hang on the machine."""
    if isinstance(value, dict):
        return {id: rounded(one, decimals) for id, one in value.items()}
    value = plain(value)
    if isinstance(value, tuple):
        return tuple(rounded(one, decimals) for one in value)
    if isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
        return np.round(value, decimals) + 0.0
    return value
