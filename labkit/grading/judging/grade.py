"""From a submission's cells to its verdict: build the calls, run them, judge what came."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache

from labkit.grading.assignment.questions import Assignment, Case, Question
from labkit.grading.contract import Call, Outcome, Sandbox, SourceCell
from labkit.grading.judging.compare import assess
from labkit.grading.judging.verdict import QuestionVerdict, SubmissionVerdict


def grade_submission(
    cells: Sequence[SourceCell],
    sandbox: Sandbox,
    assignment: Assignment,
    student: str,
    *,
    submission: str = "",
    notes: Sequence[str] = (),
    questions: Collection[str] = (),
) -> SubmissionVerdict:
    """Grade one submission.

    Parameters
    ----------
    cells : sequence of SourceCell
        The submission, extracted.
    sandbox : Sandbox
        Where it runs.
    assignment : Assignment
        What it is held to; the student's variant of the hidden cases is chosen by `student`.
    student : str
        Who handed it in.
    submission : str
        Its name for a person.
    notes : sequence of str
        What the student should know besides.
    questions : collection of str
        Grade these alone; empty for all.

    Returns
    -------
    SubmissionVerdict
        Of the same submission always the same, but for `seconds`.

    Raises
    ------
    InvalidParameterError
        For a question that the assignment does not have.

    Notes
    -----
    What a call returns or raises may hold the arguments of any earlier one. A student reads
    much of that where the case is a visible one: error texts, shapes, how far off a number is.
    Therefore the visible cases of all questions are asked before any hidden one.
    """
    start = time.perf_counter()
    wanted = {assignment.question(id).id for id in questions}
    asked = [one for one in assignment.questions if not wanted or one.id in wanted]
    cases = {question.id: assignment.cases(question.id, student) for question in asked}
    outcomes = _run(cells, sandbox, asked, cases)
    verdicts = _with_causes(asked, [assess(one, cases[one.id], outcomes[one.id]) for one in asked])
    return SubmissionVerdict(
        student=student,
        submission=submission,
        mode=sandbox.mode,
        questions=verdicts,
        score=_total(verdict.score for verdict in verdicts),
        points=_total(verdict.points for verdict in verdicts),
        notes=tuple(notes),
        seconds=time.perf_counter() - start,
    )


def _with_causes(
    questions: Sequence[Question], verdicts: Sequence[QuestionVerdict]
) -> tuple[QuestionVerdict, ...]:
    """The verdicts; one that no known mistake explains names wrong functions that it may call."""
    failed = {one.question: one.title for one in verdicts if not one.passed}
    causes = [
        " or ".join(f"“{failed[id]}”" for id in question.builds_on if id in failed)
        for question in questions
    ]
    return tuple(
        replace(verdict, message=f"{verdict.message} If it calls {cause}: mend that first.")
        if cause and not verdict.passed and verdict.misconception is None
        else verdict
        for verdict, cause in zip(verdicts, causes, strict=True)
    )


def _run(
    cells: Sequence[SourceCell],
    sandbox: Sandbox,
    questions: Sequence[Question],
    cases: Mapping[str, Sequence[Case]],
) -> dict[str, list[Outcome]]:
    """The outcomes of all cases by question; the calls' ids are mere numbers."""
    asked = [(question, case) for question in questions for case in cases[question.id]]
    asked.sort(key=lambda pair: pair[1].hidden)
    calls = [
        _call(i, question.id, question.function, case) for i, (question, case) in enumerate(asked)
    ]
    outcomes: dict[str, list[Outcome]] = {question.id: [] for question in questions}
    for (question, _), outcome in zip(asked, sandbox.run(cells, calls), strict=True):
        outcomes[question.id].append(outcome)
    return outcomes


@cache
def _call(number: int, question: str, function: str, case: Case) -> Call:
    """The call of a case, the same object for all who are asked it."""
    return Call(id=str(number), question=question, function=function, arguments=case.arguments)


def _total(amounts: Iterable[float]) -> float:
    return round(sum(amounts), 2)
