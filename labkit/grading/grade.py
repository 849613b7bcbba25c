"""From a submission's files to its verdict: run them in a box, call its functions, judge.

Each question is asked with what its own cells left behind and, where that differs, with what the
whole notebook left behind; the best verdict counts. One that calls wrong earlier ones is then asked
its hidden cases once more with the right functions in their place (follow-through).

All visible cases are asked before any hidden one: what a student reads of a visible case was
written before a hidden input came into the box.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from labkit.grading.box.inside import data
from labkit.grading.box.inside.reading import Program
from labkit.grading.box.outside import IN_ALL, PACKAGE, TOO_LONG, Box, BoxError, Wall, open_wall
from labkit.grading.classroom.handins import Submission, read_files
from labkit.grading.classroom.store import Record, fingerprint
from labkit.grading.judge.compare import assess
from labkit.grading.judge.verdict import (
    KILLED,
    NO_RESULT,
    NOT_DEFINED,
    Outcome,
    QuestionVerdict,
    SubmissionVerdict,
)
from labkit.grading.questions import Assignment, Case, Question, read_assignment

MAX_NOTES = 20
MAX_PROGRAM = 1 << 27  # bytes of what was read, which are code and no answer
READING = 10.0  # [s] of processor time for the files
CELLS, CALLS, CUT = 5.0, 2.0, 1.0  # for all cells and all calls of an order, of what the box cuts
OUT_OF_TIME = "OutOfTime"
UNREADABLE = "the files cannot be read with little time and memory; hand in the notebook alone"
HANDED_OUT = [path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py")]


class Sitting:
    """One submission in a box, which is started anew where the code ends it.

    No word of a box counts once a hidden case was sent to one: what the box says of the cells
    and of the answers was said before.
    """

    def __init__(self, functions: Sequence[str], wall: Wall) -> None:
        self.functions, self.wall = functions, wall
        self.left = IN_ALL * wall.seconds  # of processor time
        self.box: Box | None = None
        self.program = Program([], {}, [], [])
        self.notes, self.is_sealed = list[str](), False
        # How many states each answer has: after the cells that define it, and others.
        self.states: dict[str, int] = {}
        self.calls: dict[str, set[str]] = {}  # functions that an answer uses
        self.hung: set[tuple[str, int]] = set()  # functions that ended a box, each in a state

    def read(self, files: Mapping[str, bytes]) -> None:
        """Have the files read, before any code of theirs is in the box, and then the cells run."""
        self.box = Box(self.wall, self.left)
        sizes = {name: len(data) for name, data in files.items()}
        order = {"sizes": sizes, "functions": self.functions, "handed_out": HANDED_OUT}
        try:
            self.box.send(READING, b"".join(files.values()), **order)
            self.program = Program(**self.box.receive(MAX_PROGRAM))
        except BoxError:
            self.close()
            self.program.unread.append(UNREADABLE)
        self.run()

    def run(self) -> None:
        """Have the cells run; one that ends the box is left out from then on."""
        cells = self.program.cells
        order = {"cells": cells, "scripts": self.program.scripts, "functions": self.functions}
        while cells and self.left > 0.0:
            cell, self.box = 0, self.box or Box(self.wall, self.left)
            try:
                self.box.send(CELLS * self.wall.seconds + CUT, **order)
                said: dict[str, Any] = {}
                for _ in range(len(cells) + 1):
                    said = self.box.receive()
                    cell = said.get("cell", cell)
                if not self.is_sealed:
                    self.notes = list(said["notes"])
                    told = said["answers"].items()
                    self.calls = {name: set(each["calls"]) for name, each in told}
                    self.states = {name: max(1, len(each["states"][:3])) for name, each in told}
                return
            except (BoxError, LookupError, TypeError, AttributeError):  # untrusted
                self.close()
                is_place = isinstance(cell, int) and 0 <= cell < len(cells)
                _, label = cells.pop(cell if is_place else 0)
                if not self.is_sealed:
                    says = f"{label} ended the program or hung, so it is left out"
                    self.program.notes.append(says)

    def ask(
        self, question: Question, cases: Sequence[Case], state: int, right: Mapping[str, str] = {}
    ) -> list[Outcome]:
        """The outcomes of some cases of one question, all visible or all hidden.

        What has ended a box, or run out of time, is called no more.
        """
        name = question.function
        if self.box is None:
            self.run()
        if self.box is None or name not in self.states:
            fault = OUT_OF_TIME if self.left <= 0.0 else NOT_DEFINED
            return [Outcome(error=fault)] * len(cases)
        hung = {one for one, _ in self.hung} - {name, *right}
        if (name, state) in self.hung or hung & self.calls[name]:
            return [Outcome(error=OUT_OF_TIME)] * len(cases)
        hidden = any(case.hidden for case in cases)
        self.is_sealed |= hidden
        seconds = self.wall.seconds / 2.0 / (1 + len(self.hung) // 3)
        outcomes = list[Outcome]()
        try:
            calls = [[data.to_json(argument) for argument in case.arguments] for case in cases]
            order = {"function": name, "state": state, "right": right, "calls": calls}
            self.box.send(CALLS * seconds + CUT, seconds=seconds, **order)
            outcomes += [outcome(self.box.receive()) for _ in cases]
        except BoxError as error:
            self.close()
            ending = Outcome(error=OUT_OF_TIME if str(error) == TOO_LONG else KILLED)
            outcomes += [ending] * (len(cases) - len(outcomes))
        if any(one.error in (OUT_OF_TIME, KILLED) for one in outcomes):
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


def grade_submission(
    files: Mapping[str, bytes], wall: Wall, assignment: Assignment, student: str
) -> tuple[SubmissionVerdict, str]:
    """Grade files behind a wall: the verdict, always the same but for `seconds`, and all code.

    `student` chooses the variant of the hidden cases.
    """
    start = time.perf_counter()
    sitting = Sitting([one.function for one in assignment.questions], wall)
    try:
        if files:
            sitting.read(files)
        verdicts = tuple(_verdicts(sitting, assignment, student))
    finally:
        sitting.close()
    program = sitting.program
    if not program.scripts:
        verdicts = tuple(replace(one, message="Nothing was found to grade.") for one in verdicts)
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
    )
    return verdict, "\n\n".join(program.scripts.values()).encode("utf-8", "replace").decode()


def _verdicts(sitting: Sitting, assignment: Assignment, student: str) -> Iterator[QuestionVerdict]:
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
        cases = assignment.cases(question.id, student)
        hidden = [case for case in cases if case.hidden]
        tried = list[QuestionVerdict]()
        for state, outcomes in enumerate(seen[place]):
            is_written = any(one.error != "NotImplementedError" for one in outcomes)
            alike = outcomes[:1] * len(hidden)
            answers = sitting.ask(question, hidden, state) if is_written else alike
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
            new = assess(question, hidden, sitting.ask(question, hidden, state, lent))
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
    mark = fingerprint(files, asked, wall)
    late = submission.late
    if late is None:  # nobody says: what was said before holds
        late = known.late if known else 0.0
    if known and known.fingerprint == mark:
        return replace(known, late=late)
    verdict, code = grade_submission(files, wall, asked, submission.student)
    verdict = replace(verdict, submission=submission.name, unread=unread + verdict.unread)
    return Record(verdict=verdict, fingerprint=mark, code=code, late=late)
