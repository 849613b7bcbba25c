"""One submission in its box: its files are read, its cells run, its functions called."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from labkit.grading.box.inside import data
from labkit.grading.box.inside.limits import MAX_PROGRAM, READING, Time, waiting_time
from labkit.grading.box.inside.reading import Program
from labkit.grading.box.outside import PACKAGE, Box, Wall
from labkit.grading.box.watch import BoxError, BoxTimeout
from labkit.grading.judge.compare import is_readable
from labkit.grading.judge.verdict import Outcome, Status, clean_text, read_outcome
from labkit.grading.questions import Case, Question

UNREADABLE = "the files cannot be read with little time and memory; hand in the notebook alone"
HANDED_OUT = [path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py")]


class Sitting:
    """One submission in a box, which is started anew where the code ends it.

    What the box says of the cells and of the answers counts until the first hidden case is sent to
    it, and no longer.
    """

    def __init__(self, functions: Sequence[str], wall: Wall) -> None:
        self.functions = functions
        self.wall = wall
        self.time = Time(wall.seconds)
        self.box: Box | None = None
        self.program = Program([], {}, [], [])
        self.notes = list[str]()
        self.is_sealed = False
        # How many states each answer has: after the last cell that defines it, and at the end.
        self.states: dict[str, int] = {}
        self.calls: dict[str, set[str]] = {}  # functions that an answer uses
        self.faults: dict[str, str] = {}  # why functions could not be parsed
        self.readable = set[str]()  # functions whose answer to a visible case could be read
        self.writing = set[str]()  # functions that wrote into an argument of a visible case

    def read(self, files: Mapping[str, bytes]) -> None:
        """Have the files read, before any code of theirs is in the box, and then the cells run."""
        self.box = Box(self.wall, self.time.left)
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
        while cells and not self.time.is_over:
            cell = 0
            self.box = self.box or Box(self.wall, self.time.left)
            try:
                self.box.send(self.time.cells, **order)
                reply: dict[str, Any] = {}
                for _ in range(len(cells) + 1):
                    reply = self.box.receive()
                    cell = reply.get("cell", cell)
                if not self.is_sealed:
                    self.notes = list(reply["notes"])
                    self.faults = {str(k): clean_text(v) for k, v in dict(reply["faults"]).items()}
                    answers = reply["answers"].items()
                    self.calls = {name: set(answer["calls"]) for name, answer in answers}
                    self.states = {
                        name: max(1, len(answer["states"][:2])) for name, answer in answers
                    }
                return
            except (BoxError, LookupError, TypeError, ValueError, AttributeError):  # untrusted
                self.close()
                is_place = isinstance(cell, int) and 0 <= cell < len(cells)
                _, label = cells.pop(cell if is_place else 0)
                if not self.is_sealed:
                    note = f"{label} ended the program or hung, so it is left out"
                    self.program.notes.append(note)

    def ask(
        self,
        question: Question,
        cases: Sequence[Case],
        state: int,
        *,
        lent: Mapping[str, str] = {},
        in_form: Collection[str] = (),
        trusted: bool = False,
    ) -> list[Outcome]:
        """The outcomes of some cases of one question, all visible or all hidden.

        Right functions in `lent` stand in for the student's; those `in_form` answer as they do.
        A call that takes too long ends them; it has more time where the function is `trusted`.
        """
        name = question.function
        if self.box is None:
            self.run()
        if self.box is None or name not in self.states:
            status = Status.TOO_LONG if self.time.is_over else Status.NOT_DEFINED
            return [Outcome(status=status, message=self.faults.get(name, ""))] * len(cases)
        is_hidden = any(case.hidden for case in cases)
        self.is_sealed |= is_hidden
        seconds = self.time.patient_call if trusted else self.time.call
        outcomes = list[Outcome]()
        try:
            calls = [[data.to_json(argument) for argument in case.arguments] for case in cases]
            order = {"function": name, "state": state, "lent": lent, "in_form": [*in_form]}
            self.box.send(waiting_time(seconds), seconds=seconds, calls=calls, **order)
            while len(outcomes) < len(cases):
                outcomes.append(read_outcome(self.box.receive()))
                if outcomes[-1].status is Status.TOO_LONG:
                    break
                self.box.allow(waiting_time(seconds))
        except (BoxError, ValueError) as error:  # or it said something else
            self.close()
            is_timeout = isinstance(error, BoxTimeout)
            outcomes.append(Outcome(status=Status.TOO_LONG if is_timeout else Status.KILLED))
        last = outcomes[-1]
        untried = replace(last, tried=last.status is not Status.TOO_LONG)
        outcomes += [untried] * (len(cases) - len(outcomes))
        for outcome in () if is_hidden else outcomes:
            if outcome.status is Status.RETURNED and is_readable(question, outcome.value):
                self.readable.add(name)
            if outcome.is_writing:
                self.writing.add(name)
        if last.status in (Status.TOO_LONG, Status.KILLED):
            self.readable.discard(name)  # nobody waits for its form
        return outcomes

    def close(self) -> None:
        """End the box, and count its time."""
        if self.box:
            self.time.charge_box(self.box.processor_time())
            self.box.close()
        self.box = None
