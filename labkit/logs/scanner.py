"""The caller's word on the scanner, before the file's: its beams, band and mounting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from labkit.logs.columns import METRES, RADIANS
from labkit.logs.lines import DamagedLine, DamageReport
from labkit.logs.stored import StoredScan
from labkit.scan import MOST_TURN, Scan, is_return
from labkit.support.arrays import (
    FloatArray,
    IntArray,
    check_choice,
    check_kind,
    check_range,
    read_only,
)

NO_MAXIMUM = (
    "declare a maximum range that is not above their minimum: it counts as unknown; "
    "`range_max` (`--range-max`) sets one"
)
WAY_OUT = "`angles` (`--angles`) sets first and last"
NO_STEP = f"declare no step between their beams: the first and the last angle count; {WAY_OUT}"
OTHER_SIGN = (
    "declare a step whose sign leads away from their last angle: the first, the last and the "
    f"number of beams count; {WAY_OUT}"
)
OTHER_STEP = (
    "declare a step that does not lead to their last angle, and first and last close a turn: "
    f"the two count; {WAY_OUT}"
)
OTHER_LAST = (
    "declare a first and a last angle that their number of beams and their step do not lead to: "
    f"the first and the step count; {WAY_OUT}"
)
FEW_BEAMS = "have fewer beams than `blind_beams` (`--blind-beams`) names"
MAX_OFF = 1.5  # steps: a last angle may lie one beam off


@dataclass(frozen=True, eq=False, kw_only=True)
class Scanner:
    """The caller's word on a scanner, in place of the file's.

    Attributes
    ----------
    angles : tuple of two floats, or None
        Directions of the first and the last beam [rad].
    range_min, range_max : float or None
        The band in which a range makes a point [m].
    range_unit, angle_unit : str or None
        The units of the file's ranges and angles.
    blind_beams : ndarray of int, or None
        Numbers of beams that make no point, counted from 0.
    time_increment : float or None
        Time from one beam to the next [s]; 0 where all beams count as measured at once.
    mirrored : bool or None
        The scanner hangs upside down, or counts its angles clockwise: they change their sign.
    """

    angles: tuple[float, float] | None = None
    range_min: float | None = None
    range_max: float | None = None
    range_unit: str | None = None
    angle_unit: str | None = None
    blind_beams: IntArray | None = None
    time_increment: float | None = None
    mirrored: bool | None = None

    def __post_init__(self) -> None:
        check_kind(self.mirrored, "mirrored", bool, type(None))
        check_choice(self.range_unit, "range_unit", *METRES, None)
        check_choice(self.angle_unit, "angle_unit", *RADIANS, None)
        low = 0.0 if self.range_min is None else self.range_min
        check_range(low, "range_min", at_least=0.0, unit="m")
        if self.range_max is not None:
            check_range(self.range_max, "range_max", above=low, unit="m")
        if self.time_increment is not None:
            check_range(self.time_increment, "time_increment", at_least=0.0, at_most=1.0, unit="s")

    def metres(self, named: float = 1.0) -> float:
        """Factor of ranges to metres: of the caller's unit, or of the one that the file names."""
        return named if self.range_unit is None else METRES[self.range_unit]

    def radians(self, named: float = 1.0) -> float:
        """Factor of angles to radians, likewise."""
        return named if self.angle_unit is None else RADIANS[self.angle_unit]

    def beams(
        self, count: int, first: float, step: float, report: DamageReport, last: float = math.nan
    ) -> FloatArray:
        """Directions of the beams by the caller, or else as declared by a file [rad]."""
        if self.angles is not None:
            first, last = self.angles
            step = (last - first) / max(count - 1, 1)
        elif count > 1 and math.isfinite(last):
            step = _settle_step(count, first, step, last, report)
        low, high = sorted((first, first + step * (count - 1)))
        if not max(high - low, -low, high) <= MOST_TURN:
            raise DamagedLine(
                f"`angles` must be radians within one turn, got {low:.6g} to {high:.6g}: are these "
                f"degrees? `angle_unit` (`--angle-unit deg`) says so"
            )
        return _spread(first, step, count, mirrored=bool(self.mirrored))

    def scan(
        self,
        ranges: Sequence[float] | FloatArray,
        angles: FloatArray,
        report: DamageReport,
        *,
        scale: float = 1.0,
        stamp: float = math.nan,
        band: tuple[float, float] = (0.0, math.inf),
        time_increment: float = 0.0,
    ) -> StoredScan:
        """A scan of ranges on the beams of `beams`.

        `scale` is the factor of the ranges to metres that the file names, and `band` what it
        declares [m].
        """
        factor = self.metres(scale)
        metres = np.asarray(ranges, dtype=np.float64)
        if factor != 1.0:
            metres = metres * factor
        if self.range_unit is not None:
            band = _band_in_unit(metres, band, factor)
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
        if self.blind_beams is not None:
            seen = self.blind_beams[self.blind_beams < len(metres)]
            if len(seen) < len(self.blind_beams):
                report.count(FEW_BEAMS)
            metres = metres.copy()
            metres[seen] = np.nan
        scan = Scan.from_ranges(
            metres,
            angles,
            stamp=stamp,
            time_increment=time_increment,
            range_min=low,
            range_max=high,
        )
        stored = np.asarray(scan.ranges)
        if getattr(ranges, "dtype", None) == np.float32:  # of a bag: half the memory
            single = stored.astype(np.float32)
            stored = read_only(single) if np.array_equal(single, stored, equal_nan=True) else stored
        return StoredScan(
            ranges=stored,
            angles=np.asarray(scan.angles),
            stamp=scan.stamp,
            time_increment=scan.time_increment,
            band=(low, high),
        )

    def scan_of_points(self, points: FloatArray, stamp: float) -> Scan:
        """A scan of bare points (N, 2) [m] within the caller's band."""
        distance = np.hypot(*points.T)
        low = -math.inf if self.range_min is None else self.range_min
        high = math.inf if self.range_max is None else self.range_max
        kept = points[(distance > low) & (distance < high)]
        side = np.array([1.0, -1.0 if self.mirrored else 1.0])
        return replace(Scan.from_points(kept * side), stamp=stamp)


def _band_in_unit(
    ranges: FloatArray, band: tuple[float, float], factor: float
) -> tuple[float, float]:
    """The declared band in the unit of the ranges [m], or in metres if it would drop most."""
    scaled = factor * band[0], factor * band[1]
    in_unit = np.count_nonzero(is_return(ranges, *scaled))
    return scaled if 2 * in_unit >= np.count_nonzero(is_return(ranges, *band)) else band


def _settle_step(count: int, first: float, step: float, last: float, report: DamageReport) -> float:
    """The step between beams by the vote of first and last angle, step and count."""
    even = (last - first) / (count - 1)
    if not abs(step) > 0.0:  # 0, or not told at all
        if step == 0.0 and even != 0.0:
            report.count(NO_STEP)
        return even
    if abs(first + step * (count - 1) - last) <= MAX_OFF * abs(step):
        return step
    if abs(first - step * (count - 1) - last) <= MAX_OFF * abs(step):
        report.count(OTHER_SIGN)
        return -step
    gap = 2.0 * math.pi - abs(last - first)  # what is left of the turn: nothing, or one step
    if abs(gap - abs(even) / 2.0) <= abs(even):
        report.count(OTHER_STEP)
        return even
    report.count(OTHER_LAST)
    return step


@lru_cache(maxsize=64)
def _spread(first: float, step: float, count: int, *, mirrored: bool) -> FloatArray:
    """Directions [rad], read-only: all scans of one scanner share them."""
    angles = first + step * np.arange(count, dtype=np.float64)
    return read_only(-angles if mirrored else angles)
