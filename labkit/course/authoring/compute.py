"""Cases with their answers, drawn until they tell right from wrong and one mistake from another.

A set of cases is good when every known mistake fails at least one of them, no two mistakes
give the same answers to all, and no answer hangs on a rounding. A set that is not is drawn
again from the same generator, so that a seed always leads to the same cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from labkit.course.authoring.cases import RECIPES
from labkit.course.authoring.entries import Mistake, Recipe, Several
from labkit.course.authoring.misconceptions import MISTAKES
from labkit.course.authoring.references import (
    LARGEST,
    LOOP_FLOOR,
    REFERENCES,
    perturbed,
    round_up,
    stop_error,
    tolerance,
)
from labkit.course.grading.assignment.questions import Case, Question
from labkit.course.grading.contract import Outcome, OutcomeStatus, Value
from labkit.course.grading.inside.data import plain
from labkit.course.grading.judging.compare import is_answer_of, is_right, recognise
from labkit.errors import LabkitError

TRIES = 200
ALIKE = 3  # draws among which one as hard as another variant's is looked for
STABLE_DRAWS = 1
MOST_BYTES = 1 << 20
DECIMALS = 12


def visible_cases(question: Question) -> tuple[Case, ...]:
    """The cases that everybody sees; they need not reveal every mistake."""
    rng = np.random.default_rng([2024, *question.id.encode()])
    recipes = RECIPES[question.id].visible
    return tuple(
        draw_case(question, recipe, f"v{number}", False, rng)
        for number, recipe in enumerate(recipes, start=1)
    )


def hidden_cases(
    question: Question,
    variant: int,
    visible: Sequence[Case],
    *,
    secret: bytes = b"",
    like: Sequence[Case] = (),
) -> tuple[Case, ...]:
    """The hidden cases of one variant, drawn from the secret; without one anybody draws the same.

    Cases that are `like` those of another variant are passed by the same known mistakes, so that
    the variants are equally hard.

    Raises
    ------
    LabkitError
        If no draw tells all mistakes apart: the recipes need another case.
    """
    rng = np.random.default_rng([4711, variant, *question.id.encode(), *secret])
    recipes = RECIPES[question.id].hidden
    confused = ""
    for _ in range(TRIES // 10):
        cases = tuple(
            _as_hard_as(like[number - 1 : number], question, recipe, f"h{number}", rng)
            for number, recipe in enumerate(recipes, start=1)
        )
        confused = confusion(question, (*visible, *cases))
        if not confused:
            return cases
    raise LabkitError(
        f"no draw of the cases of {question.id} tells its mistakes apart: {confused}; "
        f"add a case that does"
    )


def _as_hard_as(
    like: Sequence[Case], question: Question, recipe: Recipe, id: str, rng: np.random.Generator
) -> Case:
    """A case that the same known mistakes pass as that one; the nearest of `ALIKE` draws."""
    best, least = None, np.inf
    for _ in range(ALIKE):
        case = draw_case(question, recipe, id, True, rng)
        differing = passing(question, case) ^ passing(question, like[0]) if like else frozenset()
        if len(differing) < least:
            best, least = case, len(differing)
        if not differing:
            break
    assert best is not None
    return best


def passing(question: Question, case: Case) -> frozenset[tuple[str, int]]:
    """The known mistakes whose answer is right here, each with the way that it came out."""
    return frozenset(
        (id, way)
        for id, answers in case.mistaken.items()
        for way, answer in enumerate(answers)
        if is_right(question, case, answer)
    )


def draw_case(
    question: Question, recipe: Recipe, id: str, hidden: bool, rng: np.random.Generator
) -> Case:
    """One case with its answers and tolerance, drawn until none of them hangs on a rounding.

    Raises
    ------
    LabkitError
        If no draw is stable.
    """
    for _ in range(TRIES):
        arguments = recipe.draw(rng) if recipe.exact else rounded(recipe.draw(rng))
        allowed = tolerance_of(question, recipe, arguments)
        if allowed > LARGEST:
            continue
        case = Case(
            id=id,
            hidden=hidden,
            about=recipe.about,
            arguments=arguments,
            expected=rounded(REFERENCES[question.id](*arguments)),
            tolerance=allowed,
            mistaken=mistaken(question, arguments),
        )
        if recipe.exact:
            return case
        case = replace(case, mistaken=settled(question, case, np.random.default_rng(1)))
        moved = REFERENCES[question.id](*perturbed(arguments, np.random.default_rng(2)))
        if all(is_right(question, case, one) for one in moved):
            return case
    raise LabkitError(f"no draw of {question.id}, {recipe.about!r}, is stable; ease its recipe")


def tolerance_of(question: Question, recipe: Recipe, arguments: tuple[Value, ...]) -> float:
    """The tolerance of a draw; infinite where it must not be used."""
    if recipe.exact:
        return round_up(2.0**-18)
    try:
        allowed = tolerance(question.answer, REFERENCES[question.id], arguments)
    except LabkitError:  # too few pairs are left, or they are degenerate
        return np.inf
    if question.id == "icp":
        return round_up(max(allowed + stop_error(arguments), LOOP_FLOOR))
    return allowed


def mistakes_of(question: Question) -> list[Mistake]:
    """The known mistakes of a question, in the order of the catalogue."""
    return [one for one in MISTAKES if one.question == question.id]


def mistaken(question: Question, arguments: tuple[Value, ...]) -> dict[str, tuple[Value, ...]]:
    """The answers of all mistakes that give one."""
    answers = {}
    for one in mistakes_of(question):
        with np.errstate(all="ignore"):
            answer = answers_of(one, arguments)
        if answer:
            answers[one.id] = answer
    return answers


def answers_of(one: Mistake, arguments: tuple[Value, ...]) -> tuple[Value, ...]:
    """What a mistake makes of the arguments; nothing where it fails or is not finite."""
    try:
        answer = one.function(*arguments)
    except (ArithmeticError, ValueError, IndexError, np.linalg.LinAlgError):
        return ()
    several = answer.answers if isinstance(answer, Several) else (answer,)
    return rounded(several)


def rounded(values: tuple[Value, ...]) -> tuple[Value, ...]:
    """The values as plain data, to 12 decimals: what is left does not hang on the machine."""
    return tuple(_rounded(plain(value, MOST_BYTES)) for value in values)


def _rounded(value: Value) -> Value:
    if isinstance(value, tuple):
        return tuple(map(_rounded, value))
    if isinstance(value, float):
        return round(value, DECIMALS) + 0.0
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        return np.round(value, DECIMALS) + 0.0
    return value


def settled(
    question: Question, case: Case, rng: np.random.Generator
) -> dict[str, tuple[Value, ...]]:
    """The answers of the mistakes that slightly other arguments do not change.

    The others end where rounding leads them, somewhere else on each machine.
    """
    answers = dict(case.mistaken)
    for _ in range(STABLE_DRAWS):
        moved = mistaken(question, perturbed(case.arguments, rng))
        for id in list(answers):
            again = moved.get(id, ())
            if not again or not all(is_answer_of(id, question, case, one) for one in again):
                del answers[id]
    return answers


def confusion(question: Question, cases: Sequence[Case]) -> str:
    """Which mistake is not called by its name on these cases; empty where each is."""
    for one in question.misconceptions:
        for outcomes in outcomes_of(one.id, cases):
            known = recognise(question, cases, outcomes)
            if known is None or known.id != one.id:
                return f"{one.id} is taken for {known.id if known else 'none'}"
    return ""


def outcomes_of(id: str, cases: Sequence[Case]) -> list[list[Outcome]]:
    """What a mistake brings, in each of the ways that it can come out."""
    ways = max(len(case.mistaken.get(id, ())) for case in cases)
    return [
        [
            Outcome(id=case.id, status=OutcomeStatus.RETURNED, value=case.mistaken[id][way])
            if id in case.mistaken
            else Outcome(id=case.id, status=OutcomeStatus.RAISED, error="ValueError")
            for case in cases
        ]
        for way in range(ways)
    ]
