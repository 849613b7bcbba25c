"""From a submission's files to its verdict: run them in a box, call its functions, judge.

Each question is asked with what its own cell left behind and, where that differs, with what the
whole notebook left behind; the better verdict counts. A question that calls wrong earlier ones is
then asked once more with the right functions in their place (follow-through), so that a slip costs
its own points and no others.

All visible cases are asked before any hidden one: what a student reads of a visible case was
written before a hidden input came into the box. In follow-through hidden cases alone are asked.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from labkit.course.grading.assignment.questions import Assignment, Case, Question
from labkit.course.grading.box import Box, BoxError, Wall
from labkit.course.grading.contract import Limits, Outcome, OutcomeStatus
from labkit.course.grading.inside import data
from labkit.course.grading.judging.compare import assess
from labkit.course.grading.judging.verdict import QuestionVerdict, SubmissionVerdict

MAX_NOTES = 20
MAX_RESTARTS = 2
OWN, END = "own", "end"
STATUS = {"it took too long": OutcomeStatus.TIMEOUT, "it said too much": OutcomeStatus.TOO_LARGE}


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What is known of one answer from its code.

    Attributes
    ----------
    changes : bool
        Whether something that it uses was changed after its own cell.
    calls : frozenset of str
        The functions of other questions that it calls, and that these call.
    hands_on : str
        The function to which it hands all its work; empty where it does more.
    """

    changes: bool
    calls: frozenset[str]
    hands_on: str


class Sitting:
    """One submission in its box, which is started anew where the code ends it.

    Parameters
    ----------
    files : mapping of str to bytes
        Its notebooks and scripts.
    functions : sequence of str
        The names of the functions that are asked for.
    wall : Wall
    limits : Limits
    """

    def __init__(
        self, files: Mapping[str, bytes], functions: Sequence[str], wall: Wall, limits: Limits
    ) -> None:
        self.files, self.functions, self.wall, self.limits = files, functions, wall, limits
        self.end = time.monotonic() + limits.clock
        self.box: Box | None = None
        self.skipped: list[int] = []
        self.restarts = -1
        self.notes: list[str] = []
        self.answers: dict[str, Answer] = {}
        self.broken: dict[str, str] = {}
        self.open()

    def open(self) -> None:
        """Start a box and have the cells run; one that ends the box is left out from then on."""
        while self.box is None and self.restarts < MAX_RESTARTS:
            self.restarts += 1
            cell = -1
            box = Box(self.wall, self.limits)  # an error here is the machine's, not the student's
            try:
                box.read(dict(self.files), self.functions, self.skipped, self._soon())
                while "answers" not in (said := box.receive(self._soon())):
                    place = said.get("cell")
                    cell = place if isinstance(place, int) else cell
                self._note(said)
                self.box = box
            except BoxError as error:
                box.close()
                self.notes = [f"the notebook could not be run to its end: {error}"]
                self.skipped.append(cell)

    def _soon(self) -> float:
        """Until when a single step may take; after it has hung once there is less patience."""
        patience = 3.0 if self.restarts <= 0 else 1.5
        return min(self.end, time.monotonic() + patience * self.limits.seconds + 1.0)

    def _note(self, said: Mapping[str, Any]) -> None:
        """Take in what the box says of the submission; none of it decides a mark."""
        self.notes = [shown(note) for note in _list(said.get("notes"))[:MAX_NOTES]]
        broken = said.get("broken")
        self.broken = {
            name: shown(why) for name, why in (broken if isinstance(broken, dict) else {}).items()
        }
        answers = said["answers"] if isinstance(said["answers"], dict) else {}
        self.answers = {
            name: Answer(
                changes=bool(told.get("changes")),
                calls=frozenset(map(str, _list(told.get("calls")))),
                hands_on=str(told.get("hands_on")),
            )
            for name, told in answers.items()
            if isinstance(told, dict)
        }

    def ask(
        self,
        question: Question,
        cases: Sequence[Case],
        state: str,
        right: Mapping[str, str] | None = None,
    ) -> list[Outcome]:
        """The outcomes of some cases of one question, all visible or all hidden."""
        name = question.function
        self.open()
        if self.box is None:
            return [Outcome(id=case.id, status=OutcomeStatus.KILLED) for case in cases]
        if name not in self.answers:
            failed = name in self.broken
            status = OutcomeStatus.SOURCE_FAILED if failed else OutcomeStatus.NOT_DEFINED
            message = self.broken.get(name, "")
            return [Outcome(id=case.id, status=status, message=message) for case in cases]
        outcomes: list[Outcome] = []
        end = self._soon()
        try:
            calls = [[data.to_json(argument) for argument in case.arguments] for case in cases]
            self.box.ask(name, state, dict(right or {}), calls, end)
            for case in cases:
                start = time.monotonic()
                said = self.box.receive(end)
                outcomes.append(outcome(case.id, said, time.monotonic() - start))
        except BoxError as error:
            status = STATUS.get(str(error), OutcomeStatus.KILLED)
            outcomes += [Outcome(id=case.id, status=status) for case in cases[len(outcomes) :]]
            self.close()
        return outcomes

    def close(self) -> None:
        """End the box."""
        if self.box:
            self.box.close()
            self.box = None


def outcome(id: str, said: Mapping[str, Any], seconds: float) -> Outcome:
    """What the box says of a call, with nothing taken on trust.

    Raises
    ------
    BoxError
        Where it is no answer.
    """
    status = OutcomeStatus.__members__.get(str(said.get("status")))
    if status is None:
        raise BoxError("it spoke out of turn")
    try:
        value = data.from_json(said.get("value")) if status is OutcomeStatus.RETURNED else None
    except (ValueError, RecursionError):
        raise BoxError("it spoke out of turn") from None
    error = str(said.get("error") or "")
    return Outcome(
        id=id,
        status=status,
        value=value,
        message=shown(said.get("message") or ""),
        error=error if error.isidentifier() else "",
        seconds=seconds,
    )


def shown(text: object) -> str:
    """A student's text without what a terminal or a page would not print, and cut."""
    return "".join(letter if letter.isprintable() else " " for letter in str(text)[:600])


def _list(value: object) -> list[Any]:
    return value if isinstance(value, list) else []


def grade_submission(
    files: Mapping[str, bytes],
    wall: Wall,
    limits: Limits,
    assignment: Assignment,
    student: str,
    *,
    submission: str = "",
    unread: Sequence[str] = (),
) -> SubmissionVerdict:
    """Grade one submission.

    Parameters
    ----------
    files : mapping of str to bytes
        Its notebooks and scripts.
    wall, limits
        Where they run, and what they may use.
    assignment : Assignment
        What they are held to; `student` chooses the variant of the hidden cases.
    student, submission : str
        Who handed it in, and its name for a person.
    unread : sequence of str
        What of it was not read.

    Returns
    -------
    SubmissionVerdict
        Of the same submission always the same, but for `seconds`.
    """
    start = time.perf_counter()
    sitting = Sitting(files, [one.function for one in assignment.questions], wall, limits)
    try:
        found = _first_round(sitting, assignment, student)
        if files:
            found |= _follow_through(sitting, assignment, student, found)
    finally:
        sitting.close()
    verdicts = tuple(found[one.id] for one in assignment.questions)
    if not files:
        verdicts = tuple(replace(one, message="Nothing was found to grade.") for one in verdicts)
    return SubmissionVerdict(
        student=student,
        submission=submission or student,
        mode=wall.mode,
        questions=verdicts,
        score=round(sum(one.score for one in verdicts), 2),
        points=round(sum(one.points for one in verdicts), 2),
        notes=tuple(sitting.notes),
        unread=tuple(unread),
        seconds=time.perf_counter() - start,
    )


def _first_round(
    sitting: Sitting, assignment: Assignment, student: str
) -> dict[str, QuestionVerdict]:
    """Each question by the student's functions alone: visible cases of all, then hidden ones."""
    asked: list[tuple[Question, str, list[Outcome]]] = []
    for question in assignment.questions:
        answer = sitting.answers.get(question.function)
        for state in (OWN, END) if answer and answer.changes else (OWN,):
            visible = assignment.visible[question.id]
            asked.append((question, state, sitting.ask(question, visible, state)))
    found: dict[str, QuestionVerdict] = {}
    for question, state, outcomes in asked:
        before = found.get(question.id)
        if before and before.passed:
            continue
        cases = assignment.cases(question.id, student)
        hidden = sitting.ask(question, [case for case in cases if case.hidden], state)
        verdict = assess(question, cases, [*outcomes, *hidden])
        if before is None or verdict.score > before.score:
            found[question.id] = verdict
    return found


def _follow_through(
    sitting: Sitting, assignment: Assignment, student: str, found: Mapping[str, QuestionVerdict]
) -> dict[str, QuestionVerdict]:
    """The questions that call wrong earlier ones, with the right functions in their place.

    No right function is lent to an answer that only hands its work on to it, nor to an earlier
    question than its own: so none that is asked for is in the box before it is asked.
    """
    better: dict[str, QuestionVerdict] = {}
    wrong: dict[str, Question] = {}
    for question in assignment.questions:
        old = found[question.id]
        if old.passed:
            continue
        answer = sitting.answers.get(question.function)
        lent = {
            one.function: assignment.right[id]
            for id, one in wrong.items()
            if answer
            and one.function in answer.calls
            and one.function != answer.hands_on
            and id in assignment.right
        }
        wrong[question.id] = question
        hidden = [case for case in assignment.cases(question.id, student) if case.hidden]
        if not lent or not hidden:
            continue
        for state in (OWN, END) if answer and answer.changes else (OWN,):
            new = assess(question, hidden, sitting.ask(question, hidden, state, lent))
            if new.score > better.get(question.id, old).score:
                names = ", ".join(f"`{name}`" for name in lent)
                told = (
                    f"This was graded with the right {names} in place of yours: with yours it "
                    f"would get {old.score:g} of {old.points:g} points."
                )
                better[question.id] = replace(
                    new, replaced=tuple(lent), message=f"{new.message} {told}"
                )
        if question.id in better and better[question.id].passed:
            del wrong[question.id]
    return better
