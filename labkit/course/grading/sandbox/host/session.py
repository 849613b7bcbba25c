"""One submission in one slot: its files, its cells, its calls; anew past whatever hangs or dies.

The grader speaks first and says what it wants; the box answers one frame for the files, one a
cell and one a call, in that order. What else it sends (a wrong id, a frame out of turn, bytes
that are no frame) ends the box and costs the question at hand, as a crash does.

A submission can forge any frame, since its code shares the process that writes them. What
it gains is what a returned value gains: the value is compared with a reference that was
never in the box. It cannot answer ahead for another question, whose frames must carry a
word that is drawn when the question is asked; and what one question leaves behind to spoil
another is found out, since a question that dies in a used box is asked again in a new one.
What a frame says is checked word by word.
"""

from __future__ import annotations

import builtins
import math
import secrets
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from labkit.course.grading.contract import (
    Call,
    Extraction,
    Fault,
    Limits,
    Outcome,
    OutcomeStatus,
    SourceCell,
)
from labkit.course.grading.sandbox.host.box import Box, GoneError, LateError, Starter, receive
from labkit.course.grading.sandbox.inside import data

WHOLE, REDUCED, LEFT_OUT = range(3)  # what is run of a cell: less, once it hung or crashed
PER_ANSWER = 1 << 16  # bytes for message, output and the like, beside the value
CELL_ANSWER = 1 << 14
MAX_SOURCE = 1 << 24  # characters
MOST = 1 << 25  # bytes of code and remarks
PATIENCE = 60.0  # s; what is read takes one at most, where the machine has nothing else to do
MAX_MESSAGE = 500
ERRORS = frozenset(
    name
    for name, kind in vars(builtins).items()
    if isinstance(kind, type) and issubclass(kind, BaseException)
)
# Of what a box can know; that it hung or died is found out from outside.
SAYABLE = frozenset({"RETURNED", "RAISED", "TOO_LARGE", "NOT_DATA", "NOT_DEFINED"})


@dataclass(frozen=True, kw_only=True)
class Complaint:
    """Why a cell, or what depends on it, brought nothing."""

    status: OutcomeStatus
    message: str
    error: str = ""

    def of(self, call: Call) -> Outcome:
        """The outcome of a call that this complaint stands for."""
        return Outcome(id=call.id, status=self.status, message=self.message, error=self.error)


TOO_MUCH_CODE = Complaint(
    status=OutcomeStatus.SOURCE_FAILED,
    message=f"the submission holds more than {MAX_SOURCE >> 20} million characters of code",
)


class EndedError(Exception):
    """The box hung, died or talked out of turn; carries what to say of the question at hand."""

    def __init__(self, status: OutcomeStatus, message: str) -> None:
        super().__init__(message)
        self.complaint = Complaint(status=status, message=message)


class Session:
    """Runs the cells and calls of one submission to their end.

    Parameters
    ----------
    starter : Starter
        Where fresh boxes come from.
    limits : Limits
    cells : sequence of SourceCell
    fresh : Box or None
        One that has run no code yet, to begin with.
    """

    def __init__(
        self,
        starter: Starter,
        limits: Limits,
        cells: Sequence[SourceCell],
        fresh: Box | None = None,
    ) -> None:
        self.starter = starter
        self.limits = limits
        self.cells = cells
        self.forms = [WHOLE] * len(cells)
        self.failed: dict[int, Complaint] = {}  # cells that raised in the box at hand
        self.lost: dict[str | None, Complaint] = {}  # questions whose cell hung or died
        self.faults: list[Fault] = []  # shared cells that failed before anything was asked
        self.boxes = 0
        self.scipy = any("scipy" in cell.source for cell in cells)
        self.box: Box | None = None
        self.fresh = fresh
        self.end = time.monotonic() + limits.total_seconds

    def run(self, calls: Sequence[Call]) -> list[Outcome]:
        """One outcome for each call, in their order."""
        outcomes: dict[str, Outcome] = {}
        try:
            if sum(len(cell.source) for cell in self.cells) > MAX_SOURCE:
                return [TOO_MUCH_CODE.of(call) for call in calls]
            for question, batch in groupby(calls, key=lambda call: call.question):
                self._answer(question, list(batch), outcomes)
        finally:
            self._stop(leaving=False)
            self.box, self.fresh = self.fresh, None
            self._stop(leaving=False)
        return [outcomes[call.id] for call in calls]

    def _answer(self, question: str, batch: list[Call], outcomes: dict[str, Outcome]) -> None:
        """Ask the calls of one question; whatever goes wrong stays here."""
        used = self.box is not None
        try:
            self._open()
            if question not in self.lost:
                self._ask(batch, outcomes)
        except EndedError as error:
            if used and error.complaint.status is OutcomeStatus.KILLED:
                self._answer(question, batch, outcomes)  # perhaps an earlier question's doing
                return
            self.lost[question] = error.complaint
        for call in batch:
            if call.id not in outcomes:
                outcomes[call.id] = self.lost[question].of(call)

    def _open(self) -> None:
        """See to it that there is a box in which all cells have run that can."""
        while self.box is None:
            if time.monotonic() > self.end:
                raise EndedError(OutcomeStatus.TIMEOUT, self._too_long(self.end))
            self.box, self.fresh = self.fresh or self.starter.start(scipy=self.scipy), None
            self.failed = {}
            self.boxes += 1
            running = [place for place, form in enumerate(self.forms) if form != LEFT_OUT]
            place = running[0] if running else -1
            try:
                self._send({"cells": tuple(map(self._told, running))})
                for position, place in enumerate(running):
                    self._run_cell(position, place)
            except EndedError as error:
                self.forms[place] += 1
                self._blame(self.cells[place], error.complaint)

    def _told(self, place: int) -> dict[str, Any]:
        cell = self.cells[place]
        return {
            "source": cell.source,
            "label": cell.label,
            "modules": cell.modules,
            "reduced": self.forms[place] == REDUCED,
        }

    def _run_cell(self, position: int, place: int) -> None:
        frame, _ = self._receive(CELL_ANSWER, self._deadline())
        try:
            complaint = read_cell(frame, position)
        except data.WireError:
            raise self._out_of_turn() from None
        if complaint:
            self.failed[place] = complaint
            if self.boxes == 1 and self.cells[place].question is None:
                label = self.cells[place].label
                self.faults.append(Fault(label, complaint.message, complaint.error))

    def _blame(self, cell: SourceCell, complaint: Complaint) -> None:
        told = Complaint(status=complaint.status, message=f"{cell.label}: {complaint.message}")
        self.lost.setdefault(cell.question, told)

    def _ask(self, batch: list[Call], outcomes: dict[str, Outcome]) -> None:
        """Send the calls and read as many answers."""
        turn = secrets.token_hex(8)
        start = time.monotonic()
        deadline = self._deadline()
        self._send({"turn": turn, "calls": len(batch)}, *(call.frame for call in batch))
        left = self.limits.result_bytes + PER_ANSWER * len(batch)
        for call in batch:
            frame, length = self._receive(left, deadline)
            left -= length
            elapsed = time.monotonic() - start
            try:
                answer = read_outcome(
                    frame, call, turn, output_chars=self.limits.output_chars, elapsed=elapsed
                )
            except data.WireError:
                raise self._out_of_turn() from None
            if answer.status is OutcomeStatus.NOT_DEFINED:
                answer = self._undefined(call)
            outcomes[call.id] = answer

    def _undefined(self, call: Call) -> Outcome:
        """Why a name is missing: its cell failed, or it was never written."""
        own = [place for place, cell in enumerate(self.cells) if cell.question == call.question]
        suspects = own or [place for place, cell in enumerate(self.cells) if not cell.question]
        for place in suspects:
            if place in self.failed:
                return self.failed[place].of(call)
        if not own and None in self.lost:
            return self.lost[None].of(call)
        missing = f"`{call.function}` is not defined"
        return Outcome(id=call.id, status=OutcomeStatus.NOT_DEFINED, message=missing)

    def _send(self, message: dict[str, Any], *frames: bytes) -> None:
        assert self.box is not None
        deadline = self._deadline()
        try:
            sent = b"".join((data.pack(message, data.MAX_REQUEST), *frames))
            self.box.channel.write(sent, deadline)
        except LateError:
            raise self._late(deadline) from None
        except GoneError:
            raise self._gone() from None

    def _receive(self, most: int, deadline: float) -> tuple[Any, int]:
        assert self.box is not None
        try:
            return receive(self.box.channel, most, deadline)
        except LateError:
            raise self._late(deadline) from None
        except GoneError:
            raise self._gone() from None
        except data.TooLargeError:
            self._stop(leaving=False)
            raise EndedError(OutcomeStatus.TOO_LARGE, "it sent more than an answer needs") from None
        except data.WireError:
            raise self._out_of_turn() from None

    def _deadline(self) -> float:
        return min(time.monotonic() + self.limits.seconds, self.end)

    def _late(self, deadline: float) -> EndedError:
        self._stop(leaving=False)
        return EndedError(OutcomeStatus.TIMEOUT, self._too_long(deadline))

    def _too_long(self, deadline: float) -> str:
        if deadline >= self.end:
            return f"the submission as a whole took longer than {self.limits.total_seconds:g} s"
        return f"it took longer than {self.limits.seconds:g} s"

    def _gone(self) -> EndedError:
        return EndedError(OutcomeStatus.KILLED, self._stop(leaving=True))

    def _out_of_turn(self) -> EndedError:
        self._stop(leaving=False)
        return EndedError(OutcomeStatus.KILLED, "it sent data out of turn")

    def _stop(self, leaving: bool) -> str:
        """End the box, if there is one; how it ended."""
        box, self.box = self.box, None
        return str(box.stop(leaving)) if box else ""


def extract_in(
    box: Box, files: Mapping[str, bytes], functions: Mapping[str, str]
) -> tuple[Extraction, bool]:
    """What is graded of a submission, and whether the box can go on with it."""
    deadline = time.monotonic() + PATIENCE
    sent = {name: data.from_bytes(held) for name, held in files.items()}
    request = {"files": sent, "functions": dict(functions)}
    leaving = False
    try:
        box.channel.write(data.pack(request, data.MAX_REQUEST), deadline)
        frame, _ = receive(box.channel, MOST, deadline)
        return read_extraction(frame, functions), True
    except LateError:
        why = f"it took longer than {PATIENCE:g} s"
    except GoneError:
        leaving, why = True, ""
    except data.WireError:
        why = "what was found is more than one submission holds"
    end = box.stop(leaving)
    remark = f"the files could not be read: {why or end}; hand in the notebook alone"
    return Extraction(unread=(remark,)), False


def read_extraction(frame: Any, functions: Mapping[str, str]) -> Extraction:
    """The extraction that a frame describes; `WireError` if it describes none."""
    lists = ("sources", "questions", "labels", "modules", "notes", "unread")
    if not isinstance(frame, dict) or not all(type(frame.get(name)) is tuple for name in lists):
        raise data.WireError("no extraction")
    sources, questions, labels, modules, notes, unread = (frame[name] for name in lists)
    if not len(sources) == len(questions) == len(labels) == len(modules):
        raise data.WireError("cells without a source, a question, a label or names")
    marks = frame.get("passages")
    if not isinstance(marks, np.ndarray) or marks.dtype != np.int64 or marks.ndim != 1:
        raise data.WireError("no passages")
    return Extraction(
        cells=tuple(
            _cell(*parts, functions)
            for parts in zip(sources, questions, labels, modules, strict=True)
        ),
        notes=tuple(map(readable, notes)),
        unread=tuple(map(readable, unread)),
        passages=tuple(marks.tolist()),
    )


def _cell(
    source: Any, question: Any, label: Any, modules: Any, functions: Mapping[str, str]
) -> SourceCell:
    known = question is None or (isinstance(question, str) and question in functions)
    if not isinstance(source, np.ndarray) or not known:
        raise data.WireError("a cell of no question that was asked")
    if not isinstance(modules, tuple) or not all(isinstance(name, str) for name in modules):
        raise data.WireError("a module without a name")
    text = data.to_bytes(source).decode("utf-8", "replace")
    return SourceCell(source=text, question=question, label=readable(label), modules=modules)


def read_cell(frame: Any, position: int) -> Complaint | None:
    """What went wrong in a cell, or None; `WireError` if the frame speaks of another cell."""
    if not _says(frame, cell=position):
        raise data.WireError("not the cell that was asked for")
    message = readable(frame.get("message"))
    if not message:
        return None
    return Complaint(
        status=OutcomeStatus.SOURCE_FAILED, message=message, error=known_error(frame.get("error"))
    )


def read_outcome(
    frame: Any, call: Call, turn: str, *, output_chars: int, elapsed: float
) -> Outcome:
    """The outcome that a frame describes; `WireError` if it answers no call of this turn."""
    if not _says(frame, id=call.id, turn=turn):
        raise data.WireError("not the call that was asked")
    status = frame.get("status")
    if not isinstance(status, str) or status not in SAYABLE:
        raise data.WireError("no way for a call to end")
    seconds = frame.get("seconds")
    if not isinstance(seconds, float) or not math.isfinite(seconds):
        seconds = elapsed
    return Outcome(
        id=call.id,
        status=OutcomeStatus[status],
        value=frame.get("value") if status == "RETURNED" else None,
        message=readable(frame.get("message")),
        output=readable(frame.get("output"), output_chars, keep="\n\t"),
        seconds=min(max(seconds, 0.0), elapsed),
        error=known_error(frame.get("error")),
    )


def _says(frame: Any, **words: str | int) -> bool:
    """Whether a frame says these words: in their types, since an array compares as an array."""
    return isinstance(frame, dict) and all(
        type(frame.get(name)) is type(word) and frame[name] == word for name, word in words.items()
    )


def known_error(name: Any) -> str:
    """A name that is a built-in exception's, or nothing: other names may carry data out."""
    return name if isinstance(name, str) and name in ERRORS else ""


def readable(text: Any, most: int = MAX_MESSAGE, keep: str = "") -> str:
    r"""Text without control characters (terminal codes, tricks with direction), cut.

    Examples
    --------
    >>> readable("red \x1b[31m\n text")
    'red [31m  text'
    """
    if not isinstance(text, str) or not text:
        return ""
    if len(text) <= most and text.isprintable():
        return text
    shown = "".join(
        letter if letter.isprintable() or letter in keep else " " * letter.isspace()
        for letter in text[: 2 * most]
    )
    return shown if len(shown) <= most else shown[: most - 1] + "…"
