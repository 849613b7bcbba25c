"""The contract across the wall between grader and student's code: calls in, outcomes out."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

from numpy.typing import NDArray

Value: TypeAlias = (
    NDArray[Any] | float | int | bool | str | tuple["Value", ...] | dict[str, "Value"] | None
)
"""Plain data. Arrays are float64, int64 or bool; a student's list arrives as a tuple."""


class OutcomeStatus(Enum):
    """The endings of a call."""

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
    """The outcome of one call.

    The `message` is the student's own error, "IndexError: ... (line 3 of cell 7)", or what the box
    saw: at most 600 printable characters. A student can write any text here, the arguments of this
    call among it: of a hidden case it is never shown.
    """

    status: OutcomeStatus
    value: Value = None  # only with RETURNED: rebuilt outside, bounds checked; NaN is data
    message: str = ""
    error: str = ""  # with RAISED: the name of the exception, or ""
