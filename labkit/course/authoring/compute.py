"""Cases with their answers, drawn until they tell right from wrong and one mistake from another.

A set of cases is good when every known mistake fails at least one of them, no two mistakes
give the same answers to all, and no answer hangs on a rounding. A set that is not is drawn
again from the same generator, so that a seed always leads to the same cases.

A submission may compute in single precision. Its inputs then carry a relative error of up to
ε = 2⁻²⁴ each, and the answer moves by ε times the condition of the case. That is measured: the
right function is asked again with inputs that are perturbed by one ε. The tolerance is the largest
move, times a margin for the roundings on the way, and never less than a few ε of the answer's own
scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from decimal import ROUND_CEILING, Context
from typing import Any

import numpy as np

from labkit.course.authoring.entries import Exact, Recipe, Rng, question
from labkit.course.exercises.entries import Arguments, Function, answers
from labkit.course.exercises.families import Family
from labkit.course.grading.assignment.questions import Answer, Case
from labkit.course.grading.inside.data import Value, plain
from labkit.course.grading.judging.compare import assess, is_answer_of, is_right
from labkit.course.grading.judging.kinds import read
from labkit.course.grading.judging.verdict import Outcome
from labkit.support.arrays import FloatArray
from labkit.support.errors import LabkitError

Wrong = Mapping[str, tuple[Value, ...]]  # the answers of mistakes, by their ids

TRIES, SETS = 200, 20
ALIKE = 3  # draws among which one as hard as another variant's is looked for
LARGEST = 1e-3  # a tolerance beyond it says more about rounding than about skill: drawn anew
EPSILON = 2.0**-24
DRAWS, MARGIN = 4, 16.0
FLOOR = 64.0 * EPSILON
TWO_DIGITS = Context(prec=2, rounding=ROUND_CEILING)


def visible_cases(entry: question) -> tuple[Case, ...]:
    """The cases that everybody sees; they need not reveal every mistake."""
    rng = Rng(np.random.PCG64([2024, *entry.right.__name__.encode()]))
    assert not callable(entry.visible)
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

    Cases that are `like` those of another variant are as hard: two scans are its scans, turned; of
    other cases those are taken that the same known mistakes pass.

    Raises
    ------
    LabkitError
        If no draw tells all mistakes apart, or each has a mistake that earns less than the share
        of the cases that it passes.
    """
    rng = Rng(np.random.PCG64([4711, variant, *entry.right.__name__.encode(), *secret]))
    for _ in range(SETS):
        cases: list[Case] = []
        for k, (about, recipe) in enumerate(entry.hidden.items(), start=1):
            if like and entry.alike:
                recipe = entry.alike(recipe, like[k - 1].arguments)  # noqa: PLW2901
            best = draw_case(entry, f"h{k}", about, recipe, rng)
            if like:
                model = passing(entry, like[k - 1])
                for _ in range(ALIKE - 1):
                    if passing(entry, best) != model:
                        other = draw_case(entry, f"h{k}", about, recipe, rng)
                        best = min(best, other, key=lambda one: len(passing(entry, one) ^ model))
            cases.append(best)
        confused = confusion(entry, (*visible, *cases))
        if not confused:
            return tuple(cases)
    raise LabkitError(f"{entry.right.__name__}: {confused} (in each of {SETS} draws)")


def passing(entry: question, case: Case) -> set[tuple[str, int]]:
    """The known mistakes that pass a case, each with the way in which it comes out."""
    return {
        (id, way)
        for id, wrong in case.mistaken.items()
        for way, answer in enumerate(wrong)
        if is_right(entry.asked_for, case, answer)
    }


def draw_case(entry: question, id: str, about: str, recipe: Recipe, rng: Rng) -> Case:
    """One case with its answers and tolerance, drawn until none of them hangs on a rounding.

    The answers of mistakes that slightly other arguments change are left out: they end where
    rounding leads them, somewhere else on each machine.

    Raises
    ------
    LabkitError
        If no draw is stable; if the solution and its oracle disagree.
    """
    asked, rights = entry.asked_for, entry.edited({})
    exact, drawn = (True, recipe.drawn) if isinstance(recipe, Exact) else (False, recipe)
    for _ in range(TRIES):
        arguments = drawn(rng) if callable(drawn) else drawn
        if not exact:
            arguments = rounded(arguments)
        allowed = 2.0**-18 if exact else tolerance(entry, arguments)
        if allowed > LARGEST:
            continue
        case = Case(
            id=id,
            hidden=id.startswith("h"),
            about=about,
            arguments=arguments,
            expected=rounded(right_answers(rights, asked.answer, arguments)),
            tolerance=round_up(allowed),
            mistaken=rounded(entry.mistaken(arguments)),
        )
        if exact:
            return agreed(entry, case)
        moved = perturbed(arguments, np.random.default_rng(2))
        if all(is_right(asked, case, one) for one in answers(rights, moved) or (None,)):
            return agreed(entry, settled(entry, case, entry.mistaken))
    raise LabkitError(f"no draw of {asked.id}, {about!r}, is stable; ease its recipe")


def agreed(entry: question, case: Case) -> Case:
    """The case, once each reading of the solution and its oracle agree."""
    oracles = [entry.oracle] if callable(entry.oracle) else entry.oracle
    for wanted, found in zip(case.expected, answers(oracles, case.arguments), strict=True):
        if not is_right(entry.asked_for, replace(case, expected=(wanted,)), found):
            raise LabkitError(
                f"the solution of {entry.right.__name__} and its oracle disagree on "
                f"{case.about!r}: {wanted} and {found}"
            )
    return case


def settled(
    entry: question, case: Case, wrongs: Callable[[Arguments], Wrong], draws: int = 2
) -> Case:
    """The case with the answers of those mistakes that slightly other arguments do not change.

    Where two ways out tie, each draw takes the other one with even chances.
    """
    kept, rng = dict(case.mistaken), np.random.default_rng(1)
    for _ in range(draws):
        again = wrongs(perturbed(case.arguments, rng))
        for id in kept.keys() - again.keys():
            del kept[id]
        for id in list(kept):
            if not all(is_answer_of(id, entry.asked_for, case, one) for one in again[id]):
                del kept[id]
    return replace(case, mistaken=kept)


def steady_families(entry: question, case: Case) -> dict[Family, Value]:
    """The answers of the families of mistakes in the arguments that slightly other arguments do
    not change; with as many digits as tell them apart."""

    def wrongs(arguments: Arguments) -> Wrong:
        return {family.id: (one,) for family, one in entry.families(arguments).items()}

    assert not callable(entry.visible)
    found = entry.families(case.arguments)
    known = replace(case, mistaken=wrongs(case.arguments))
    if not isinstance(entry.visible[case.about], Exact):
        known = settled(entry, known, wrongs, draws=8)
    return {family: rounded(one, 8) for family, one in found.items() if family.id in known.mistaken}


def confusion(entry: question, cases: Sequence[Case]) -> str:
    """The mistake that is not called by its name on these cases, or earns less than the cases that
    it passes; empty where there is none."""
    asked, cheap = entry.asked_for, ""
    for one in asked.misconceptions:
        for outcomes in outcomes_of(one.id, cases):
            verdict = assess(asked, cases, outcomes)
            if verdict.misconception != one.id:
                return f"{one.id} is taken for {verdict.misconception or 'none'}; add a case"
            if verdict.score > round(one.credit * asked.points, 2):
                share = verdict.score / asked.points
                cheap = cheap or (
                    f"{one.id} is to earn {one.credit:g} of the points, but its cases that pass "
                    f"are worth {share:.2f}; raise its credit"
                )
    return cheap


def outcomes_of(id: str, cases: Sequence[Case]) -> list[list[Outcome]]:
    """Outcomes of a mistake, one for each way that it can come out."""
    return [
        [
            Outcome(value=case.mistaken[id][way])
            if id in case.mistaken
            else Outcome(error="ValueError")
            for case in cases
        ]
        for way in range(max(len(case.mistaken.get(id, ())) for case in cases))
    ]


def right_answers(
    rights: Sequence[Function], answer: Answer, arguments: Arguments
) -> tuple[Any, ...]:
    """The right answers to a call, one for each reading; a transform as one matrix."""
    found = tuple(plain(function(*arguments)) for function in rights)
    return tuple(read(answer, one) for one in found) if answer is Answer.TRANSFORM else found


def tolerance(entry: question, arguments: Arguments) -> float:
    """The tolerance of a case in the answer's units, rounded up to two digits; ``inf`` where the
    smallest perturbation changes the answer's shape, or too few pairs are left."""
    rng, largest, rights = np.random.default_rng(0), 0.0, entry.edited({})
    try:
        wanted = [read(entry.answer, plain(one(*arguments))) for one in rights]
        for _ in range(DRAWS):
            near = perturbed(arguments, rng)
            moved = [read(entry.answer, plain(one(*near))) for one in rights]
            largest = max(largest, *map(apart, moved, wanted))
    except ValueError:
        return math.inf
    scale = max(1.0, *(float(np.nan_to_num(np.abs(one)).max(initial=0.0)) for one in wanted))
    allowed = round_up(max(MARGIN * largest, FLOOR * scale))
    return round_up(allowed + entry.slack(arguments))


def perturbed(arguments: Arguments, rng: np.random.Generator) -> Arguments:
    """The arguments with every entry of a float array off by up to one ε of itself."""
    return tuple(
        value * (1.0 + EPSILON * rng.uniform(-1.0, 1.0, value.shape))
        if isinstance(value, np.ndarray) and value.dtype.kind == "f"
        else value
        for value in arguments
    )


def apart(a: FloatArray, b: FloatArray) -> float:
    """The largest difference of two readings; infinite where they differ in shape or in NaN."""
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any():
        return math.inf
    return float(np.nan_to_num(np.abs(a - b)).max(initial=0.0))


def round_up(number: float) -> float:
    """The next number with two digits."""
    return float(TWO_DIGITS.create_decimal(repr(float(number))))


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
