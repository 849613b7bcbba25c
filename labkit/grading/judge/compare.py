"""Judging outcomes, in the grader and in `check`: right or wrong, and which known mistake it was.

The answers that are compared with are data; nothing here computes one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache

import numpy as np

from labkit.grading.box.inside.data import Value
from labkit.grading.judge.kinds import Unreadable, numbers, read, sentences
from labkit.grading.judge.relations import relations
from labkit.grading.judge.verdict import CaseVerdict, Outcome, QuestionVerdict, Status
from labkit.grading.questions import Answer, Case, Misconception, Question
from labkit.support.arrays import FloatArray

ADVICE_ON = {
    "ModuleNotFoundError": "that package is not installed where the grading runs",
    "FileNotFoundError": "no file is there while grading, so keep the answers free of files",
    "EOFError": "nobody types while grading, so take `input` out",
}
ADVICE = {
    Status.NOT_DEFINED: "there is no function `{function}`{why}.",
    Status.NOT_WRITTEN: "it is not written yet.",
    Status.NO_RESULT: "the result is wrong.",
    Status.TOO_LONG: "it took too long; does a loop have no end?",
    Status.KILLED: "the program ended in it: too much memory, an exit, or a call without an end.",
    Status.CHANGED: "it changed an argument in place{why}; work on a copy.",
}

ALL_VISIBLE = "All visible cases pass; grading tries others."


def assess(
    question: Question, cases: Sequence[Case], outcomes: Sequence[Outcome]
) -> QuestionVerdict:
    """The verdict on one question: its cases, the known mistake if there is one, the score.

    The score is the share of the hidden cases that pass, less what a constant answer would get.
    Visible cases, whose answers are handed out, count where there are no hidden ones.
    """
    faults = [fault(question, *pair) for pair in zip(cases, outcomes, strict=True)]
    known = recognise(question, cases, outcomes)
    counting = [place for place, case in enumerate(cases) if case.hidden] or range(len(cases))
    share = sum(not faults[place] for place in counting) / len(counting)
    share = max(0.0, (share - question.chance) / (1.0 - question.chance))
    message, is_said = _message(question, cases, outcomes, faults, known)
    return QuestionVerdict(
        question=question.id,
        title=question.title,
        points=question.points,
        score=round(question.points * share, 2),
        cases=tuple(
            _case_verdict(case, outcome, text, is_said)
            for case, outcome, text in zip(cases, outcomes, faults, strict=True)
        ),
        misconception=known.id if known else None,
        message=message,
    )


def fault(question: Question, case: Case, outcome: Outcome) -> str:
    """What is wrong with one call, in a few sentences; "" where it is right.

    Of a hidden case it says only that the result is wrong, or that there is none: whatever else it
    told could be made to spell out an input.
    """
    if outcome.status is not Status.RETURNED:
        return _no_value(question, case, outcome)
    if is_right(question, case, outcome.value):
        return ""
    if case.hidden:
        return "the result is wrong."
    got = _read(question.answer, outcome.value)
    if isinstance(got, str):
        return f"{got}."
    wanted = _accepted(question.answer, case)[0]
    got = _adjusted(got, wanted, question, case)
    first, *more = sentences(question, case, got, wanted)
    return " ".join([first, *map(_capital, more)])


def _case_verdict(case: Case, outcome: Outcome, text: str, is_said: bool) -> CaseVerdict:
    """The verdict on one call; its fault is left out where the question's message says it."""
    reason = f"{_capital(case.about)}: {text}" if text and not is_said else ""
    status = outcome.status
    if text and case.hidden and status is Status.RETURNED:
        status = Status.NO_RESULT  # whatever it returned
    return CaseVerdict(
        id=case.id, hidden=case.hidden, passed=not text, reason=reason, status=status
    )


def recognise(
    question: Question, cases: Sequence[Case], outcomes: Sequence[Outcome]
) -> Misconception | None:
    """The one known mistake that gives all these answers, right and wrong ones; or None.

    A call that brought no answer speaks neither for a mistake nor against it. Where a listed
    mistake has no answer, any wrong one fits. Where none is listed, relations of the answers to the
    right ones are tried; answers in whole numbers agree by chance, so one relation alone counts.
    """
    given = [
        (case, outcome.value, is_right(question, case, outcome.value))
        for case, outcome in zip(cases, outcomes, strict=True)
        if outcome.status is Status.RETURNED
    ]
    wrong = [case for case, _, passed in given if not passed]
    if not wrong:
        return None

    def explains(known: Misconception) -> bool:
        return any(known.id in case.mistaken for case in wrong) and all(
            is_answer_of(known.id, question, case, value)
            for case, value, passed in given
            if passed or known.id in case.mistaken
        )

    listed = [known for known in question.misconceptions if explains(known)]
    if listed:
        return listed[0] if len(listed) == 1 else None
    values = [numbers(question.answer, value) for _, value, passed in given if not passed]
    if not any(isinstance(value, str) or np.isfinite(value).any() for value in values):
        return None  # a division by zero
    shared = _relations(question, given)
    answers = [answer for case in wrong for answer in _accepted(question.answer, case)]
    is_whole = all((answer == np.round(answer)).all() for answer in answers)
    if not shared or (is_whole and len(shared) > 1):
        return None
    return Misconception(id=shared[0], says=shared[0], chapter=question.chapter)


def _relations(question: Question, given: Sequence[tuple[Case, Value, bool]]) -> list[str]:
    """The relations to the right answers that all answers have."""
    shared = list(relations(question.answer, given[0][0]))
    for case, value, _ in given:
        got = numbers(question.answer, value)
        if isinstance(got, str):
            return []
        related = relations(question.answer, case)
        shared = [
            sentence
            for sentence in shared
            if any(
                _close(got, answer, _allowed(question, case, answer))
                for answer in related.get(sentence, ())
            )
        ]
    return shared


def is_right(question: Question, case: Case, value: Value) -> bool:
    """True if a value agrees with one of the accepted answers."""
    got = _read(question.answer, value)
    is_several = question.answer is Answer.NUMBERS
    return not isinstance(got, str) and any(
        _close(
            _adjusted(got, wanted, question, case),
            wanted,
            _allowed(question, case, wanted) if is_several else case.tolerance,
        )
        for wanted in _accepted(question.answer, case)
    )


def is_answer_of(misconception: str, question: Question, case: Case, value: Value) -> bool:
    """True if a value is what that mistake gives here, be it a form that cannot be read."""
    got = numbers(question.answer, value)
    return any(
        str(got) == str(wrong)
        if isinstance(got, str) or isinstance(wrong, str)
        else _close(_half_turns_as(got, wrong), wrong, _allowed(question, case, wrong))
        for wrong in _wrong(question.answer, case, misconception)
    )


def _adjusted(got: FloatArray, wanted: FloatArray, question: Question, case: Case) -> FloatArray:
    """The answer, with what is as right as the wanted entry in the form of it.

    An index becomes the wanted one wherever its own names a target point just as near.
    """
    if question.answer is not Answer.MATCHES:
        return _half_turns_as(got, wanted)
    if got.shape != wanted.shape:
        return got
    source, target = (np.asarray(points, dtype=np.float64) for points in case.arguments[:2])
    index = got[:, 0]
    inside = (index == np.round(index)) & (index >= 0) & (index < len(target))
    chosen = np.where(inside, index, 0).astype(np.int64)
    apart = np.linalg.norm(source - target[chosen], axis=1) - wanted[:, 1]
    as_near = inside & (apart <= case.tolerance)
    return np.column_stack([np.where(as_near, wanted[:, 0], index), got[:, 1]])


def _half_turns_as(got: FloatArray, wanted: FloatArray) -> FloatArray:
    """The answer with π for an angle beside −π where π is wanted: single precision has neither."""
    if got.shape != wanted.shape:
        return got
    beside = (np.abs(got + np.pi) < 1e-6) & ((got > -np.pi) | (got < -np.pi - 1e-9))
    return np.where(beside & (np.abs(wanted - np.pi) < 1e-9), got + 2.0 * np.pi, got)


def _read(answer: Answer, value: Value) -> FloatArray | str:
    """The answer, or why there is none in the value."""
    try:
        return read(answer, value)
    except Unreadable as error:
        return str(error)


@cache
def _accepted(answer: Answer, case: Case) -> tuple[FloatArray, ...]:
    return tuple(read(answer, value) for value in case.expected)


@cache
def _wrong(answer: Answer, case: Case, misconception: str) -> tuple[FloatArray | str, ...]:
    return tuple(numbers(answer, value) for value in case.mistaken.get(misconception, ()))


def _close(got: FloatArray, wanted: FloatArray, tolerance: FloatArray | float) -> bool:
    """True if all entries agree, NaN with NaN and infinity with itself."""
    if got.shape != wanted.shape:
        return False
    with np.errstate(all="ignore"):
        alike = (got == wanted) | (np.isnan(got) & np.isnan(wanted))
        return bool((alike | (np.abs(got - wanted) <= tolerance)).all())


def _allowed(question: Question, case: Case, answer: FloatArray) -> FloatArray | float:
    """The tolerance at an answer; a mistake's can be far larger than the right one."""
    sizes: FloatArray = np.maximum(1.0, np.nan_to_num(np.abs(answer), posinf=1.0))
    is_several = question.answer is Answer.NUMBERS  # each has a unit, and so a size, of its own
    return case.tolerance * (sizes if is_several else float(sizes.max(initial=1.0)))


def _no_value(question: Question, case: Case, outcome: Outcome) -> str:
    """Reason why there is nothing to compare; of a hidden case without the student's own words."""
    message = "" if case.hidden else outcome.message
    if outcome.status is Status.NO_ANSWER and message:
        return f"it {message}" + ("" if message.endswith("?") else ".")
    if outcome.status is Status.NOT_DEFINED and not message:
        message = "its cell did not run, or it has another name"
    if outcome.status in ADVICE:
        why = f": {message}" if message else ""
        return ADVICE[outcome.status].format(function=question.function, why=why)
    advice = f"; {ADVICE_ON[outcome.error]}" if message and outcome.error in ADVICE_ON else ""
    return f"it raised {message or 'an error'}{advice}."


def _message(
    question: Question,
    cases: Sequence[Case],
    outcomes: Sequence[Outcome],
    faults: Sequence[str],
    known: Misconception | None,
) -> tuple[str, bool]:
    """The words on the whole question, and whether they say the fault of every case."""
    passed = faults.count("")
    hidden = [not text for case, text in zip(cases, faults, strict=True) if case.hidden]
    shown = [text for case, text in zip(cases, faults, strict=True) if not case.hidden] or faults
    if passed == len(cases):
        return "All cases pass." if hidden else ALL_VISIBLE, True
    if all(outcome.status is Status.NOT_WRITTEN for outcome in outcomes):
        called = re.match(r"`\w+` is not written yet", outcomes[0].message)
        return f"{called[0] if called else f'`{question.function}` is not written yet'}.", True
    if known:
        read_on = f" See {known.chapter}." if known.chapter else ""
        return f"This looks like a known mistake: {known.says}{read_on}", False
    if passed == 0 and len(set(shown)) == 1:
        return f"No case passes: {shown[0]}", True
    text = f"{passed} of {len(cases)} cases pass."
    if passed and hidden:
        text += f" Points are for the hidden ones: {sum(hidden)} of {len(hidden)}."
    if question.chance and passed:
        text += " Guessing passes some cases; you get points above that level."
    return text, False


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
