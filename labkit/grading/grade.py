"""From a submission's files to its verdict: run them in a box, call its functions, judge.

Each question is asked with what its own cells left behind and, where that differs, with what the
whole notebook left behind; the best verdict counts. One that calls wrong earlier ones is then asked
its hidden cases once more with the right functions in their place (follow-through).

All visible cases are asked before any hidden one: what a student reads of a visible case was
written before a hidden input came into the box.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import replace

from labkit.grading.box.outside import IN_ALL, Wall, open_wall
from labkit.grading.classroom.handins import Submission, read_files
from labkit.grading.classroom.store import Record, fingerprint
from labkit.grading.judge.compare import assess
from labkit.grading.judge.verdict import QuestionVerdict, Status, SubmissionVerdict
from labkit.grading.questions import Assignment, Case, Question, read_assignment
from labkit.grading.sitting import Sitting, clean_text

FIRST = 2.0  # times the wall's seconds, of processor time: who needs more is graded last
MAX_NOTES = 20
NO_FILES = "nothing was handed in but an empty folder, or one of hidden files"


class TakesLong(Exception):
    """A submission needs more processor time than its first share."""


def grade_submission(
    files: Mapping[str, bytes],
    wall: Wall,
    assignment: Assignment,
    student: str,
    *,
    share: float = IN_ALL,
) -> tuple[SubmissionVerdict, str]:
    """Grade files behind a wall: the verdict, always the same but for `seconds`, and all code.

    A `share` is processor time as a multiple of the wall's seconds. Raises `TakesLong` where a
    smaller one than `IN_ALL` does not do.
    """
    start = time.perf_counter()
    sitting = Sitting([question.function for question in assignment.questions], wall, share)
    try:
        if files:
            sitting.read(files)
        verdicts = tuple(_verdicts(sitting, assignment))
    finally:
        sitting.close()
    if sitting.seconds_left <= 0.0 and share < IN_ALL:
        raise TakesLong
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
    return verdict, "\n\n".join(program.scripts.values()).encode("utf-8", "replace").decode()


def _verdicts(sitting: Sitting, assignment: Assignment) -> Iterator[QuestionVerdict]:
    """Each question by the student's functions, then with right ones for wrong ones that it calls.

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
    failed: list[Question] = []
    for place, question in enumerate(assignment.questions):
        cases = assignment.cases(question.id)
        hidden = [case for case in cases if case.hidden]
        tried = list[QuestionVerdict]()
        for state, outcomes in enumerate(visible_outcomes[place]):
            if all(outcome.status is Status.NOT_WRITTEN for outcome in outcomes):
                answers = outcomes[:1] * len(hidden)
            else:
                passed = assess(question, assignment.visible[question.id], outcomes).passed
                answers = sitting.ask(question, hidden, state, trusted=passed)
            tried.append(assess(question, cases, [*outcomes, *answers]))
            if tried[-1].passed:
                break
        own_verdict = max(tried, key=lambda verdict: verdict.score)
        verdict = own_verdict
        replacements = {
            callee.function: assignment.replacement(callee.id)
            for callee in failed
            if callee.function in sitting.calls.get(question.function, ())
            and not any(map(callee.answers, assignment.questions[place:]))
        }
        if hidden and replacements and not own_verdict.passed:
            best = _with_replacements(sitting, question, hidden, replacements)
            if best.score > own_verdict.score:
                names = ", ".join(f"`{name}`" for name in replacements)
                message = (
                    f"{best.message} This was graded with the right {names} in place of yours: "
                    f"with yours it would get {own_verdict.score:g} of {own_verdict.points:g} "
                    f"points."
                )
                verdict = replace(best, replaced=tuple(replacements), message=message)
        if not verdict.passed and question.id in assignment.right:
            failed.append(question)
        yield verdict


def _with_replacements(
    sitting: Sitting, question: Question, hidden: list[Case], replacements: Mapping[str, str]
) -> QuestionVerdict:
    """The best verdict on the hidden cases with right functions in place of the student's.

    They answer in the form that the question asks for, and then in that of the student's own
    answers: a caller may be written for either.
    """
    samples = {name: sitting.samples[name] for name in replacements if name in sitting.samples}
    verdicts = list[QuestionVerdict]()
    for forms in [{}, samples] if samples else [{}]:
        for state in range(sitting.states.get(question.function, 1)):
            answers = sitting.ask(question, hidden, state, replacements=replacements, samples=forms)
            verdicts.append(assess(question, hidden, answers))
            if verdicts[-1].passed:
                return verdicts[-1]
    return max(verdicts, key=lambda verdict: verdict.score)


def grade_one(
    submission: Submission,
    folder: str,
    wall: Wall,
    record: Record | None = None,
    *,
    share: float = IN_ALL,
) -> Record:
    """Read a submission, and grade it by the assignment in a folder.

    A `record` of it that still holds is kept. Raises `TakesLong` as `grade_submission` does.
    """
    wall = wall if wall.mode else open_wall(wall.hidden, wall.seconds)  # each machine its own
    assignment = read_assignment(folder)
    files, unread = read_files(submission.files)
    if not submission.files:
        unread = (NO_FILES,)
    mark = fingerprint(files, assignment, wall)
    late = submission.late
    if late is None:  # nobody says: what was said before holds
        late = record.late if record else 0.0
    if record and record.fingerprint == mark:
        return replace(record, late=late)
    verdict, code = grade_submission(files, wall, assignment, submission.student, share=share)
    verdict = replace(verdict, submission=submission.name, unread=unread + verdict.unread)
    return Record(verdict=verdict, fingerprint=mark, code=code, late=late)
