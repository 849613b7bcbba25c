"""What a box says, checked word by word: an extraction, how a cell went, how a call went."""

from __future__ import annotations

import builtins
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from labkit.grading.contract import (
    Call,
    Extraction,
    Outcome,
    OutcomeStatus,
    SourceCell,
)
from labkit.grading.sandbox.inside import data

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


def read_extraction(frame: Any, functions: Mapping[str, str]) -> Extraction:
    """The extraction that a frame describes.

    Raises
    ------
    labkit.grading.sandbox.inside.data.WireError
        If it describes none.
    """
    lists = ("sources", "questions", "labels", "notes", "unread")
    if not isinstance(frame, dict) or not all(type(frame.get(name)) is tuple for name in lists):
        raise data.WireError("no extraction")
    sources, questions, labels, notes, unread = (frame[name] for name in lists)
    if not len(sources) == len(questions) == len(labels):
        raise data.WireError("cells without a source, a question or a label")
    marks = frame.get("passages")
    if not isinstance(marks, np.ndarray) or marks.dtype != np.int64 or marks.ndim != 1:
        raise data.WireError("no passages")
    return Extraction(
        cells=tuple(map(_cell, sources, questions, labels, [functions] * len(sources))),
        notes=tuple(map(readable, notes)),
        unread=tuple(map(readable, unread)),
        passages=tuple(marks.tolist()),
    )


def _cell(source: Any, question: Any, label: Any, functions: Mapping[str, str]) -> SourceCell:
    known = question is None or (isinstance(question, str) and question in functions)
    if not isinstance(source, np.ndarray) or not known:
        raise data.WireError("a cell of no question that was asked")
    text = data.to_bytes(source).decode("utf-8", "replace")
    return SourceCell(source=text, question=question, label=readable(label))


def read_cell(frame: Any, position: int) -> Complaint | None:
    """What went wrong in a cell, or None.

    Raises
    ------
    labkit.grading.sandbox.inside.data.WireError
        If the frame does not speak of the cell at this position.
    """
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
    """The outcome that a frame describes.

    Raises
    ------
    labkit.grading.sandbox.inside.data.WireError
        If the frame does not answer this call, asked in this turn.
    """
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
