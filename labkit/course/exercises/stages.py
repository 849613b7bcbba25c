"""Looking for a fault with the student, by calls that are plainer than those that failed.

A stage is one more call of a function that has failed, with an argument in its plainest form: one
round, no gate, no guess. What the answers show is said as they show it: which argument cures the
answer, which one changes nothing, which part is right. Nothing here knows a mistake.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from labkit.grading.judge.compare import find_fault, is_answer_of, is_right, recognise
from labkit.grading.judge.kinds import Unreadable, numbers, read
from labkit.grading.judge.verdict import Outcome, Status
from labkit.grading.questions import Answer, Case, Question

Value = Any
Run = Callable[[Case], Outcome]
ASKED_CASES = 4  # of those that failed, at most: a stage has to cure all of them
FACTORS = {"more": 1.25, "less": 0.5}  # for another value of an argument: does it count?
LONG = 5  # entries of a vector from which on a range of them says something
CHANGED = 100.0  # tolerances by which the right answer moves before it has to be noticed
GIVEN = "given"  # the mistake that stands for the answer to the call as it was

COUNTS = ("rounds", "max_iterations")
LIMITS = ("gate", "max_distance", "d_max", "delta")
RATIOS = ("overlap_ratio", "ratio")
POINTS = ("p", "q", "source", "target")
PlainForm = tuple[str, Callable[[Any], Value]]  # words, and what becomes of the value
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
    """Which arguments of a stage are plain."""

    ONE = "one"
    ALL = "all"
    ALL_BUT_ONE = "all but one"
    NONE = "none"  # one is another, to see whether it counts


@dataclass(frozen=True)
class Stage:
    """A plainer call: which arguments are plain, the name of the one, words, the arguments."""

    plain: Plain
    name: str
    words: str
    arguments: tuple[Value, ...]


def stages_of(question: Question, arguments: Sequence[Value]) -> list[Stage]:
    """The plainer calls: each argument that has a plain form alone, all of them, all but one."""
    names = names_of(question)
    is_matching = question.function.endswith("icp") or any(map(is_transform, arguments))
    plain_values, words = dict[int, Value](), dict[int, str]()
    for place, (name, value) in enumerate(zip(names, arguments, strict=False)):
        phrase, plain = plain_form(name, value)
        if phrase and not np.array_equal(plain, value) and not (is_matching and name in POINTS):
            plain_values[place], words[place] = plain, phrase

    def call(kind: Plain, name: str, about: str, changes: Mapping[int, Value]) -> Stage:
        values = [changes.get(place, value) for place, value in enumerate(arguments)]
        return Stage(kind, name, about, tuple(values))

    stages = [call(Plain.ONE, names[k], words[k], {k: plain_values[k]}) for k in words]
    if len(words) > 1:
        stages.append(call(Plain.ALL, "", _join(list(words.values())), plain_values))
    if len(words) > 2:
        for place in words:
            about = f"all plain but `{names[place]}`"
            changes = {k: value for k, value in plain_values.items() if k != place}
            stages.append(call(Plain.ALL_BUT_ONE, names[place], about, changes))
    for place, (name, value) in enumerate(zip(names, arguments, strict=False)):
        if isinstance(value, float) and name not in BY_NAME and value != 0.0:
            stages.append(call(Plain.ONE, name, f"`{name}=0`", {place: 0.0}))
        if is_float(value) and place not in words and not (is_matching and name in POINTS):
            for word, factor in FACTORS.items():
                about = f"{word} `{name}`"
                stages.append(call(Plain.NONE, name, about, {place: factor * value}))
    return stages


def is_transform(value: Value) -> bool:
    """True for a (3, 3) transform of the plane."""
    is_matrix = isinstance(value, np.ndarray) and value.shape == (3, 3)
    return is_matrix and np.array_equal(value[2], (0.0, 0.0, 1.0))


def is_identity(matrix: Value) -> bool:
    """True for a square matrix that changes nothing."""
    return np.ndim(matrix) == 2 and np.array_equal(matrix, np.eye(len(matrix)))


def is_float(value: Value) -> bool:
    """True for a number, or an array of numbers, that may take any value."""
    is_array = isinstance(value, np.ndarray) and value.dtype.kind == "f"
    return isinstance(value, float) or (is_array and value.shape != (3, 3))


def names_of(question: Question) -> list[str]:
    """The names of a question's arguments."""
    return [name.strip() for name in question.signature.strip("()").split(",")]


def plain_form(name: str, value: Value) -> tuple[str, Value]:
    """The plainest form of an argument, with words for it; no words where there is none."""
    if name in BY_NAME and isinstance(value, VALUES_OF.get(name, np.ndarray)):
        words, plain = BY_NAME[name]
        return words.format(name), plain(value)
    if isinstance(value, float | int):
        return f"`{name}` positive", abs(value)
    if not isinstance(value, np.ndarray):
        return "", value
    if is_transform(value):
        return f"`{name}` the identity", np.eye(3)
    if value.shape == (2,):
        return f"`{name}` at the origin", np.zeros(2)
    return "", value


class Stages:
    """The failed cases of a question, asked again by stages.

    Parameters
    ----------
    question, failed
        The question, and the cases that the function fails.
    outcomes
        What came out of these cases.
    run
        Calls the function on the arguments of a case.
    plainer
        The cases of a case's stages, with their right answers, by the words of each.
    """

    def __init__(
        self,
        question: Question,
        failed: Sequence[Case],
        outcomes: Sequence[Outcome],
        run: Run,
        plainer: Callable[[Case], dict[str, Case]],
    ) -> None:
        self.question = question
        self.failed = list(failed)[:ASKED_CASES]
        self.given = list(outcomes)[:ASKED_CASES]
        self.stages = stages_of(question, self.failed[0].arguments)
        answered = [plainer(case) for case in self.failed]
        self.cases = {
            stage.words: [cases[stage.words] for cases in answered]
            for stage in self.stages
            if all(stage.words in cases for cases in answered)
        }
        self.outcomes = {words: list(map(run, cases)) for words, cases in self.cases.items()}
        self.stages = [stage for stage in self.stages if stage.words in self.cases]

    def sentences(self) -> Iterator[str]:
        """What the stages show, the most telling first."""
        idle = [stage for stage in self._of(Plain.ONE) if self._changes_nothing(stage)]
        unused = [f"`{stage.name}`" for stage in idle]
        for more, less in itertools.pairwise(self._of(Plain.NONE)):
            if more.name == less.name and all(map(self._changes_nothing, (more, less))):
                unused.append(f"`{more.name}`")
        for stage in idle:
            yield f"Your answer stays the same with {stage.words}, the right one does not."
        if unused:
            is_one = len(unused) == 1
            place = "Is {} used where it has to act?" if is_one else "Are {} used where they act?"
            yield place.format(_join(unused))
        cures = [s for s in self._of(Plain.ONE) if self._is_right(s) and not self._is_trivial(s)]
        if cures:
            words = _join([stage.words for stage in cures], "or with")
            names = _join(list(dict.fromkeys(f"`{stage.name}`" for stage in cures)))
            yield f"With {words} it is right: so look at the use of {names}."
        elif not unused:
            yield from self._plainest()
        yield from right_part(self.question, self.failed[0], self.given[0])

    def fits(self, mistake: str, cases: Sequence[Case], outcomes: Sequence[Outcome]) -> bool:
        """True if the mistake that explains all answers explains those of the stages, too.

        A stage at which the mistake has no answer, or one of nan, says nothing of it.
        """
        more_cases, more_outcomes = list(cases), list(outcomes)
        for words, plainer in self.cases.items():
            for case, outcome in zip(plainer, self.outcomes[words], strict=True):
                answers = [
                    numbers(self.question.answer, value) for value in case.mistaken.get(mistake, ())
                ]
                if answers and all(np.isfinite(a).all() for a in answers if not isinstance(a, str)):
                    more_cases.append(case)
                    more_outcomes.append(outcome)
        recognised = recognise(self.question, more_cases, more_outcomes)
        return recognised is not None and recognised.id == mistake

    def _of(self, plain: Plain) -> list[Stage]:
        return [stage for stage in self.stages if stage.plain is plain]

    def _plainest(self) -> Iterator[str]:
        for stage in self._of(Plain.ALL):
            if self._ends_as_given(stage):
                continue
            if self._is_right(stage):
                yield f"With {stage.words} together it is right{self._spoilers()}."
                continue
            cases, outcomes = self.cases[stage.words], self.outcomes[stage.words]
            yield f"It is wrong in the plainest call as well, with {stage.words}."
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
        return f", and wrong as soon as {_join(names, 'or')} is as given"

    def _is_right(self, stage: Stage) -> bool:
        pairs = zip(self.cases[stage.words], self.outcomes[stage.words], strict=True)
        return all(
            outcome.status is Status.RETURNED and is_right(self.question, case, outcome.value)
            for case, outcome in pairs
        )

    def _is_trivial(self, stage: Stage) -> bool:
        """True if the right answers are zero or identities: wrong functions have them as well."""
        answers = [read(self.question.answer, c.expected[0]) for c in self.cases[stage.words]]
        return not any(answer.any() for answer in answers) or all(map(is_identity, answers))

    def _ends_as_given(self, stage: Stage) -> bool:
        """True if the call has no answer, for the same reason as the one that was given."""
        plain = self.outcomes[stage.words][0]
        outcome_given = self.given[0]
        return (
            outcome_given.status is not Status.RETURNED and plain.message == outcome_given.message
        )

    def _changes_nothing(self, stage: Stage) -> bool:
        """True if all answers are as they were, where the right ones are others."""
        rows = zip(
            self.failed, self.given, self.cases[stage.words], self.outcomes[stage.words],
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


def right_part(question: Question, case: Case, outcome: Outcome) -> Iterator[str]:
    """Which entries of a vector, a mask or of several results are right, and which are not."""
    if outcome.status is not Status.RETURNED:
        return
    try:
        got, expected = (
            read(question.answer, value) for value in (outcome.value, case.expected[0])
        )
    except Unreadable:
        return
    is_long = question.answer is Answer.NUMBERS or expected.size >= LONG
    if got.shape != expected.shape or got.ndim != 1 or not is_long:
        return
    is_wrong = ~((np.abs(got - expected) <= case.tolerance) | (got == expected))
    is_wrong &= ~(np.isnan(got) & np.isnan(expected))
    if is_wrong.all() or not is_wrong.any():
        return
    if question.answer is Answer.NUMBERS:
        yield from _right_results(case, is_wrong)
    else:
        yield from _wrong_where(question, case, is_wrong)


def _right_results(case: Case, is_wrong: np.ndarray) -> Iterator[str]:
    if not isinstance(case.expected[0], tuple):
        return
    sizes = [np.asarray(part).size for part in case.expected[0]]
    parts = np.split(is_wrong, np.cumsum(sizes)[:-1])
    right_results = [str(place) for place, part in enumerate(parts, start=1) if not part.any()]
    if right_results:
        yield f"Result {_join(right_results)} is right, the other is not."


def _wrong_where(question: Question, case: Case, is_wrong: np.ndarray) -> Iterator[str]:
    """The range of an argument in which all wrong entries lie, and no right one."""
    for name, value in zip(names_of(question), case.arguments, strict=False):
        if not isinstance(value, np.ndarray) or value.shape != is_wrong.shape:
            continue
        low, high = value[is_wrong].min(), value[is_wrong].max()
        inside = (value >= low) & (value <= high)
        if (inside == is_wrong).all():
            span = f"from {low:.4g} to {high:.4g}" if high > low else f"at {low:.4g}"
            yield f"The wrong entries are those with `{name}` {span}; all others are right."
            return


def _join(words: Sequence[str], conjunction: str = "and") -> str:
    """`a`, `a and b`, `a, b and c`."""
    head = ", ".join(words[:-1])
    return f"{head} {conjunction} {words[-1]}" if head else words[-1]
