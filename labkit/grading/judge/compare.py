"""Judging outcomes, in the grader and in `check`: right or wrong, and which known mistake it was.

The answers that are compared with are data; nothing here computes one.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from labkit.grading.box.inside.data import Value
from labkit.grading.judge.kinds import Unreadable, numbers, read, sentences
from labkit.grading.judge.relations import relations
from labkit.grading.judge.verdict import (
    CaseVerdict,
    Outcome,
    QuestionVerdict,
    Status,
    withhold,
)
from labkit.grading.questions import Answer, Case, Misconception, Question
from labkit.support.arrays import FloatArray

ADVICE_ON = {
    "ModuleNotFoundError": "that package is not installed where the grading runs",
    "FileNotFoundError": "no file is there while grading, so keep the answers free of files",
    "EOFError": "nobody types while grading, so take `input` out",
}
NOT_TRIED = "it was not tried, since an earlier call took too long."
ADVICE = {
    Status.NOT_DEFINED: "there is no function `{function}`{detail}.",
    Status.NOT_WRITTEN: "it is not written yet.",
    Status.NO_RESULT: "the result is wrong, or there is none.",
    Status.TOO_LONG: "it took too long; does a loop have no end?",
    Status.KILLED: "the program ended in it: too much memory, an exit, or a call without an end.",
    Status.CHANGED: "it changed an argument in place{detail}; work on a copy.",
}

ALL_VISIBLE = "All visible cases pass; grading tries others."


def assess(
    question: Question, cases: Sequence[Case], outcomes: Sequence[Outcome]
) -> QuestionVerdict:
    """The verdict on one question: its cases, the known mistake if there is one, the score.

    The score is the share of the groups of hidden cases of which all pass. Visible cases, whose
    answers are handed out, count where there are no hidden ones.
    """
    faults = [find_fault(question, *pair) for pair in zip(cases, outcomes, strict=True)]
    mistake = recognise(question, cases, outcomes)
    groups = passed_groups(cases, faults)
    share = sum(groups.values()) / len(groups)
    told = [
        withhold(outcome) if fault and case.hidden else outcome
        for case, outcome, fault in zip(cases, outcomes, faults, strict=True)
    ]
    message, is_said = _message(question, cases, told, faults, mistake)
    return QuestionVerdict(
        question=question.id,
        title=question.title,
        points=question.points,
        score=round(question.points * share, 2),
        cases=tuple(
            CaseVerdict(
                id=case.id,
                hidden=case.hidden,
                passed=not fault,
                reason=f"{_capitalise(case.about)}: {fault}" if fault and not is_said else "",
                status=outcome.status,
            )
            for case, outcome, fault in zip(cases, told, faults, strict=True)
        ),
        misconception=mistake.id if mistake else None,
        message=message,
    )


def passed_groups(cases: Sequence[Case], faults: Sequence[str]) -> dict[str, bool]:
    """Of each group of cases that counts: whether all of its cases pass."""
    is_graded = any(case.hidden for case in cases)
    groups = dict[str, bool]()
    for case, fault in zip(cases, faults, strict=True):
        if case.hidden or not is_graded:
            name = case.group or case.id
            groups[name] = groups.get(name, True) and not fault
    return groups


def find_fault(question: Question, case: Case, outcome: Outcome) -> str:
    """Fault of one call, in a few sentences; "" where it is right.

    That of a hidden case is one sentence for a wrong result and for none: whatever else it told
    could be made to spell out an input.
    """
    if outcome.status is Status.RETURNED and is_right(question, case, outcome.value):
        return ""
    outcome = withhold(outcome) if case.hidden else outcome
    if outcome.status is not Status.RETURNED:
        return _no_value(question, outcome)
    got = _read(question.answer, outcome.value)
    if isinstance(got, str):
        return f"{got}."
    expected = _accepted_answers(question.answer, case)[0]
    got = _settle_ties(got, expected, question, case)
    summary, *details = sentences(question, case, got, expected)
    return " ".join([summary, *map(_capitalise, details)])


def recognise(
    question: Question, cases: Sequence[Case], outcomes: Sequence[Outcome]
) -> Misconception | None:
    """The one known mistake that gives all these answers, right and wrong ones; or None.

    A call that brought no answer speaks neither for a mistake nor against it. Where a listed
    mistake has no answer, any wrong one fits. Where none is listed, relations of the answers to the
    right ones are tried; answers in whole numbers agree by chance, so one relation alone counts.
    """
    results = [
        (case, outcome.value, is_right(question, case, outcome.value))
        for case, outcome in zip(cases, outcomes, strict=True)
        if outcome.status is Status.RETURNED
    ]
    failed_cases = [case for case, _, passed in results if not passed]
    if not failed_cases:
        return None

    def explains(mistake: Misconception) -> bool:
        return any(mistake.id in case.mistaken for case in failed_cases) and all(
            is_answer_of(mistake.id, question, case, value)
            for case, value, passed in results
            if passed or mistake.id in case.mistaken
        )

    listed = [mistake for mistake in question.misconceptions if explains(mistake)]
    if listed:
        return listed[0] if len(listed) == 1 else None
    values = [numbers(question.answer, value) for _, value, passed in results if not passed]
    if not any(isinstance(value, str) or np.isfinite(value).any() for value in values):
        return None  # a division by zero
    shared = _relations(question, results)
    answers = [
        answer for case in failed_cases for answer in _accepted_answers(question.answer, case)
    ]
    is_whole = all((answer == np.round(answer)).all() for answer in answers)
    if not shared or (is_whole and len(shared) > 1):
        return None
    return Misconception(id=shared[0], says=shared[0], chapter=question.chapter)


def _relations(question: Question, results: Sequence[tuple[Case, Value, bool]]) -> list[str]:
    """The relations to the right answers that all answers have.

    A relation that leaves a right answer as it is explains no wrong one: what is positive has lost
    no sign.
    """
    shared = list(relations(question.answer, results[0][0]))
    for case, value, passed in results:
        unchanged = () if passed else _accepted_answers(question.answer, case)
        got = numbers(question.answer, value)
        if isinstance(got, str):
            return []
        related = relations(question.answer, case)
        shared = [
            sentence
            for sentence in shared
            if any(
                _is_close(got, answer, _tolerance_at(question, case, answer))
                for answer in related.get(sentence, ())
                if not any(_is_close(answer, right, case.tolerance) for right in unchanged)
            )
        ]
    return shared


def is_right(question: Question, case: Case, value: Value) -> bool:
    """True if a value agrees with one of the accepted answers."""
    got = _read(question.answer, value)
    is_several = question.answer is Answer.NUMBERS
    return not isinstance(got, str) and any(
        _is_close(
            _settle_ties(got, expected, question, case),
            expected,
            _tolerance_at(question, case, expected) if is_several else case.tolerance,
        )
        for expected in _accepted_answers(question.answer, case)
    )


def is_readable(question: Question, value: Value) -> bool:
    """True if a value is an answer of the kind that is asked for, be it right or wrong."""
    return not isinstance(_read(question.answer, value), str)


def is_answer_of(misconception: str, question: Question, case: Case, value: Value) -> bool:
    """True if a value is what that mistake gives here, be it a form that cannot be read."""
    got = numbers(question.answer, value)
    return any(
        str(got) == str(mistaken)
        if isinstance(got, str) or isinstance(mistaken, str)
        else _is_close(
            _settle_half_turns(got, mistaken), mistaken, _tolerance_at(question, case, mistaken)
        )
        for mistaken in _mistaken_answers(question.answer, case, misconception)
    )


def _settle_ties(
    got: FloatArray, expected: FloatArray, question: Question, case: Case
) -> FloatArray:
    """The answer, where entries as right as the expected ones take their form.

    An index becomes the expected one wherever it names a target point just as near.
    """
    if question.answer is not Answer.MATCHES:
        return _settle_half_turns(got, expected)
    if got.shape != expected.shape:
        return got
    source, target = (np.asarray(points, dtype=np.float64) for points in case.arguments[:2])
    index = got[:, 0]
    inside = (index == np.round(index)) & (index >= 0) & (index < len(target))
    chosen = np.where(inside, index, 0).astype(np.int64)
    excess = np.linalg.norm(source - target[chosen], axis=1) - expected[:, 1]
    is_tied = inside & (excess <= case.tolerance)
    return np.column_stack([np.where(is_tied, expected[:, 0], index), got[:, 1]])


def _settle_half_turns(got: FloatArray, expected: FloatArray) -> FloatArray:
    """The answer with π for an angle beside −π where π is expected.

    Single precision has neither.
    """
    if got.shape != expected.shape:
        return got
    beside = (np.abs(got + np.pi) < 1e-6) & ((got > -np.pi) | (got < -np.pi - 1e-9))
    return np.where(beside & (np.abs(expected - np.pi) < 1e-9), got + 2.0 * np.pi, got)


def _read(answer: Answer, value: Value) -> FloatArray | str:
    """The answer, or why there is none in the value."""
    try:
        return read(answer, value)
    except Unreadable as error:
        return str(error)


@cache
def _accepted_answers(answer: Answer, case: Case) -> tuple[FloatArray, ...]:
    return tuple(read(answer, value) for value in case.expected)


@cache
def _mistaken_answers(
    answer: Answer, case: Case, misconception: str
) -> tuple[FloatArray | str, ...]:
    return tuple(numbers(answer, value) for value in case.mistaken.get(misconception, ()))


def _is_close(got: FloatArray, expected: FloatArray, tolerance: FloatArray | float) -> bool:
    """True if all entries agree, NaN with NaN and infinity with itself."""
    if got.shape != expected.shape:
        return False
    with np.errstate(all="ignore"):
        alike = (got == expected) | (np.isnan(got) & np.isnan(expected))
        return bool((alike | (np.abs(got - expected) <= tolerance)).all())


def _tolerance_at(question: Question, case: Case, answer: FloatArray) -> FloatArray | float:
    """The tolerance at an answer; a mistake's can be far larger than the right one."""
    sizes: FloatArray = np.maximum(1.0, np.nan_to_num(np.abs(answer), posinf=1.0))
    is_several = question.answer is Answer.NUMBERS  # each has a unit, and so a size, of its own
    return case.tolerance * (sizes if is_several else float(sizes.max(initial=1.0)))


def _no_value(question: Question, outcome: Outcome) -> str:
    """Reason why there is nothing to compare."""
    if not outcome.tried and outcome.status is Status.TOO_LONG:
        return NOT_TRIED
    message = outcome.message
    if outcome.status is Status.NO_ANSWER and message:
        return f"it {message}"
    if outcome.status is Status.NOT_DEFINED and not message:
        message = "its cell did not run, or it has another name"
    if outcome.status in ADVICE:
        detail = f": {message}" if message else ""
        return ADVICE[outcome.status].format(function=question.function, detail=detail)
    advice = f"; {ADVICE_ON[outcome.error]}" if message and outcome.error in ADVICE_ON else ""
    return f"it raised {message or 'an error'}{advice}."


def _message(
    question: Question,
    cases: Sequence[Case],
    outcomes: Sequence[Outcome],
    faults: Sequence[str],
    mistake: Misconception | None,
) -> tuple[str, bool]:
    """The message on the whole question, and whether it says the fault of every case."""
    passed = faults.count("")
    is_graded = any(case.hidden for case in cases)
    tried_faults = [
        fault
        for case, outcome, fault in zip(cases, outcomes, faults, strict=True)
        if outcome.tried and not case.hidden
    ] or faults
    if passed == len(cases):
        return "All cases pass." if is_graded else ALL_VISIBLE, True
    if all(outcome.status is Status.NOT_WRITTEN for outcome in outcomes):
        return f"`{outcomes[0].unwritten or question.function}` is not written yet.", True
    if mistake:
        read_on = f" See {mistake.chapter}." if mistake.chapter else ""
        return f"Your answers are as if this were so: {mistake.says}{read_on}", False
    if passed == 0 and len(set(tried_faults)) == 1:
        return f"No case passes: {tried_faults[0]}", True
    message = f"{passed} of {len(cases)} cases pass."
    if passed and is_graded:
        groups = passed_groups(cases, faults)
        named = {case.group for case in cases if case.group}
        lost = [name for name, is_passed in groups.items() if name in named and not is_passed]
        message += f" Points are for groups of hidden ones: {sum(groups.values())} of {len(groups)}"
        message += f"; not yet for {' and '.join(lost)}." if lost else "."
    return message, False


def _capitalise(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]
