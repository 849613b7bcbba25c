"""The caller's word on the scanner, before the file's: its beams, band and mounting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from labkit.logs.lines import DamageReport
from labkit.logs.stored import StoredScan
from labkit.scan import Scan
from labkit.support.arrays import FloatArray, check_kind, check_range, read_only

NO_MAXIMUM = (
    "declare a maximum range that is not above their minimum: it counts as unknown; "
    "`range_max` (`--range-max`) sets one"
)
OTHER_SPAN = (
    "declare a first and a last angle that their number of beams and their step do not lead to: "
    "the first and the step count; `angles` (`--angles`) sets first and last"
)
NO_STEP = "declare no step between their beams: the first and the last angle count"


@dataclass(frozen=True, eq=False, kw_only=True)
class Scanner:
    """The caller's word on a scanner, in place of the file's.

    Attributes
    ----------
    angles : tuple of two floats, or None
        Directions of the first and the last beam [rad].
    range_min, range_max : float or None
        The band in which a range makes a point [m].
    time_increment : float or None
        Time from one beam to the next [s]; 0 where all beams count as measured at once.
    mirrored : bool or None
        The scanner hangs upside down, or counts its angles clockwise: they change their sign.
    """

    angles: tuple[float, float] | None = None
    range_min: float | None = None
    range_max: float | None = None
    time_increment: float | None = None
    mirrored: bool | None = None

    def __post_init__(self) -> None:
        check_kind(self.mirrored, "mirrored", bool, type(None))
        low = 0.0 if self.range_min is None else self.range_min
        check_range(low, "range_min", at_least=0.0, unit="m")
        if self.range_max is not None:
            check_range(self.range_max, "range_max", above=low, unit="m")
        if self.time_increment is not None:
            check_range(self.time_increment, "time_increment", at_least=0.0, at_most=1.0, unit="s")

    def beams(
        self, count: int, first: float, step: float, report: DamageReport, last: float = math.nan
    ) -> FloatArray:
        """Directions of the beams by the caller, or else as declared by a file."""
        if self.angles is not None:
            first, last = self.angles
            step = (last - first) / max(count - 1, 1)
        elif count > 1 and math.isfinite(last):
            if step == 0.0 and last != first:
                report.count(NO_STEP)
                step = (last - first) / (count - 1)
            elif abs(first + step * (count - 1) - last) > 1.5 * abs(step):
                report.count(OTHER_SPAN)
        return _spread(first, step, count, mirrored=bool(self.mirrored))

    def scan(
        self,
        ranges: Sequence[float] | FloatArray,
        angles: FloatArray,
        report: DamageReport,
        *,
        stamp: float = math.nan,
        band: tuple[float, float] = (0.0, math.inf),
        time_increment: float = 0.0,
    ) -> StoredScan:
        """A scan of ranges on the beams of `beams`; `band` is what the file declares."""
        low, high = band
        if self.range_min is not None:
            low = self.range_min
        if self.range_max is not None:
            high = self.range_max
        elif not high > low:
            report.count(NO_MAXIMUM)
            high = math.inf
        if self.time_increment is not None:
            time_increment = self.time_increment
        elif not 0.0 <= time_increment <= 1.0:  # some drivers leave it unset
            time_increment = 0.0
        scan = Scan.from_ranges(
            ranges,
            angles,
            stamp=stamp,
            time_increment=time_increment,
            range_min=low,
            range_max=high,
        )
        return StoredScan(
            ranges=np.asarray(scan.ranges),
            angles=np.asarray(scan.angles),
            stamp=scan.stamp,
            time_increment=scan.time_increment,
            band=(low, high),
        )

    def scan_of_points(self, points: FloatArray, stamp: float) -> Scan:
        """A scan of bare points (N, 2) within the caller's band."""
        distance = np.hypot(*points.T)
        low = -math.inf if self.range_min is None else self.range_min
        high = math.inf if self.range_max is None else self.range_max
        kept = points[(distance > low) & (distance < high)]
        side = np.array([1.0, -1.0 if self.mirrored else 1.0])
        return replace(Scan.from_points(kept * side), stamp=stamp)


@lru_cache(maxsize=64)
def _spread(first: float, step: float, count: int, *, mirrored: bool) -> FloatArray:
    """Directions [rad], read-only: all scans of one scanner share them."""
    angles = first + step * np.arange(count, dtype=np.float64)
    return read_only(-angles if mirrored else angles)
