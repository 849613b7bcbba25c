"""What crosses the wall between the grader and a student's code: source and calls in, data out.

The grader builds `Call` objects from the assignment, hands them with the submission's
`SourceCell` objects to a sandbox (`sandbox.host.modes`), and judges the `Outcome`
objects that come back.
References, points and the reason of a case never enter a sandbox; objects, code and
tracebacks never leave it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

from numpy.typing import NDArray

from labkit.arrays import check_count, check_range
from labkit.course.grading.extraction.extract import Extraction, SourceCell
from labkit.course.grading.sandbox.inside import data

__all__ = [
    "Call", "Extraction", "Fault", "Limits", "Outcome", "OutcomeStatus", "SourceCell", "Value",
]  # fmt: skip

Value: TypeAlias = (
    NDArray[Any] | float | int | bool | str | tuple["Value", ...] | dict[str, "Value"] | None
)
"""Plain data. Arrays are float64, int64 or bool; a student's list arrives as a tuple."""

MEBIBYTE = 1 << 20
OUT_OF_SIGHT = "it raised an error"
# The errors of honest mistakes. Few, since which one is raised can be made to tell an input.
TELLING_NOTHING = {
    "IndexError", "KeyError", "NameError", "TypeError", "ValueError", "ZeroDivisionError",
}  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class Call:
    """One call of a student's function; nothing in it tells the answer or the case's purpose.

    Attributes
    ----------
    id : str
        Names the call among those of one `Sandbox.run`.
    question : str
        Whom limits and blame belong to.
    function : str
        The name to look up among what the cells defined.
    arguments : tuple of Value
    keywords : mapping of str to Value
        Each call gets fresh, writable copies: to change them in place hurts no other call.
    """

    id: str
    question: str
    function: str
    arguments: tuple[Value, ...] = ()
    keywords: Mapping[str, Value] = field(default_factory=dict)

    @cached_property
    def frame(self) -> bytes:
        """What is sent of it, packed once: a whole class is asked the same calls."""
        told = {
            "id": self.id,
            "function": self.function,
            "arguments": self.arguments,
            "keywords": dict(self.keywords),
        }
        return data.pack(told, data.MAX_REQUEST)


class Fault(NamedTuple):
    """A shared cell (an import, a helper) that failed before anything was asked.

    Attributes
    ----------
    label : str
        The cell.
    message, error : str
        As of an `Outcome`. The message may be shown: no case had entered the box.
    """

    label: str
    message: str
    error: str


class OutcomeStatus(Enum):
    """How a call ended; the value says it to a reader."""

    RETURNED = "returned a value"
    RAISED = "raised an error"
    TIMEOUT = "took too long"
    KILLED = "ended the program"  # memory, a signal, an exit, data out of turn
    TOO_LARGE = "returned too much"
    NOT_DATA = "returned something that is no data"
    NOT_DEFINED = "is not defined"
    SOURCE_FAILED = "its cell did not run"


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """What one call brought.

    Attributes
    ----------
    id : str
        The call's id.
    status : OutcomeStatus
    value : Value
        Only with RETURNED: rebuilt outside from bytes, bounds checked. NaN is data.
    message : str
        The student's own error, "IndexError: ... (line 3 of cell 7)", or what the sandbox
        saw; at most 500 printable characters. A student can write any text here.
    output : str
        What the call printed, cut. A student can write any text here.
    seconds : float
        Wall time of the call as the box measured it.
    error : str
        With RAISED and SOURCE_FAILED: the name of the built-in exception, or "".

    Notes
    -----
    `value`, `message` and `output` may hold the arguments of this call, or of an earlier one
    in the same `Sandbox.run`. Whoever keeps a case hidden shows none of them, but
    `unrevealing_message`, and asks hidden calls last.
    """

    id: str
    status: OutcomeStatus
    value: Value = None
    message: str = ""
    output: str = ""
    seconds: float = 0.0
    error: str = ""

    @property
    def unrevealing_message(self) -> str:
        """What may be shown of a hidden case: built of fixed words, whatever the code says."""
        if self.status is OutcomeStatus.RAISED:
            return f"it raised {self.error}" if self.error in TELLING_NOTHING else OUT_OF_SIGHT
        return str(self.status.value)


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a submission may use; checked when it is made.

    Attributes
    ----------
    seconds : float
        Wall time of one question's calls in a row, and of any one cell [s].
    total_seconds : float
        Wall time of a whole submission, restarts included [s].
    memory : int
        Bytes beyond what Python and numpy themselves need.
    threads : int
        Threads at a time; processes cannot be started at all.
    file_bytes, disk_bytes : int
        The largest file, and all files together, in the private folder.
    result_bytes : int
        What the calls of one question may return, all in all.
    output_chars : int
        How much of what a call prints is kept.
    """

    seconds: float = 10.0
    total_seconds: float = 120.0
    memory: int = 1024 * MEBIBYTE
    threads: int = 32
    file_bytes: int = 16 * MEBIBYTE
    disk_bytes: int = 64 * MEBIBYTE
    result_bytes: int = MEBIBYTE
    output_chars: int = 2000

    def __post_init__(self) -> None:
        check_range(self.seconds, "seconds", above=0.0, at_most=3600.0, unit="s")
        check_range(self.total_seconds, "total_seconds", above=0.0, at_most=86400.0, unit="s")
        check_count(self.memory, "memory", at_least=64 * MEBIBYTE)
        check_count(self.threads, "threads", at_least=1)
        check_count(self.file_bytes, "file_bytes", at_least=0)
        check_count(self.disk_bytes, "disk_bytes", at_least=MEBIBYTE)
        check_count(self.result_bytes, "result_bytes", at_least=1024)
        check_count(self.output_chars, "output_chars", at_least=0)
