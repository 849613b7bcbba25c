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

from labkit.grading.box.outside import Wall, open_wall
from labkit.grading.classroom.handins import Submission, read_files
from labkit.grading.classroom.store import Record, fingerprint
from labkit.grading.judge.compare import assess
from labkit.grading.judge.verdict import QuestionVerdict, Status, SubmissionVerdict
from labkit.grading.questions import Assignment, Question, read_assignment
from labkit.grading.sitting import Sitting, shown

MAX_NOTES = 20
NO_FILES = "nothing was handed in but an empty folder, or one of hidden files"


def grade_submission(
    files: Mapping[str, bytes], wall: Wall, assignment: Assignment, student: str
) -> tuple[SubmissionVerdict, str]:
    """Grade files behind a wall: the verdict, always the same but for `seconds`, and all code."""
    start = time.perf_counter()
    sitting = Sitting([one.function for one in assignment.questions], wall)
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
        score=round(sum(one.score for one in verdicts), 2),
        points=round(sum(one.points for one in verdicts), 2),
        notes=tuple(map(shown, [*program.notes, *sitting.notes][:MAX_NOTES])),
        unread=tuple(map(shown, program.unread)),
        seconds=time.perf_counter() - start,
        is_graded=bool(program.scripts),
    )
    return verdict, "\n\n".join(program.scripts.values()).encode("utf-8", "replace").decode()


def _verdicts(sitting: Sitting, assignment: Assignment) -> Iterator[QuestionVerdict]:
    """Each question by the student's functions, then with right ones for wrong ones that it calls.

    No right function is lent to an earlier question than its own, nor before a question that it
    would answer outright: so none that is asked for is in the box before it is asked.
    """
    seen = [
        [
            sitting.ask(one, assignment.visible[one.id], k)
            for k in range(sitting.states.get(one.function, 1))
        ]
        for one in assignment.questions
    ]
    wrong: list[Question] = []
    for place, question in enumerate(assignment.questions):
        cases = assignment.cases(question.id)
        hidden = [case for case in cases if case.hidden]
        tried = list[QuestionVerdict]()
        for state, outcomes in enumerate(seen[place]):
            if all(one.status is Status.NOT_WRITTEN for one in outcomes):
                answers = outcomes[:1] * len(hidden)
            else:
                passed = assess(question, assignment.visible[question.id], outcomes).passed
                answers = sitting.ask(question, hidden, state, trusted=passed)
            tried.append(assess(question, cases, [*outcomes, *answers]))
            if tried[-1].passed:
                break
        best = old = max(tried, key=lambda one: one.score)
        lent = {
            one.function: assignment.lent(one.id)
            for one in wrong
            if one.function in sitting.calls.get(question.function, ())
            and not any(map(one.answers, assignment.questions[place:]))
        }
        for state in range(len(seen[place]) if lent and hidden and not old.passed else 0):
            answers = sitting.ask(question, hidden, state, right=lent)
            new = assess(question, hidden, answers)
            if new.score > best.score:
                says = (
                    f"{new.message} This was graded with the right "
                    f"{', '.join(f'`{name}`' for name in lent)} in place of yours: with yours it "
                    f"would get {old.score:g} of {old.points:g} points."
                )
                best = replace(new, replaced=tuple(lent), message=says)
        if not best.passed and question.id in assignment.right:
            wrong.append(question)
        yield best


def grade_one(
    submission: Submission, assignment: str, wall: Wall, known: Record | None = None
) -> Record:
    """Read a submission, and grade it by the assignment in a folder unless `known` still holds."""
    wall = wall if wall.mode else open_wall(wall.hidden, wall.seconds)  # each machine its own
    asked = read_assignment(assignment)
    files, unread = read_files(submission.files)
    if not submission.files:
        unread = (NO_FILES,)
    mark = fingerprint(files, asked, wall)
    late = submission.late
    if late is None:  # nobody says: what was said before holds
        late = known.late if known else 0.0
    if known and known.fingerprint == mark:
        return replace(known, late=late)
    verdict, code = grade_submission(files, wall, asked, submission.student)
    verdict = replace(verdict, submission=submission.name, unread=unread + verdict.unread)
    return Record(verdict=verdict, fingerprint=mark, code=code, late=late)
