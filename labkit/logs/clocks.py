"""Clocks of scans and wheels: fields as seconds, units that are not named, and whole seconds."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import numpy as np

from labkit.logs.lines import DamagedLine, DamageReport, is_number
from labkit.support.arrays import FloatArray

UNITS = {1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}
MIN_STEP = 0.01  # [s]: a clock that would step by less in its unit counts in a larger one
MIN_DATE = 1e8  # [s]: dates count from 1970
DATES_IN_SECONDS = (9e8, 5e9)  # 1998 to 2128


def parse_stamp(field: str, scale: float) -> float:
    """Seconds of a number in a unit, or of a date or a time of day in ISO 8601."""
    if is_number(field) and math.isfinite(float(field)):
        return float(field) / round(1.0 / scale)  # no rounding of a nanosecond to 1e-9
    try:
        if field[2:3] == ":":  # a time of day
            field = f"1970-01-01T{field}"
        date = datetime.fromisoformat(field)
    except ValueError:
        raise DamagedLine(
            f"the stamp is {field!r:.30}, expected a finite number, a date or a time of day"
        ) from None
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def settle_clock(
    stamps: FloatArray, owner: str, report: DamageReport, *, is_named: bool
) -> FloatArray:
    """Stamps in seconds of a clock that may not name its unit; a remark on what is not sure."""
    unit, is_sure = (1.0, True) if is_named else unit_of(stamps)
    if not is_sure:
        step = np.median(np.abs(np.diff(stamps))) if len(stamps) > 1 else stamps[0]
        report.remarks.append(
            f"the clock of {owner} steps by {step:.4g}, which are no seconds: it is read as "
            f"{UNITS[unit]}, as the title `stamp_{UNITS[unit]}` of its column would say; the title "
            f"`stamp_s` says seconds"
        )
    seconds = stamps / round(1.0 / unit)
    spread = spread_whole_seconds(seconds)
    if spread is None:
        return seconds
    report.remarks.append(
        f"the clock of {owner} counts whole seconds, and several rows share each: they are spread "
        f"evenly over the second that begins there; a clock with decimals tells more"
    )
    return spread


def spread_whole_seconds(stamps: FloatArray) -> FloatArray | None:
    """Even times within the whole seconds that stamps usually share; None where they do not.

    The first second may have begun before the recording, and the last one may go on behind it.
    """
    starts = np.flatnonzero(np.diff(stamps, prepend=np.nan))
    counts = np.diff(starts, append=len(stamps))
    if len(counts) < 2 or np.median(counts) < 2 or (stamps % 1.0).any():
        return None
    share = np.concatenate([np.arange(count) / count for count in counts])
    most = counts.max()
    share[: counts[0]] = 1.0 - np.arange(counts[0], 0, -1) / most
    share[-counts[-1] :] = np.arange(counts[-1]) / most
    return np.asarray(stamps + share)


def unit_of(stamps: FloatArray) -> tuple[float, bool]:
    """The unit [s] in which a clock counts that does not name it, and whether it is sure.

    Its steps tell the unit, or, surely, its size: that of a date from 1998 on.
    """
    size = float(np.median(np.abs(stamps)))
    steps = np.abs(np.diff(stamps))
    step = float(np.median(steps)) if steps.size else 0.0
    for unit in sorted(UNITS):
        is_date = unit == 1e-3 and DATES_IN_SECONDS[0] < size < DATES_IN_SECONDS[1]
        if size >= MIN_DATE / unit or (step >= MIN_STEP / unit and not is_date):
            return unit, size * unit >= DATES_IN_SECONDS[0]
    return 1.0, True
