"""The contract across the wall between grader and student's code: calls in, outcomes out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

from numpy.typing import NDArray

Value: TypeAlias = (
    NDArray[Any] | float | int | bool | str | tuple["Value", ...] | dict[str, "Value"] | None
)
"""Plain data. Arrays are float64, int64 or bool; a student's list arrives as a tuple."""

KILLED, NOT_DEFINED, CELL_FAILED = "Killed", "NotDefined", "CellFailed"


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """The outcome of one call: a value or, with an `error`, none.

    The error is the name of an exception, of the box's own among them (`OutOfTime`,
    `NotDataError`, `TooMuchError`), or one of the three above. The `message` is the student's,
    "IndexError: ... (line 3 of cell 7)", or what the box saw: at most 600 printable characters.
    A student can write any text there, the arguments of this call among it: of a hidden case it
    is never shown.
    """

    value: Value = None  # rebuilt outside, bounds checked; NaN is data
    error: str = ""
    message: str = ""
