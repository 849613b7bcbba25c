"""From a submission's files to its verdict: run them in a box, call its functions, judge.

Each question is asked with what its own cells left behind and, where that differs, with what the
whole notebook left behind; the best verdict counts. One that is wrong and calls earlier ones is
then asked its hidden cases once more with right functions in their place (follow-through): of those
that are wrong or write into their arguments, and then of all.

All visible cases are asked before any hidden one: what a student reads of a visible case was
written before a hidden input came into the box.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product

from labkit.grading.box.inside.limits import MAX_NOTES
from labkit.grading.box.inside.reading import Program
from labkit.grading.box.outside import Wall
from labkit.grading.judge.compare import assess
from labkit.grading.judge.verdict import (
    Outcome,
    QuestionVerdict,
    Status,
    SubmissionVerdict,
    clean_text,
)
from labkit.grading.questions import Assignment, Question
from labkit.grading.sitting import Sitting


def grade_submission(
    files: Mapping[str, bytes], wall: Wall, assignment: Assignment, student: str
) -> tuple[SubmissionVerdict, Program]:
    """Grade files behind a wall: the code, and the verdict, whose `seconds` alone may differ."""
    start = time.perf_counter()
    sitting = Sitting([question.function for question in assignment.questions], wall)
    try:
        if files:
            sitting.read(files)
        verdicts = tuple(_verdicts(sitting, assignment))
    finally:
        sitting.close()
    program = sitting.program
    verdict = SubmissionVerdict(
        student=student,
        submission=student,
        mode=wall.mode,
        questions=verdicts,
        score=round(sum(verdict.score for verdict in verdicts), 2),
        points=round(sum(verdict.points for verdict in verdicts), 2),
        notes=tuple(map(clean_text, [*program.notes, *sitting.notes][:MAX_NOTES])),
        unread=tuple(map(clean_text, program.unread)),
        seconds=time.perf_counter() - start,
        is_graded=bool(program.scripts),
    )
    return verdict, program


def _verdicts(sitting: Sitting, assignment: Assignment) -> Iterator[QuestionVerdict]:
    """Each question by the student's functions, then with right ones for those that it calls.

    No right function is lent to an earlier question than its own, nor before a question that it
    would answer outright: so none that is asked for is in the box before it is asked.
    """
    visible_outcomes = [
        [
            sitting.ask(question, assignment.visible[question.id], state)
            for state in range(sitting.states.get(question.function, 1))
        ]
        for question in assignment.questions
    ]
    failed = set[str]()
    for place, question in enumerate(assignment.questions):
        own_verdicts = _in_each_state(sitting, question, assignment, visible_outcomes[place])
        verdict = own_verdict = best_of(own_verdicts)
        ended = any(case.status in (Status.TOO_LONG, Status.KILLED) for case in own_verdict.cases)
        callees = [
            callee
            for callee in assignment.questions[:place]
            if callee.id in assignment.right
            and callee.function in sitting.calls.get(question.function, ())
            and not any(map(callee.answers, assignment.questions[place:]))
            and (callee.id in failed or not ended)  # else its time would be lost once more
        ]
        if callees and not own_verdict.passed:
            lent_verdict = best_of(_follow_through(sitting, question, assignment, callees, failed))
            if lent_verdict.score > own_verdict.score:
                message = (
                    f"{lent_verdict.message} With yours it would get {own_verdict.score:g} of "
                    f"{own_verdict.points:g} points."
                )
                verdict = replace(lent_verdict, message=message)
        if not verdict.passed:
            failed.add(question.id)
        yield verdict


def _in_each_state(
    sitting: Sitting,
    question: Question,
    assignment: Assignment,
    visible_outcomes: Sequence[Sequence[Outcome]],
) -> Iterator[QuestionVerdict]:
    """The verdicts with the student's own functions: in the state of its cells, and at the end."""
    cases = assignment.cases(question.id)
    hidden = [case for case in cases if case.hidden]
    for state, outcomes in enumerate(visible_outcomes):
        is_unwritten = all(outcome.status is Status.NOT_WRITTEN for outcome in outcomes)
        if is_unwritten or outcomes[-1].status is Status.TOO_LONG:  # it would be so again
            answers = [replace(outcomes[-1], tried=False)] * len(hidden)
        else:
            passed = assess(question, assignment.visible[question.id], outcomes).passed
            answers = sitting.ask(question, hidden, state, trusted=passed)
        yield assess(question, cases, [*outcomes, *answers])


def _follow_through(
    sitting: Sitting,
    question: Question,
    assignment: Assignment,
    callees: Sequence[Question],
    failed: Collection[str],
) -> Iterator[QuestionVerdict]:
    """The verdicts with right functions in place of those that harm, and then of all callees.

    Those that `failed` harm their callers, and those that write into their arguments. The right
    ones answer in the form that the question asks for, and then in that of the student's own
    answers: a caller may be written for either.
    """
    hidden = [case for case in assignment.cases(question.id) if case.hidden]
    states = range(sitting.states.get(question.function, 1))
    harmful = [
        callee for callee in callees if callee.id in failed or callee.function in sitting.writing
    ]
    for lent in ([harmful] if 0 < len(harmful) < len(callees) else []) + [callees]:
        sources = {callee.function: assignment.source_to_lend(callee.id) for callee in lent}
        names = ", ".join(f"`{name}`" for name in sources)
        words = f" This was graded with the right {names} in place of yours."
        passing = " and ".join(f"`{callee.function}`" for callee in lent if callee.id not in failed)
        if passing:
            words += f" The cases of {passing} pass: does code in there write into an argument?"
        readable = sitting.readable & sources.keys()
        for form, state in product([(), readable] if readable else [()], states):
            answers = sitting.ask(question, hidden, state, lent=sources, in_form=form)
            verdict = assess(question, hidden, answers)
            yield replace(verdict, replaced=tuple(sources), message=verdict.message + words)


def best_of(verdicts: Iterator[QuestionVerdict]) -> QuestionVerdict:
    """The first of the best verdicts; after one that passes no more are asked for."""
    best = next(verdicts)
    while not best.passed and (verdict := next(verdicts, None)):
        best = max(best, verdict, key=lambda verdict: verdict.score)
    return best
