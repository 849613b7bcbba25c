"""Judging outcomes: right or wrong, how far off, and which known mistake it was.

The answers that are compared with were computed when the assignment was written. Nothing
here computes one, so a student's code has nothing to reach for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from labkit.arrays import FloatArray
from labkit.course.grading.assignment.questions import Answer, Case, Misconception, Question
from labkit.course.grading.contract import Outcome, OutcomeStatus, Value
from labkit.course.grading.judging.kinds import Unreadable, how_wrong, read
from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict

Known = tuple[FloatArray | str, ...]
HIDDEN_REASONS = 3  # of hidden cases a student is told what went wrong in so many
WHOLE_QUESTION = {OutcomeStatus.NOT_DEFINED, OutcomeStatus.SOURCE_FAILED}
ADVICE_ON = {
    "ModuleNotFoundError": "only numpy, scipy and the standard library are there while grading",
    "FileNotFoundError": "no file is there while grading, so keep the answers free of files",
    "EOFError": "nobody types while grading, so take `input` out",
}
ADVICE = {
    OutcomeStatus.TIMEOUT: "it took too long; does a loop have no end?",
    OutcomeStatus.KILLED: "the program ended in it: too much memory, or an exit.",
    OutcomeStatus.TOO_LARGE: "it returned far more data than the answer holds.",
    OutcomeStatus.NOT_DATA: "it returned an object; return numbers or arrays.",
}


def judge(question: Question, case: Case, outcome: Outcome) -> CaseVerdict:
    """The verdict on one call.

    Parameters
    ----------
    question, case
        What was asked.
    outcome : Outcome
        What came.

    Returns
    -------
    CaseVerdict
        With the credit 1 where the answer agrees with an accepted one, else 0 and the reason.
    """
    text = _fault(question, case, outcome)
    return CaseVerdict(
        id=case.id,
        hidden=case.hidden,
        credit=0.0 if text else 1.0,
        reason=f"{case.about[:1].upper()}{case.about[1:]}: {text}" if text else "",
    )


def assess(
    question: Question, cases: Sequence[Case], outcomes: Sequence[Outcome]
) -> QuestionVerdict:
    """The verdict on one question: its cases, the known mistake if there is one, the score.

    The score is the share of the hidden cases that pass, less what a constant answer would get.
    A known mistake has a price instead, its credit, which is the same in every variant: for the
    cases that it explains, since otherwise one wrong answer, learnt by heart, would be worth as
    much as a function. Visible cases, whose answers are handed out, count where there are no
    hidden ones.
    """
    pairs = list(zip(cases, outcomes, strict=True))
    verdicts = tuple(judge(question, case, outcome) for case, outcome in pairs)
    right = all(verdict.passed for verdict in verdicts)
    known = None if right else recognise(question, cases, outcomes)
    counting = [place for place, case in enumerate(cases) if case.hidden] or range(len(cases))
    passed = sum(verdicts[place].passed for place in counting) / len(counting)
    share = max(0.0, (passed - question.chance) / (1.0 - question.chance))
    if known:
        share = known.credit * _explained(known, [pairs[place] for place in counting])
        verdicts = tuple(_blame(verdict, known) for verdict in verdicts)
    return QuestionVerdict(
        question=question.id,
        title=question.title,
        points=question.points,
        score=round(question.points * share, 2),
        cases=_said_once(verdicts, outcomes),
        misconception=known.id if known else None,
        message=_message(question, verdicts, outcomes, known),
    )


def _explained(known: Misconception, asked: Sequence[tuple[Case, Outcome]]) -> float:
    """The share of the cases that have an answer, or that the mistake answers no better."""
    unanswered = sum(
        outcome.status is not OutcomeStatus.RETURNED and known.id in case.mistaken
        for case, outcome in asked
    )
    return 1.0 - unanswered / len(asked)


def recognise(
    question: Question, cases: Sequence[Case], outcomes: Sequence[Outcome]
) -> Misconception | None:
    """The one known mistake that gives all these answers, right and wrong ones; or None.

    A call that brought no answer speaks neither for a mistake nor against it; but where all
    answers that came are right, there is none to be named.
    """
    answers = [
        (case, _read(question.answer, outcome.value))
        for case, outcome in zip(cases, outcomes, strict=True)
        if outcome.status is OutcomeStatus.RETURNED
    ]
    if all(_is_accepted(got, question, case) for case, got in answers):
        return None
    explaining = [
        known
        for known in question.misconceptions
        if all(
            _is_mistake(got, _wrong(question.answer, case, known.id), case) for case, got in answers
        )
    ]
    return explaining[0] if len(explaining) == 1 else None


def is_right(question: Question, case: Case, value: Value) -> bool:
    """Whether a value agrees with one of the accepted answers."""
    return _is_accepted(_read(question.answer, value), question, case)


def is_answer_of(misconception: str, question: Question, case: Case, value: Value) -> bool:
    """Whether a value is what that mistake gives here, be it a form that cannot be read."""
    return _is_mistake(
        _read(question.answer, value), _wrong(question.answer, case, misconception), case
    )


def _is_accepted(got: FloatArray | str, question: Question, case: Case) -> bool:
    return not isinstance(got, str) and any(
        _close(_untied(got, wanted, question, case), wanted, case.tolerance)
        for wanted in _accepted(question.answer, case)
    )


def _untied(
    got: FloatArray, wanted: FloatArray | str, question: Question, case: Case
) -> FloatArray:
    """The answer with the wanted index wherever its own names a target point just as near."""
    if (
        question.answer is not Answer.MATCHES
        or isinstance(wanted, str)
        or got.shape != wanted.shape
    ):
        return got
    source, target = (np.asarray(points, dtype=np.float64) for points in case.arguments[:2])
    index = got[:, 0]
    inside = (index == np.round(index)) & (index >= 0) & (index < len(target))
    chosen = np.where(inside, index, 0).astype(np.int64)
    apart = np.linalg.norm(source - target[chosen], axis=1) - wanted[:, 1]
    as_near = inside & (apart <= case.tolerance)
    return np.column_stack([np.where(as_near, wanted[:, 0], index), got[:, 1]])


def _is_mistake(got: FloatArray | str, answers: Known, case: Case) -> bool:
    if isinstance(got, str):
        return any(isinstance(wrong, str) and got == wrong for wrong in answers)
    return any(
        _close(got, wrong, case.tolerance * _scale(wrong))
        for wrong in answers
        if not isinstance(wrong, str)
    )


def _read(answer: Answer, value: Value) -> FloatArray | str:
    """The answer, or why there is none in the value."""
    try:
        return read(answer, value)
    except Unreadable as error:
        return str(error)


@cache
def _accepted(answer: Answer, case: Case) -> Known:
    return tuple(_read(answer, value) for value in case.expected)


@cache
def _wrong(answer: Answer, case: Case, misconception: str) -> Known:
    return tuple(_read(answer, value) for value in case.mistaken.get(misconception, ()))


def _close(got: FloatArray, wanted: FloatArray | str, tolerance: float) -> bool:
    """Whether all entries agree, NaN with NaN and infinity with itself."""
    if isinstance(wanted, str) or got.shape != wanted.shape:
        return False
    with np.errstate(all="ignore"):
        apart = np.abs(got - wanted)
        if (apart <= tolerance).all():
            return True
        alike = (got == wanted) | (np.isnan(got) & np.isnan(wanted))
        return bool((alike | (apart <= tolerance)).all())


def _scale(wrong: FloatArray) -> float:
    """A mistake's answer can be far larger than the right one, whose size the tolerance knows."""
    return float(np.abs(wrong[np.isfinite(wrong)]).max(initial=1.0))


def _fault(question: Question, case: Case, outcome: Outcome) -> str:
    """Why an outcome is not right; empty where it is."""
    if outcome.status is not OutcomeStatus.RETURNED:
        return _no_value(question, case, outcome)
    got = _read(question.answer, outcome.value)
    if isinstance(got, str):
        return f"{got}."
    if _is_accepted(got, question, case):
        return ""
    accepted = [
        wanted for wanted in _accepted(question.answer, case) if not isinstance(wanted, str)
    ]
    wanted = min(accepted, key=lambda wanted: _gap(got, wanted))
    return how_wrong(question, case, _untied(got, wanted, question, case), wanted)


def _gap(got: FloatArray, wanted: FloatArray) -> float:
    if got.shape != wanted.shape:
        return np.inf
    with np.errstate(all="ignore"):
        return float(np.nan_to_num(np.abs(got - wanted), nan=np.inf).max(initial=0.0))


def _no_value(question: Question, case: Case, outcome: Outcome) -> str:
    if outcome.status is OutcomeStatus.NOT_DEFINED:
        return f"there is no function `{question.function}`; was it renamed or left out?"
    message = "" if case.hidden else outcome.message
    if outcome.status is OutcomeStatus.SOURCE_FAILED:
        shown = f": {message}" if message else ""
        return f"its cell did not run{shown}; run the whole notebook afresh to see why."
    if outcome.error == "NotImplementedError":
        return "it is not written yet."
    if outcome.status is OutcomeStatus.RAISED:
        advice = f"; {ADVICE_ON[outcome.error]}" if outcome.error in ADVICE_ON else ""
        return f"it raised {message}{advice}." if message else f"{outcome.unrevealing_message}."
    if outcome.status is OutcomeStatus.NOT_DATA and message:
        return f"it {message}" + ("" if message.endswith("?") else ".")
    return ADVICE[outcome.status]


def _said_once(
    verdicts: Sequence[CaseVerdict], outcomes: Sequence[Outcome]
) -> tuple[CaseVerdict, ...]:
    """The verdicts without what the message says of all of them, and with few hidden reasons.

    What goes wrong in one hidden case after the other could be made to spell out their inputs.
    """
    if is_unwritten(outcomes) or _in_every_case(verdicts):
        return tuple(replace(verdict, reason="") for verdict in verdicts)
    told = 0
    found = []
    for verdict in verdicts:
        if verdict.hidden and verdict.reason:
            told += 1
            if told > HIDDEN_REASONS:
                about = verdict.reason.partition(":")[0]
                verdict = replace(verdict, reason=f"{about}: this fails, too.")  # noqa: PLW2901
        found.append(verdict)
    return tuple(found)


def _in_every_case(verdicts: Sequence[CaseVerdict]) -> str:
    """What is wrong in every case, in the same words; empty where it is a known mistake."""
    texts = {verdict.reason.partition(": ")[2] for verdict in verdicts}
    known = any(verdict.misconception for verdict in verdicts)
    return texts.pop() if len(texts) == 1 and not known else ""


def is_missing(outcomes: Sequence[Outcome]) -> bool:
    """Whether there is nothing that could be called."""
    return all(outcome.status in WHOLE_QUESTION for outcome in outcomes)


def is_unwritten(outcomes: Sequence[Outcome]) -> bool:
    """Whether the function still is a stub, or calls one in every case."""
    return all(outcome.error == "NotImplementedError" for outcome in outcomes)


def _blame(verdict: CaseVerdict, known: Misconception) -> CaseVerdict:
    if verdict.passed:
        return verdict
    return replace(verdict, misconception=known.id)


def _message(
    question: Question,
    verdicts: Sequence[CaseVerdict],
    outcomes: Sequence[Outcome],
    known: Misconception | None,
) -> str:
    passed = sum(verdict.passed for verdict in verdicts)
    if passed == len(verdicts):
        return "All cases pass."
    if is_unwritten(outcomes):
        return f"`{question.function}` is not written yet."
    always = _in_every_case(verdicts)
    if always and is_missing(outcomes):
        return f"{always[:1].upper()}{always[1:]}"
    if always:
        return f"In every case {always}"
    if known:
        return f"This looks like a known mistake: {known.says} See {known.chapter}."
    text = f"{passed} of {len(verdicts)} cases pass."
    if passed and (hidden := [verdict.passed for verdict in verdicts if verdict.hidden]):
        text += f" Points are for the hidden ones: {sum(hidden)} of {len(hidden)}."
    if question.chance and passed:
        text += " A constant answer would pass half of them, so points begin beyond that."
    return text
