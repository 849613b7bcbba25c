"""Fields of a line and what to do with a damaged one: count it, or stop at it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from labkit.arrays import FARTHEST
from labkit.errors import LogError
from labkit.logs.log import SkippedLine

MOST_TURNED = 1e6
"""No robot turns further [rad], even one whose heading is never wrapped."""

LATEST = 1e20
"""No clock shows more [s], not even one that counts nanoseconds."""

LONGEST_REASON = 180
"""Characters of a reason: with the file's name it stays a message that a terminal shows."""


class DamagedLine(Exception):
    """What one line holds instead of what its format asks for."""


class DamageReport:
    """Collects what is wrong or odd with one file; under `strict` the first damage raises.

    Parameters
    ----------
    file : str
        The file's name for the messages.
    strict : bool
        Whether a damaged line raises `LogError` instead of being collected.
    """

    def __init__(self, file: str, *, strict: bool) -> None:
        self.file = file
        self.strict = strict
        self._skipped: list[SkippedLine] = []
        self._remarks: list[str] = []

    @property
    def skipped(self) -> tuple[SkippedLine, ...]:
        """The lines left out so far, in the order of the file."""
        return tuple(sorted(self._skipped, key=lambda skipped: skipped.line))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is odd about the file, but no damage."""
        return tuple(self._remarks)

    def skip(self, line: int, reason: object) -> None:
        """Leave out a line for a reason, or raise `LogError` ``FILE:LINE: reason``."""
        skipped = SkippedLine(file=self.file, line=line, reason=shorten(str(reason)))
        if self.strict:
            raise LogError(str(skipped))
        self._skipped.append(skipped)

    def remark(self, text: str) -> None:
        """Take down what a reader of the log should know."""
        self._remarks.append(text)

    def summary(self) -> str:
        """The tail of a message about a file of which nothing was left."""
        if not self._skipped:
            return ""
        count, first = len(self._skipped), self._skipped[0]
        lines = "line was" if count == 1 else "lines were"
        return f"; {count} damaged {lines} skipped, the first is {first.line}: {first.reason}"


def shorten(text: str, longest: int = LONGEST_REASON) -> str:
    """The text on one line, its end cut where it is too long for a message.

    >>> shorten("a very long story", 12)
    'a very lo...'
    """
    line = " ".join(text.split())
    return line if len(line) <= longest else line[: longest - 3] + "..."


def numbers(fields: Sequence[str], what: str) -> list[float]:
    """The fields as floats, NaN and infinity included, or `DamagedLine` naming the bad one."""
    try:
        values = [float(field) for field in fields]
        spelled = is_spelled("".join(fields))
    except ValueError:
        spelled = False
    if spelled:
        return values
    index = next(k for k, field in enumerate(fields) if not _is_number(field))
    raise DamagedLine(f"{what} {index + 1} is {_quoted(fields[index])}, expected a number")


def is_spelled(field: str) -> bool:
    """Whether what Python takes for a number is one in a log: ASCII digits, none grouped."""
    return field.isascii() and "_" not in field


def finite(field: str, what: str) -> float:
    """One field as a finite float, or `DamagedLine` naming it."""
    value = float(field) if _is_number(field) else math.nan
    if not math.isfinite(value):
        raise DamagedLine(f"{what} is {_quoted(field)}, expected a finite number")
    return value


def time(field: str, what: str) -> float:
    """One field as a time [s], or `DamagedLine` naming it."""
    value = finite(field, what)
    if abs(value) > LATEST:
        raise DamagedLine(f"{what} is {_quoted(field)}, expected at most {LATEST:g} s")
    return value


def pose(fields: Sequence[str], what: str) -> tuple[float, float, float]:
    """Three fields as a finite pose (x, y, θ), or `DamagedLine`."""
    try:
        x, y, theta = map(float, fields)
        good = math.isfinite(x) and math.isfinite(y) and math.isfinite(theta)
    except ValueError:
        good = False
    if not (good and is_spelled("".join(fields))):  # name the field
        x, y, theta = (
            finite(field, f"{name} of {what}")
            for name, field in zip(("x", "y", "theta"), fields, strict=True)
        )
    expect_near(x, y, what)
    if abs(theta) > MOST_TURNED:
        raise DamagedLine(f"theta of {what} is {theta:g}, expected at most {MOST_TURNED:g} rad")
    return x, y, theta


def expect_near(x: float, y: float, what: str) -> None:
    """Raise `DamagedLine` for a place beyond `FARTHEST`."""
    if max(abs(x), abs(y)) > FARTHEST:
        raise DamagedLine(f"{what} is ({x:g}, {y:g}), expected to lie within {FARTHEST:g} m")


def count(fields: Sequence[str], index: int, what: str, at_least: int) -> int:
    """The count written at `index`, or `DamagedLine` if there is none or it is too small."""
    if index >= len(fields):
        raise DamagedLine(f"{len(fields)} fields, the line ends before the number of {what}")
    field = fields[index]
    if not (field.isdecimal() and field.isascii() and len(field) < 10 and int(field) >= at_least):
        raise DamagedLine(
            f"the number of {what} is {_quoted(field)}, expected an integer ≥ {at_least}"
        )
    return int(field)


def expect_fields(fields: Sequence[str], expected: int, what: str) -> None:
    """Raise `DamagedLine` unless the line has the `expected` number of fields."""
    if len(fields) != expected:
        raise DamagedLine(f"{len(fields)} fields, expected {expected} for {what}")


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return is_spelled(field)


def _quoted(field: str) -> str:
    return repr(field if len(field) <= 30 else field[:27] + "...")
