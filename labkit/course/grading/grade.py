"""From a submission's files to its verdict: run them in a box, call its functions, judge.

Each question is asked with what its own cells left behind and, where that differs, with what the
whole notebook left behind; the best verdict counts. A question that calls wrong earlier ones is
then asked once more with the right functions in their place (follow-through).

All visible cases are asked before any hidden one: what a student reads of a visible case was
written before a hidden input came into the box. In follow-through hidden cases alone are asked.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.assignment.questions import Assignment, Case, Question
from labkit.course.grading.box import (
    IN_ALL,
    TOO_LONG,
    Box,
    BoxError,
    MachineError,
    Wall,
    open_wall,
)
from labkit.course.grading.handins import Submission, read_files
from labkit.course.grading.inside import data
from labkit.course.grading.judging.compare import assess
from labkit.course.grading.judging.verdict import (
    KILLED,
    NO_RESULT,
    NOT_DEFINED,
    Outcome,
    QuestionVerdict,
    SubmissionVerdict,
)
from labkit.course.grading.reading import Program, read_apart
from labkit.course.grading.store import Record, fingerprint

MAX_NOTES = 20
MAX_FAILURES = 5  # boxes that end in the cells
CELLS, CALLS, CUT = 5.0, 2.0, 1.0  # for all cells and all calls of an order, of what the box cuts
OUT_OF_TIME = "OutOfTime"


class Told(NamedTuple):
    """Remarks of the box on an answer; they decide no mark."""

    states: Sequence[str] = ("last",)  # to ask in: after the cells that define it, and others
    calls: frozenset[str] = frozenset()  # the functions that it uses
    hands_on: str = ""  # the one to which it only hands its work on

    @classmethod
    def read(cls, said: Any) -> Told:
        """Check what the box says."""
        lists = [map(str, _as(list, _as(dict, said).get(name))) for name in ("states", "calls")]
        states = list(dict.fromkeys(["last", *lists[0]]))[:3]
        return cls(states, frozenset(lists[1]), str(_as(dict, said).get("hands_on")))


class Sitting:
    """One submission in a box, which is started anew where the code ends it.

    No word of a box counts once a hidden case was sent to one: what the box says of the cells
    and of the answers was said before.
    """

    def __init__(self, program: Program, functions: Sequence[str], wall: Wall) -> None:
        self.cells, self.scripts = list(program.cells), program.scripts
        self.functions, self.wall = functions, wall
        self.left = IN_ALL * wall.seconds  # of processor time
        self.budget = dict.fromkeys(functions, wall.seconds)  # of it, for each question
        self.box: Box | None = None
        self.failures, self.is_sealed = 0, False
        self.left_out, self.notes = list(program.notes), list[str]()
        self.answers: dict[str, Told] = {}
        self.hung: set[tuple[str, str]] = set()  # functions that ended a box, each in a state

    def open(self) -> None:
        """Start a box and have the cells run; one that ends the box is left out from then on."""
        while self.cells and not self.box and self.failures < MAX_FAILURES and self.left > 0.0:
            cell, self.box = -1, Box(self.wall)
            try:
                order = {"cells": self.cells, "scripts": self.scripts, "functions": self.functions}
                self.box.send(CELLS * self.wall.seconds + CUT, **order)
                said: dict[str, Any] = {}
                for _ in range(len(self.cells) + 1):
                    said = self.box.receive()
                    place = said.get("cell")
                    cell = place if isinstance(place, int) else cell
                if not self.is_sealed:
                    self.notes = [*self.left_out, *_as(list, said.get("notes"))]
                    answers = _as(dict, said.get("answers")).items()
                    self.answers = {name: Told.read(each) for name, each in answers}
            except BoxError as error:
                self.close()
                self.failures += 1
                label = self.cells.pop(cell).label if 0 <= cell < len(self.cells) else ""
                if not self.is_sealed:
                    self.notes = [f"the notebook could not be run to its end: {error}"]
                    says = f"{label} ended the program or hung, so it is left out"
                    self.left_out += [says] if label else []

    def told(self, question: Question) -> Told:
        """Remarks of the box on an answer."""
        return self.answers.get(question.function, Told())

    def fault(self, question: Question, state: str, lent: Collection[str]) -> Outcome | None:
        """The outcome of a question that is not asked: what ended a box is not called again."""
        name = question.function
        if self.cells and self.box is None:
            return Outcome(error=KILLED if self.left > 0.0 else OUT_OF_TIME)
        if name not in self.answers:
            return Outcome(error=NOT_DEFINED)
        hung = {one for one, _ in self.hung} - {name, *lent}
        if (name, state) in self.hung or hung & self.told(question).calls:
            return Outcome(error=OUT_OF_TIME)
        return None

    def ask(
        self,
        question: Question,
        cases: Sequence[Case],
        state: str,
        right: Mapping[str, str] | None = None,
    ) -> list[Outcome]:
        """The outcomes of some cases of one question, all visible or all hidden."""
        self.open()
        fault = self.fault(question, state, right or ())
        if fault or self.box is None:
            return [fault or Outcome(error=KILLED)] * len(cases)
        name, hidden = question.function, any(case.hidden for case in cases)
        self.is_sealed |= hidden
        patience = self.wall.seconds / 2.0 / (1 + len(self.hung) // 3)
        seconds = patience if right else min(patience, self.budget[name])
        before, outcomes = self.box.used()[0], list[Outcome]()
        try:
            calls = [[data.to_json(argument) for argument in case.arguments] for case in cases]
            order = {"function": name, "state": state, "right": dict(right or {}), "calls": calls}
            self.box.send(CALLS * seconds + CUT, seconds=max(seconds, 0.01), **order)
            outcomes += [outcome(self.box.receive()) for _ in cases]
            self.budget[name] -= self.box.used()[0] - before
        except BoxError as error:
            self.close()
            self.hung.add((name, state))
            ending = Outcome(error=OUT_OF_TIME if str(error) == TOO_LONG else KILLED)
            outcomes += [ending] * (len(cases) - len(outcomes))
        if any(one.error == OUT_OF_TIME for one in outcomes):
            self.hung.add((name, state))
        return [
            replace(one, error=one.error and NO_RESULT, message="") if hidden else one
            for one in outcomes
        ]

    def close(self) -> None:
        """End the box, and count its time."""
        if self.box:
            self.left -= self.box.used()[0]
            self.box.close()
        self.box = None


def outcome(said: Mapping[str, Any]) -> Outcome:
    """Read what the box says of a call; `BoxError` where it is no answer."""
    try:
        if "error" not in said:
            return Outcome(value=data.from_json(said["value"]))
    except (KeyError, ValueError, RecursionError):
        raise BoxError("the program sent an invalid answer") from None
    error = str(said["error"])
    error = error if error.isidentifier() else "Exception"
    return Outcome(error=error, message=shown(said.get("message") or ""))


def shown(text: object) -> str:
    """A student's text without what a terminal or a page would not print, and cut."""
    return "".join(letter if letter.isprintable() else " " for letter in str(text)[:600])


def _as(kind: type, value: Any) -> Any:
    """A value of the box where it is of that kind, and an empty one where it is not."""
    return value if isinstance(value, kind) else kind()


def grade_submission(
    program: Program,
    wall: Wall,
    assignment: Assignment,
    student: str,
    *,
    name: str = "",
    unread: Sequence[str] = (),
) -> SubmissionVerdict:
    """Grade a program behind a wall; the verdict is always the same, but for `seconds`.

    `student` chooses the variant of the hidden cases, `name` is for people, `unread` what was not
    read.
    """
    start = time.perf_counter()
    sitting = Sitting(program, [one.function for one in assignment.questions], wall)
    try:
        sitting.open()
        found = _first_round(sitting, assignment, student)
        found |= _follow_through(sitting, assignment, student, found)
    finally:
        sitting.close()
    verdicts = tuple(found[one.id] for one in assignment.questions)
    if not program.cells:
        verdicts = tuple(replace(one, message="Nothing was found to grade.") for one in verdicts)
    return SubmissionVerdict(
        student=student,
        submission=name or student,
        mode=wall.mode,
        questions=verdicts,
        score=round(sum(one.score for one in verdicts), 2),
        points=round(sum(one.points for one in verdicts), 2),
        notes=tuple(map(shown, sitting.notes[:MAX_NOTES])),
        unread=(*unread, *map(shown, program.unread)),
        seconds=time.perf_counter() - start,
    )


def _first_round(
    sitting: Sitting, assignment: Assignment, student: str
) -> dict[str, QuestionVerdict]:
    """Each question by the student's functions alone: visible cases of all, then hidden ones."""
    asked = [
        (question, state, sitting.ask(question, assignment.visible[question.id], state))
        for question in assignment.questions
        for state in sitting.told(question).states
    ]
    found: dict[str, QuestionVerdict] = {}
    for question, state, outcomes in asked:
        before = found.get(question.id)
        if before and before.passed:
            continue
        cases = assignment.cases(question.id, student)
        hidden = [case for case in cases if case.hidden]
        if all(one.error == "NotImplementedError" for one in outcomes):
            answers = outcomes[:1] * len(hidden)
        else:
            answers = sitting.ask(question, hidden, state)
        verdict = assess(question, cases, [*outcomes, *answers])
        if before is None or verdict.score > before.score:
            found[question.id] = verdict
    return found


def _follow_through(
    sitting: Sitting, assignment: Assignment, student: str, found: Mapping[str, QuestionVerdict]
) -> dict[str, QuestionVerdict]:
    """The questions that call wrong earlier ones, with the right functions in their place.

    No right function is lent to an answer that only hands its work on to it, nor to a question
    that it would answer outright, nor to an earlier question than its own: so none that is asked
    for is in the box before it is asked.
    """
    better: dict[str, QuestionVerdict] = {}
    wrong: dict[str, str] = {}  # right sources of the functions that are wrong, by name
    for question in assignment.questions:
        best = old = found[question.id]
        if old.passed:
            continue
        told = sitting.told(question)
        lent = {
            name: source
            for name, source in wrong.items()
            if name in told.calls
            and name != told.hands_on
            and not assignment.answers(name, question.id)
        }
        hidden = [case for case in assignment.cases(question.id, student) if case.hidden]
        for state in told.states if lent and hidden else ():
            new = assess(question, hidden, sitting.ask(question, hidden, state, lent))
            if new.score > best.score:
                says = (
                    f"{new.message} This was graded with the right "
                    f"{', '.join(f'`{name}`' for name in lent)} in place of yours: with yours it "
                    f"would get {old.score:g} of {old.points:g} points."
                )
                best = better[question.id] = replace(new, replaced=tuple(lent), message=says)
        if not best.passed and question.id in assignment.right:
            wrong[question.function] = assignment.lent(question.id)
    return better


@cache
def own_wall(wall: Wall) -> Wall:
    """The wall of this process, on whatever machine it runs."""
    return open_wall(wall.hidden, wall.seconds)


def grade_one(
    submission: Submission, assignment: str, wall: Wall, known: Record | None = None
) -> Record:
    """Read a submission, and grade it by the assignment in a folder unless `known` still holds."""
    wall = wall if wall.mode else own_wall(wall)
    asked = load_assignment(assignment)
    files, unread = read_files(submission.files)
    mark = fingerprint(files, asked, wall)
    late = submission.late
    if late is None:  # nobody says: what was said before holds
        late = known.late if known else 0.0
    if known and known.fingerprint == mark:
        return replace(known, late=late)
    student, name = submission.student, submission.name
    program = read_apart(files, [one.function for one in asked.questions])
    if program is None:
        raise MachineError("this machine was too busy to read its files; grade it again")
    verdict = grade_submission(program, wall, asked, student, name=name, unread=unread)
    return Record(verdict=verdict, fingerprint=mark, code=program.code, late=late)
