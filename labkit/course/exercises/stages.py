"""Looking for a fault with the student, by calls that are plainer than those that failed.

A stage is one more call of a function that has failed, with an argument in its plainest form: one
round, no gate, no guess. What the answers show is said as they show it: which argument cures the
answer, how one is misread, which one changes nothing, which part is right. Nothing here knows a
mistake.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from labkit.course.exercises.misreadings import is_transform, misreadings_of
from labkit.course.exercises.parts import join_words, names_of, right_part
from labkit.grading.judge.compare import find_fault, is_answer_of, is_right, recognise
from labkit.grading.judge.kinds import numbers, read
from labkit.grading.judge.verdict import Outcome, Status
from labkit.grading.questions import Case, Question

Value = Any
Run = Callable[[Case], Outcome]
ASKED_CASES = 4  # of those that failed, at most: a stage has to cure all of them
FACTORS = {"more": 1.25, "less": 0.5}  # for another value of an argument: does it count?
FEW = 3  # rows, of which none can be missed
MOST_CALLS = 8  # in which a function that goes on from its own answers has to become right
CHANGED = 100.0  # tolerances by which the right answer moves before it has to be noticed
GIVEN = "given"  # the mistake that stands for the answer to the call as it was

COUNTS = ("rounds", "max_iterations")
LIMITS = ("gate", "max_distance", "d_max", "delta")
RATIOS = ("overlap_ratio", "ratio")
POINTS = ("p", "q", "source", "target")
PlainForm = tuple[str, Callable[[Any], Value]]  # a phrase, and what becomes of the value
PLAIN_FORMS: dict[tuple[str, ...], PlainForm] = {  # by the names of the lab's arguments
    COUNTS: ("`{}=1`", lambda count: 1),
    LIMITS: ("`{}=inf`", lambda limit: math.inf),
    RATIOS: ("`{}=1`", lambda ratio: 1.0),
    ("w", "weights", "kept", "converged"): ("`{}` all 1", np.ones_like),
    ("gates",): ("one of the `{}` alone", lambda gates: tuple(gates[:1])),
    ("R",): ("`{}` the identity", lambda R: np.eye(len(R))),
    POINTS: ("`{}` centred on the origin", lambda points: points - points.mean(axis=0)),
    ("poses", "increments", "increment", "start", "step", "pose_i", "pose_j", "measured"): (
        "`{}` without a turn", lambda poses: poses * (1.0, 1.0, 0.0)),
}  # fmt: skip
VALUES_OF = dict.fromkeys(COUNTS + LIMITS + RATIOS, (float, int)) | {"gates": tuple}
BY_NAME = {name: form for names, form in PLAIN_FORMS.items() for name in names}


class Plain(Enum):
    """The arguments of a stage that are plain."""

    ONE = "one"
    ALL = "all"
    ALL_BUT_ONE = "all but one"
    NONE = "none"  # one is another, to see whether it counts
    ROW = "row"  # a row is another, to see whether it counts


@dataclass(frozen=True)
class Stage:
    """A plainer call: which arguments are plain, the name of the one, a phrase, the arguments."""

    plain: Plain
    name: str
    phrase: str
    arguments: tuple[Value, ...]


def stages_of(question: Question, arguments: Sequence[Value]) -> list[Stage]:
    """The plainer calls: each argument that has a plain form alone, all of them, all but one."""
    names = names_of(question)
    is_matching = question.function.endswith("icp") or any(map(is_transform, arguments))
    plain_values, phrases = dict[int, Value](), dict[int, str]()
    for place, (name, value) in enumerate(zip(names, arguments, strict=False)):
        phrase, plain = plain_form(name, value)
        if phrase and not np.array_equal(plain, value) and not (is_matching and name in POINTS):
            plain_values[place], phrases[place] = plain, phrase

    def call(kind: Plain, name: str, about: str, changes: Mapping[int, Value]) -> Stage:
        values = [changes.get(place, value) for place, value in enumerate(arguments)]
        return Stage(kind, name, about, tuple(values))

    stages = [call(Plain.ONE, names[k], phrases[k], {k: plain_values[k]}) for k in phrases]
    if len(phrases) > 1:
        stages.append(call(Plain.ALL, "", join_words(list(phrases.values())), plain_values))
    if len(phrases) > 2:
        for place in phrases:
            about = f"all plain but `{names[place]}`"
            changes = {k: value for k, value in plain_values.items() if k != place}
            stages.append(call(Plain.ALL_BUT_ONE, names[place], about, changes))
    for place, (name, value) in enumerate(zip(names, arguments, strict=False)):
        if isinstance(value, float) and name not in BY_NAME and value != 0.0:
            stages.append(call(Plain.ONE, name, f"`{name}=0`", {place: 0.0}))
        if is_float(value) and place not in phrases and not (is_matching and name in POINTS):
            for word, factor in FACTORS.items():
                about = f"{word} `{name}`"
                stages.append(call(Plain.NONE, name, about, {place: factor * value}))
    for length, places in places_by_length(arguments).items():
        subject = join_words([f"`{names[place]}`" for place in places])
        for word, row in {"first": 0, "last": length - 1}.items():
            changes = {place: replace_row(arguments[place], row) for place in places}
            stages.append(call(Plain.ROW, "", f"another {word} row of {subject}", changes))
    return stages


def places_by_length(arguments: Sequence[Value]) -> dict[int, list[int]]:
    """The places of the arrays that have more than a few rows, by how many they have."""
    places: dict[int, list[int]] = {}
    for place, value in enumerate(arguments):
        if isinstance(value, np.ndarray) and len(value) > FEW:
            places.setdefault(len(value), []).append(place)
    return places


def replace_row(rows: np.ndarray, row: int) -> np.ndarray:
    """Copy of an array whose given row repeats the middle one."""
    copy = rows.copy()
    copy[row] = rows[len(rows) // 2]
    return copy


def is_identity(matrix: Value) -> bool:
    """True for a square matrix that changes nothing."""
    if np.ndim(matrix) != 2:
        return False
    return np.array_equal(matrix, np.eye(len(matrix)))


def is_float(value: Value) -> bool:
    """True for a number, or an array of numbers, that may take any value."""
    is_array = isinstance(value, np.ndarray) and value.dtype.kind == "f"
    return isinstance(value, float) or (is_array and value.shape != (3, 3))


def plain_form(name: str, value: Value) -> tuple[str, Value]:
    """The plainest form of an argument, with a phrase for it; none where it has no such form."""
    if name in BY_NAME and isinstance(value, VALUES_OF.get(name, np.ndarray)):
        phrase, plain = BY_NAME[name]
        return phrase.format(name), plain(value)
    if isinstance(value, float | int):
        return f"`{name}` positive", abs(value)
    if not isinstance(value, np.ndarray):
        return "", value
    if is_transform(value):
        return f"`{name}` the identity", np.eye(3)
    if value.shape == (2,):
        return f"`{name}` at the origin", np.zeros(2)
    return "", value


def suspects_of(name: str) -> str:
    """Words for what may be wrong where an argument in its plain form makes the answer right.

    That form also hides what is computed for the argument, so the argument alone is not blamed.
    """
    if name == "delta":
        return "the residuals, and the weights or losses that `delta` gives them"
    if name in LIMITS:
        return f"the distances and what `{name}` does with them"
    if name in COUNTS:
        return "what one round hands to the next"
    return f"the use of `{name}` and what is computed with it"


def phrases_of_one(stages: Sequence[Stage]) -> set[str]:
    """The phrases of the stages in which one argument is plain."""
    return {stage.phrase for stage in stages if stage.plain is Plain.ONE}


class Stages:
    """The failed cases of a question, asked again by stages.

    Parameters
    ----------
    question, cases
        The question, and its cases, some of which the function fails.
    outcomes
        The outcomes of these cases.
    run
        Calls the function on the arguments of a case.
    plainer
        The cases of a case's stages, with their right answers, by the words of each.
    """

    def __init__(
        self,
        question: Question,
        cases: Sequence[Case],
        outcomes: Sequence[Outcome],
        run: Run,
        plainer: Callable[[Case], dict[str, Case]],
    ) -> None:
        self.question = question
        self.run = run
        self.asked = list(zip(cases, outcomes, strict=True))
        failed = [pair for pair in self.asked if not self._passes(*pair)]
        stages = [stages_of(question, case.arguments) for case, _ in failed]
        phrases = [phrases_of_one(of_case) for of_case in stages]
        alike = [pair for pair, own in zip(failed, phrases, strict=True) if own == phrases[0]]
        self.failed = [case for case, _ in alike[:ASKED_CASES]]
        self.given = [outcome for _, outcome in alike[:ASKED_CASES]]
        answered = [plainer(case) for case in self.failed]
        self.stages = [
            stage for stage in stages[0] if all(stage.phrase in cases for cases in answered)
        ]
        self.cases = {
            stage.phrase: [cases[stage.phrase] for cases in answered] for stage in self.stages
        }
        self.outcomes = {phrase: list(map(run, cases)) for phrase, cases in self.cases.items()}
        common = functools.reduce(set[str].intersection, phrases)
        self.no_cures = phrases[0] - common  # plain in one of the cases, and wrong there

    def sentences(self) -> Iterator[str]:
        """Sentences on what the stages show, the most telling first."""
        misreading = self._find_misreading()
        if misreading:
            yield f"It is right if it gets {misreading}: so look at where it uses this."
            return
        idle = [stage for stage in self._of(Plain.ONE) if self._changes_nothing(stage)]
        idle_counts = [stage for stage in idle if stage.name in COUNTS]
        unused = [f"`{stage.name}`" for stage in idle if stage not in idle_counts]
        for more, less in itertools.pairwise(self._of(Plain.NONE)):
            if more.name == less.name and all(map(self._changes_nothing, (more, less))):
                unused.append(f"`{more.name}`")
        for stage in idle:
            yield f"Your answer stays the same with {stage.phrase}, the right one does not."
        if unused:
            is_one = len(unused) == 1
            place = "Is {} used where it has to act?" if is_one else "Are {} used where they act?"
            yield place.format(join_words(unused))
        for stage in idle_counts:
            if self._is_right(stage):
                yield "It is that of one round: does a `return` inside the loop end it,"
                yield f"or is `{stage.name}` not used?"
            else:
                yield f"Is `{stage.name}` used, and does each round search with moved points?"
        if all(outcome.status is Status.RAISED for outcome in self.given):
            return  # the error's own message says more
        right = [s for s in self._of(Plain.ONE) if self._is_right(s) and not self._is_trivial(s)]
        cures = [stage for stage in right if stage not in idle_counts]
        if cures:
            phrases = join_words([stage.phrase for stage in cures], "or with")
            suspects = join_words(list(dict.fromkeys(suspects_of(stage.name) for stage in cures)))
            yield f"With {phrases} it is right: so look at {suspects}."
        elif not idle and not unused:
            for stage in filter(self._changes_nothing, self._of(Plain.ROW)):
                yield f"Your answer stays the same with {stage.phrase}, the right one does not."
            yield from self._go_on() or self._plainest()
        yield from right_part(self.question, self.failed[0], self.given[0])

    def fits(self, mistake: str) -> bool:
        """True if the mistake that explains all answers explains those of the stages, too.

        A stage at which the mistake has no answer, or one of nan, says nothing of it.
        """
        pairs = list(self.asked)
        for phrase, plainer in self.cases.items():
            for case, outcome in zip(plainer, self.outcomes[phrase], strict=True):
                answers = [
                    numbers(self.question.answer, value) for value in case.mistaken.get(mistake, ())
                ]
                if answers and all(np.isfinite(a).all() for a in answers if not isinstance(a, str)):
                    pairs.append((case, outcome))
        recognised = recognise(self.question, *zip(*pairs, strict=True))
        return recognised is not None and recognised.id == mistake

    def _find_misreading(self) -> str:
        """Phrase for the misreadings that make every answer right; empty for none."""
        names = names_of(self.question)
        calls = [(case, dict(misreadings_of(names, case.arguments))) for case, _ in self.asked]
        _, of_first = calls[0]
        fitting = [phrase for phrase in of_first if self._is_cured(calls, phrase)]
        return join_words(fitting, "or") if fitting else ""

    def _is_cured(self, calls: Sequence[tuple[Case, Mapping[str, Any]]], phrase: str) -> bool:
        """True if all calls are right once this misreading is made up for."""
        for case, misreadings in calls:
            if phrase not in misreadings:
                return False
            outcome = self.run(replace(case, arguments=misreadings[phrase]))
            if not self._passes(case, outcome):
                return False
        return True

    def _passes(self, case: Case, outcome: Outcome) -> bool:
        is_returned = outcome.status is Status.RETURNED
        return is_returned and is_right(self.question, case, outcome.value)

    def _of(self, plain: Plain) -> list[Stage]:
        return [stage for stage in self.stages if stage.plain is plain]

    def _go_on(self) -> list[str]:
        """A sentence if the function becomes right once it begins at its own answers."""
        for place, name in enumerate(names_of(self.question)):
            pairs = zip(self.failed, self.given, strict=True)
            if all(self._becomes_right(case, outcome, place) for case, outcome in pairs):
                return [
                    f"If it goes on from its own answer as `{name}`, it becomes right: does it end "
                    f"too early, or are its steps too short?"
                ]
        return []

    def _becomes_right(self, case: Case, outcome: Outcome, place: int) -> bool:
        """True if a few calls, each with the last answer as one argument, lead to the right one."""
        arguments = list(case.arguments)
        start = arguments[place]
        if not isinstance(start, np.ndarray):
            return False
        for _ in range(MOST_CALLS):
            answer = numbers(self.question.answer, outcome.value)
            is_returned = outcome.status is Status.RETURNED
            if not is_returned or isinstance(answer, str) or answer.shape != start.shape:
                return False
            arguments[place] = answer
            outcome = self.run(replace(case, arguments=tuple(arguments)))
            if self._passes(case, outcome):
                return True
        return False

    def _plainest(self) -> Iterator[str]:
        for stage in self._of(Plain.ALL):
            if self._ends_as_given(stage):
                continue
            if self._is_right(stage):
                yield f"With {stage.phrase} together it is right{self._spoilers()}."
                continue
            cases, outcomes = self.cases[stage.phrase], self.outcomes[stage.phrase]
            yield f"It is wrong in the plainest call as well, with {stage.phrase}."
            mistake = recognise(self.question, cases, outcomes)
            if mistake:
                yield f"There your answers are those of this mistake: {mistake.says}"
            else:
                fault = find_fault(self.question, cases[0], outcomes[0])
                yield f"There {fault.partition(' For ')[0]}"

    def _spoilers(self) -> str:
        """Words for each argument that spoils the plainest call when it alone is as given."""
        names = [
            f"`{stage.name}`" for stage in self._of(Plain.ALL_BUT_ONE) if not self._is_right(stage)
        ]
        if not names:
            return ", but with none of them alone"
        return f", and wrong as soon as {join_words(names, 'or')} is as given"

    def _is_right(self, stage: Stage) -> bool:
        if stage.phrase in self.no_cures:
            return False
        pairs = zip(self.cases[stage.phrase], self.outcomes[stage.phrase], strict=True)
        return all(self._passes(case, outcome) for case, outcome in pairs)

    def _is_trivial(self, stage: Stage) -> bool:
        """True if the right answers are zero or identities: wrong functions have them as well."""
        cases = self.cases[stage.phrase]
        answers = [read(self.question.answer, case.expected[0]) for case in cases]
        is_zero = not any(answer.any() for answer in answers)
        return is_zero or all(map(is_identity, answers))

    def _ends_as_given(self, stage: Stage) -> bool:
        """True if the call has no answer, for the same reason as the one that was given."""
        plain = self.outcomes[stage.phrase][0]
        outcome_given = self.given[0]
        return (
            outcome_given.status is not Status.RETURNED and plain.message == outcome_given.message
        )

    def _changes_nothing(self, stage: Stage) -> bool:
        """True if all answers are as they were, where the right ones are others."""
        rows = zip(
            self.failed, self.given, self.cases[stage.phrase], self.outcomes[stage.phrase],
            strict=True,
        )  # fmt: skip
        for case, outcome_given, plainer, outcome in rows:
            if not outcome_given.status is outcome.status is Status.RETURNED:
                return False
            loose = replace(plainer, tolerance=CHANGED * plainer.tolerance)
            if any(is_right(self.question, loose, value) for value in case.expected):
                return False
            as_given = replace(plainer, mistaken={GIVEN: (outcome_given.value,)})
            if not is_answer_of(GIVEN, self.question, as_given, outcome.value):
                return False
        return True
