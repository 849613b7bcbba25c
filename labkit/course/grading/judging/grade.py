"""From a submission's cells to its verdict: build the calls, run them, judge what came.

A question whose earlier ones are wrong is graded once more with the right functions in their
place (follow-through), so that a slip costs its own points and no others. The right functions
are those of earlier questions alone: none that is asked for is in the box that answers it.
"""

from __future__ import annotations

import hashlib
import random
import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby

from labkit.course.grading.assignment.questions import Assignment, Case, Question
from labkit.course.grading.contract import Call, Fault, Outcome, SourceCell
from labkit.course.grading.judging.compare import ADVICE_ON, assess, is_missing, is_unwritten
from labkit.course.grading.judging.verdict import QuestionVerdict, SubmissionVerdict
from labkit.course.grading.sandbox.host import Sandbox

MAX_FAULTS = 5  # shared cells that failed and are named


@dataclass(frozen=True)
class _Sitting:
    """One submission before its questions: asked once, and some of them once more."""

    cells: Sequence[SourceCell]
    sandbox: Sandbox
    cases: Mapping[str, Sequence[Case]]
    turns: random.Random

    def ask(self, questions: Sequence[Question], *more: SourceCell) -> dict[str, list[Outcome]]:
        """The outcomes of all cases by question; the calls' ids are mere numbers."""
        order = {one.id: number for number, one in enumerate(questions)}
        asked = [
            (case.hidden, order[one.id], self.turns.random() if case.hidden else place, one, place)
            for one in questions
            for place, case in enumerate(self.cases[one.id])
        ]
        asked.sort(key=lambda entry: entry[:3])
        calls = [
            _call(number, one.id, one.function, self.cases[one.id][place])
            for number, (*_, one, place) in enumerate(asked)
        ]
        answers = self.sandbox.run([*self.cells, *more], calls)
        outcomes = {
            (one.id, place): outcome
            for (*_, one, place), outcome in zip(asked, answers, strict=True)
        }
        return {
            one.id: [outcomes[one.id, place] for place in range(len(self.cases[one.id]))]
            for one in questions
        }


def grade_submission(
    cells: Sequence[SourceCell],
    sandbox: Sandbox,
    assignment: Assignment,
    student: str,
    *,
    submission: str = "",
    notes: Sequence[str] = (),
    unread: Sequence[str] = (),
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
    unread : sequence of str
        What of the submission was not read.
    questions : collection of str
        Grade these alone, and ask those that they build on; empty for all.

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
    Therefore the visible cases of all questions are asked before any hidden one. Hidden cases
    come in an order that changes with the code, so that none can be told by its turn.
    """
    start = time.perf_counter()
    wanted = [assignment.question(id).id for id in questions] or [
        one.id for one in assignment.questions
    ]
    needed = set(wanted).union(*(assignment.below(id) for id in wanted))
    asked = [one for one in assignment.questions if one.id in needed]
    cases = {question.id: assignment.cases(question.id, student) for question in asked}
    sitting = _Sitting(cells, sandbox, cases, _turns(assignment, student, cells))
    outcomes = sitting.ask(asked)
    faults = tuple(map(_told, sandbox.faults[:MAX_FAULTS]))
    found = {one.id: assess(one, cases[one.id], outcomes[one.id]) for one in asked}
    if cells:
        found |= _follow_through(sitting, assignment, found)
    verdicts = tuple(found[one.id] for one in asked if one.id in wanted)
    if not cells:
        verdicts = tuple(replace(one, message="Nothing was found to grade.") for one in verdicts)
    return SubmissionVerdict(
        student=student,
        submission=submission,
        mode=sandbox.mode,
        questions=verdicts,
        score=_total(verdict.score for verdict in verdicts),
        points=_total(verdict.points for verdict in verdicts),
        notes=(*notes, *faults),
        unread=tuple(unread),
        seconds=time.perf_counter() - start,
    )


def _follow_through(
    sitting: _Sitting, assignment: Assignment, found: Mapping[str, QuestionVerdict]
) -> dict[str, QuestionVerdict]:
    """The questions that build on wrong ones, graded with the right functions in their place.

    Those that build on nothing but what is settled come first, all of a depth in one run.
    """
    wrong = {id for id, verdict in found.items() if not verdict.passed}
    better: dict[str, QuestionVerdict] = {}
    failing = [one for one in assignment.questions if one.id in wrong]
    for _, same_depth in groupby(sorted(failing, key=assignment.depth), key=assignment.depth):
        again = [one for one in same_depth if assignment.below(one.id) & wrong]
        below = set().union(*(assignment.below(one.id) for one in again)) & wrong
        replaced = [
            one for one in assignment.questions if one.id in below & assignment.right.keys()
        ]
        if not replaced:
            continue
        source = "\n\n".join(assignment.right[one.id] for one in replaced)
        stand_in = SourceCell(source=source, question=None, label="the right functions")
        outcomes = sitting.ask(again, stand_in)
        for question in again:
            old = found[question.id]
            ours = outcomes[question.id]
            new = assess(question, sitting.cases[question.id], ours)
            if new.score < old.score or is_unwritten(ours) or is_missing(ours):
                continue
            own = assignment.below(question.id)
            names = [one.function for one in replaced if one.id in own]
            better[question.id] = replace(
                new, replaced=tuple(names), message=f"{new.message} {_credited(names, old, new)}"
            )
            if new.passed:
                wrong.discard(question.id)
    return better


def _credited(names: Sequence[str], old: QuestionVerdict, new: QuestionVerdict) -> str:
    """What to say of a question that was graded with other functions than the student's."""
    those = ", ".join(f"`{name}`" for name in names)
    if new.score > old.score:
        return (
            f"This was graded with the right {those} in place of yours: with yours it would get "
            f"{old.score:g} of {old.points:g} points."
        )
    return f"That is so with the right {those} in place of yours, too."


def _told(fault: Fault) -> str:
    """A shared cell that failed, in words."""
    advice = ADVICE_ON.get(fault.error, "what needs it fails, too")
    return f"{fault.label} did not run: {fault.message}; {advice}."


def _turns(assignment: Assignment, student: str, cells: Sequence[SourceCell]) -> random.Random:
    """What the order of hidden calls is drawn from: other code, another order."""
    digest = hashlib.sha256(f"{assignment.salt}\n{student}".encode("utf-8", "surrogatepass"))
    for cell in cells:
        digest.update(cell.source.encode("utf-8", "surrogatepass"))
    return random.Random(digest.digest())


def _call(number: int, question: str, function: str, case: Case) -> Call:
    """The call of a case; a visible one's is the same object for all who are asked it."""
    make = _new_call if case.hidden else _same_call
    return make(number, question, function, case)


def _new_call(number: int, question: str, function: str, case: Case) -> Call:
    return Call(id=str(number), question=question, function=function, arguments=case.arguments)


_same_call = cache(_new_call)


def _total(amounts: Iterable[float]) -> float:
    return round(sum(amounts), 2)
