"""Judging outcomes: right or wrong, how far off, and which known mistake it was.

The one judge of the course: the assignment's grader, its `check` and the chapters' `check` come
here. The answers that are compared with are data; nothing here computes one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from labkit.course.grading.assignment.questions import Answer, Case, Misconception, Question
from labkit.course.grading.inside.data import Value
from labkit.course.grading.judging.kinds import Unreadable, read, sentences
from labkit.course.grading.judging.relations import general, numbers, relations
from labkit.course.grading.judging.verdict import (
    CELL_FAILED,
    KILLED,
    NO_RESULT,
    NOT_DEFINED,
    CaseVerdict,
    Outcome,
    QuestionVerdict,
)
from labkit.support.arrays import FloatArray

ADVICE_ON = {
    "ModuleNotFoundError": "only numpy, scipy and the standard library are there while grading",
    "FileNotFoundError": "no file is there while grading, so keep the answers free of files",
    "EOFError": "nobody types while grading, so take `input` out",
}
OF_THE_WHOLE = {
    NOT_DEFINED: "there is no function `{function}`; was it renamed or left out?",
    CELL_FAILED: "its cell did not run{why}; run the whole notebook afresh to see why.",
}
ADVICE = {
    **OF_THE_WHOLE,
    "NotImplementedError": "it is not written yet.",
    NO_RESULT: "the result is wrong.",
    "OutOfTime": "it took too long; does a loop have no end?",
    KILLED: "the program ended in it: too much memory, or an exit.",
    "ChangedError": "it changed an argument in place{why}; work on a copy.",
}

ENOUGH = 6  # wrong entries that tell a family from chance where all are whole numbers


def assess(
    question: Question, cases: Sequence[Case], outcomes: Sequence[Outcome]
) -> QuestionVerdict:
    """The verdict on one question: its cases, the known mistake if there is one, the score.

    The score is the share of the hidden cases that pass, less what a constant answer would get.
    A known mistake earns its credit where that is more: for the cases that it explains, since
    otherwise one wrong answer, learnt by heart, would be worth as much as a function. Visible
    cases, whose answers are handed out, count where there are no hidden ones.
    """
    pairs = list(zip(cases, outcomes, strict=True))
    verdicts = [judge(question, *pair) for pair in pairs]
    known = None if all(one.passed for one in verdicts) else recognise(question, cases, outcomes)
    counting = [place for place, case in enumerate(cases) if case.hidden] or range(len(cases))
    share = sum(verdicts[place].passed for place in counting) / len(counting)
    share = max(0.0, (share - question.chance) / (1.0 - question.chance))
    if known:
        answered = sum(not outcomes[place].error for place in counting)
        share = max(share, known.credit * answered / len(counting))
    message, is_said = _message(question, verdicts, outcomes, known)
    return QuestionVerdict(
        question=question.id,
        title=question.title,
        points=question.points,
        score=round(question.points * share, 2),
        cases=tuple(replace(one, reason="") if is_said else one for one in verdicts),
        misconception=known.id if known else None,
        message=message,
    )


def judge(question: Question, case: Case, outcome: Outcome) -> CaseVerdict:
    """The verdict on one call.

    Of a hidden case it says only that the result is wrong, or that there is none: whatever else it
    told could be made to spell out an input.
    """
    if outcome.error:
        text = _no_value(question, case, outcome)
    elif is_right(question, case, outcome.value):
        text = ""
    elif case.hidden:
        text = "the result is wrong."
    elif isinstance(got := _read(question.answer, outcome.value), str):
        text = f"{got}."
    else:
        wanted = _accepted(question.answer, case)[0]
        got = _adjusted(got, wanted, question, case)
        first, *more = sentences(question, case, got, wanted)
        text = " ".join([first, *map(_capital, more)])
    reason = f"{_capital(case.about)}: {text}" if text else ""
    return CaseVerdict(id=case.id, hidden=case.hidden, passed=not text, reason=reason)


def recognise(
    question: Question, cases: Sequence[Case], outcomes: Sequence[Outcome]
) -> Misconception | None:
    """The one known mistake that gives all these answers, right and wrong ones; or None.

    A call that brought no answer speaks neither for a mistake nor against it. A listed mistake
    without an answer in a case fails there, or ends somewhere else on each machine: any wrong
    answer fits. Where none is listed, families are tried: relations of the answers to the right
    ones, then changes of the arguments, whose answers are known in visible cases alone.
    """
    given = [
        (case, outcome.value, is_right(question, case, outcome.value))
        for case, outcome in zip(cases, outcomes, strict=True)
        if not outcome.error
    ]
    wrong = [case for case, _, passed in given if not passed]
    if not wrong:
        return None

    def explains(known: Misconception) -> bool:
        return any(known.id in case.mistaken for case in wrong) and all(
            is_answer_of(known.id, question, case, value)
            if passed or known.id in case.mistaken
            else not known.family
            for case, value, passed in given
            if not (known.family and case.hidden)
        )

    explaining = [known for known in question.misconceptions if explains(known)]
    listed = [known for known in explaining if not known.family]
    if listed:
        return listed[0] if len(listed) == 1 else None
    related = [replace(general(id), chapter=question.chapter) for id in _relations(question, given)]
    if all(_is_whole(question, case) for case in wrong):  # whole numbers agree by chance
        is_enough = sum(_count_wrong(question, *each[:2]) for each in given) >= ENOUGH
        found = related + (explaining if is_enough else [])
        return found[0] if len(found) == 1 else None
    return next(iter(related + explaining), None)


def _count_wrong(question: Question, case: Case, value: Value) -> int:
    """The entries of an answer that are wrong; 0 where it has another form."""
    got, wanted = numbers(question.answer, value), _accepted(question.answer, case)[0]
    return 0 if got is None or got.shape != wanted.shape else int((got != wanted).sum())


def _relations(question: Question, given: Sequence[tuple[Case, Value, bool]]) -> list[str]:
    """The relations to the right answers that all answers have."""
    left: dict[str, None] | None = None
    for case, value, _ in given:
        got = numbers(question.answer, value)
        fitting = {
            id: None
            for id, wrong in relations(question.answer, case).items()
            if (left is None or id in left)
            and got is not None
            and any(_close(got, one, _allowed(question, case, one)) for one in wrong)
        }
        left = fitting
    return list(left or ())


def _is_whole(question: Question, case: Case) -> bool:
    return all(
        bool((wanted == np.round(wanted)).all()) for wanted in _accepted(question.answer, case)
    )


def is_right(question: Question, case: Case, value: Value) -> bool:
    """True if a value agrees with one of the accepted answers."""
    got = _read(question.answer, value)
    if isinstance(got, str):
        return False
    for wanted in _accepted(question.answer, case):
        is_several = question.answer is Answer.NUMBERS
        allowed = _allowed(question, case, wanted) if is_several else case.tolerance
        if _close(_adjusted(got, wanted, question, case), wanted, allowed):
            return True
    return False


def is_answer_of(misconception: str, question: Question, case: Case, value: Value) -> bool:
    """True if a value is what that mistake gives here, be it a form that cannot be read."""
    got = _as_given(question.answer, value)
    for wrong in _wrong(question.answer, case, misconception):
        if isinstance(got, str) or isinstance(wrong, str):
            if isinstance(got, str) and isinstance(wrong, str) and got == wrong:
                return True
        elif _close(got, wrong, _allowed(question, case, wrong)):
            return True
    return False


def _adjusted(got: FloatArray, wanted: FloatArray, question: Question, case: Case) -> FloatArray:
    """The answer, with what is as right as the wanted entry in the form of it.

    An angle beside −π becomes π: single precision has no −π and no π. An index becomes the
    wanted one wherever its own names a target point just as near.
    """
    if got.shape != wanted.shape:
        return got
    if question.answer is not Answer.MATCHES:
        beside = (np.abs(got + np.pi) < 1e-6) & ((got > -np.pi) | (got < -np.pi - 1e-9))
        return np.where(beside & (np.abs(wanted - np.pi) < 1e-9), got + 2.0 * np.pi, got)
    source, target = (np.asarray(points, dtype=np.float64) for points in case.arguments[:2])
    index = got[:, 0]
    inside = (index == np.round(index)) & (index >= 0) & (index < len(target))
    chosen = np.where(inside, index, 0).astype(np.int64)
    apart = np.linalg.norm(source - target[chosen], axis=1) - wanted[:, 1]
    as_near = inside & (apart <= case.tolerance)
    return np.column_stack([np.where(as_near, wanted[:, 0], index), got[:, 1]])


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
    return tuple(_as_given(answer, value) for value in case.mistaken.get(misconception, ()))


def _as_given(answer: Answer, value: Value) -> FloatArray | str:
    """The numbers of a value, be it an answer or not; of one without, why it is no answer."""
    found = numbers(answer, value)
    return _read(answer, value) if found is None else found


def _close(got: FloatArray, wanted: FloatArray, tolerance: FloatArray | float) -> bool:
    """True if all entries agree, NaN with NaN and infinity with itself."""
    if got.shape != wanted.shape:
        return False
    with np.errstate(all="ignore"):
        alike = (got == wanted) | (np.isnan(got) & np.isnan(wanted))
        return bool((alike | (np.abs(got - wanted) <= tolerance)).all())


def _allowed(question: Question, case: Case, answer: FloatArray) -> FloatArray | float:
    """The tolerance at an answer; a mistake's can be far larger than the right one."""
    sizes = np.nan_to_num(np.abs(answer), posinf=1.0)
    if question.answer is Answer.NUMBERS:  # each has a unit, and so a size, of its own
        allowed: FloatArray = np.maximum(1.0, sizes) * case.tolerance
        return allowed
    return case.tolerance * float(sizes.max(initial=1.0))


def _no_value(question: Question, case: Case, outcome: Outcome) -> str:
    """Reason why there is nothing to compare; of a hidden case without the student's own words."""
    message = "" if case.hidden else outcome.message
    if outcome.error == "NoAnswerError" and message:
        return f"it {message}" + ("" if message.endswith("?") else ".")
    if outcome.error in ADVICE:
        why = f": {message}" if message else ""
        return ADVICE[outcome.error].format(function=question.function, why=why)
    advice = f"; {ADVICE_ON[outcome.error]}" if message and outcome.error in ADVICE_ON else ""
    return f"it raised {message or 'an error'}{advice}."


def _message(
    question: Question,
    verdicts: Sequence[CaseVerdict],
    outcomes: Sequence[Outcome],
    known: Misconception | None,
) -> tuple[str, bool]:
    """The words on the whole question, and whether they say the fault of every case."""
    passed = sum(verdict.passed for verdict in verdicts)
    hidden = [verdict.passed for verdict in verdicts if verdict.hidden]
    shown = [verdict for verdict in verdicts if not verdict.hidden] or verdicts
    always = {verdict.reason.partition(": ")[2] for verdict in shown}
    if passed == len(verdicts):
        return (
            "All cases pass." if hidden else "All visible cases pass; grading tries others.",
            True,
        )
    if all(outcome.error == "NotImplementedError" for outcome in outcomes):
        called = re.match(r"`\w+` is not written yet", outcomes[0].message)
        return f"{called[0] if called else f'`{question.function}` is not written yet'}.", True
    if known:
        read_on = f" See {known.chapter}." if known.chapter else ""
        return f"This looks like a known mistake: {known.says}{read_on}", False
    if passed == 0 and len(always) == 1:
        if all(outcome.error in OF_THE_WHOLE for outcome in outcomes):
            return _capital(*always), True
        return f"No case passes: {always.pop()}", True
    text = f"{passed} of {len(verdicts)} cases pass."
    if passed and hidden:
        text += f" Points are for the hidden ones: {sum(hidden)} of {len(hidden)}."
    if question.chance and passed:
        text += " Guessing passes some cases; you get points above that level."
    return text, False


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
