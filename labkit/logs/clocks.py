"""Clocks of scans: fields as seconds, and the unit of a clock that does not name it."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import numpy as np

from labkit.logs.lines import DamagedLine, is_number
from labkit.support.arrays import FloatArray

UNITS = {1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}
# A scan takes 5 ms to 5 s, and dates count from 1970. So a clock in milliseconds steps by 10 or
# more, one in microseconds by 1e4, one in nanoseconds by 1e7, or its dates are as large as this.
MIN_STEP = {1e-9: 1e7, 1e-6: 1e4, 1e-3: 10.0}
MIN_DATE = {1e-9: 1e17, 1e-6: 1e14, 1e-3: 1e11}
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


def unit_of(stamps: FloatArray) -> tuple[float, bool]:
    """The unit [s] in which a clock counts that does not name it, and whether it is sure.

    Its steps tell the unit, or, surely, its size: that of a date from 1998 on.
    """
    size = float(np.median(np.abs(stamps)))
    steps = np.abs(np.diff(stamps))
    step = float(np.median(steps)) if steps.size else 0.0
    for unit, least in MIN_STEP.items():
        is_date = unit == 1e-3 and DATES_IN_SECONDS[0] < size < DATES_IN_SECONDS[1]
        if size >= MIN_DATE[unit] or (step >= least and not is_date):
            return unit, size * unit >= DATES_IN_SECONDS[0]
    return 1.0, True
