"""The scanner of a file: its beams and its band, by the caller or else by the file's headers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from labkit.logs.columns import GEOMETRY, METRES, RADIANS
from labkit.logs.lines import DamagedLine, DamageReport
from labkit.logs.options import LogOptions
from labkit.logs.stored import StoredScan, pack
from labkit.scan import MOST_TURN, Scan, is_return
from labkit.support.arrays import FloatArray, read_only

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


class Scanner:
    """The scanner of a file: by the caller's options, or else as the file declares it.

    `mirrored` is the one word that a file may tell beside its scans: the transforms of a bag.
    """

    def __init__(self, options: LogOptions, report: DamageReport) -> None:
        self.options = options
        self.report = report
        self.mirrored = bool(options.mirrored)

    def metres(self, named: float = 1.0) -> float:
        """Factor of ranges to metres: of the caller's unit, or of the one that the file names."""
        unit = self.options.range_unit
        return named if unit is None else METRES[unit]

    def radians(self, named: float = 1.0) -> float:
        """Factor of angles to radians, likewise."""
        unit = self.options.angle_unit
        return named if unit is None else RADIANS[unit]

    def sweep(
        self,
        ranges: Sequence[float] | FloatArray,
        declared: Mapping[str, tuple[float, float]],
        *,
        angles: FloatArray | None = None,
        scale: float = 1.0,
        stamp: float = math.nan,
    ) -> StoredScan:
        """A scan of ranges beside the fields of ROS's ``LaserScan`` that a file declares.

        Each field has a unit, the factor to metres, radians or seconds that the file names, and
        `scale` is that of the ranges. `angles` go before the declared ones.
        """
        fields = {
            name: value * (self.radians(unit) if name in GEOMETRY else unit)
            for name, (value, unit) in declared.items()
        }
        if angles is None:
            first, last = fields.get("angle_min", 0.0), fields.get("angle_max", math.nan)
            step = fields.get("angle_increment", math.nan)
            angles = self.beams(len(ranges), first, step, last)
        band = fields.get("range_min", 0.0), fields.get("range_max", math.inf)
        beam_time = fields.get("time_increment", 0.0)
        return self.scan(
            ranges, angles, scale=scale, stamp=stamp, band=band, time_increment=beam_time
        )

    def beams(self, count: int, first: float, step: float, last: float = math.nan) -> FloatArray:
        """Directions of the beams by the caller, or else as declared by a file [rad]."""
        if self.options.directions is not None:
            first, last = self.options.directions
            step = (last - first) / max(count - 1, 1)
        elif count > 1 and math.isfinite(last):
            step = _settle_step(count, first, step, last, self.report)
        low, high = sorted((first, first + step * (count - 1)))
        if not max(high - low, -low, high) <= MOST_TURN:
            raise DamagedLine(
                f"`angles` must be radians within one turn, got {low:.6g} to {high:.6g}: are these "
                f"degrees? `angle_unit` (`--angle-unit deg`) says so"
            )
        return _spread(first, step, count, mirrored=self.mirrored)

    def scan(
        self,
        ranges: Sequence[float] | FloatArray,
        angles: FloatArray,
        *,
        scale: float = 1.0,
        stamp: float = math.nan,
        band: tuple[float, float] = (0.0, math.inf),
        time_increment: float = 0.0,
    ) -> StoredScan:
        """A scan of ranges in directions [rad]; the band [m] is the one that a file declares."""
        options = self.options
        factor = self.metres(scale)
        metres = np.asarray(ranges, dtype=np.float64)
        if factor != 1.0:
            metres = metres * factor
        if options.range_unit is not None:
            band = _band_in_unit(metres, band, factor)
        low = band[0] if options.range_min is None else options.range_min
        high = band[1] if options.range_max is None else options.range_max
        if options.range_max is None and not high > low:
            self.report.count(NO_MAXIMUM)
            high = math.inf
        if options.time_increment is not None:
            time_increment = options.time_increment
        elif not 0.0 <= time_increment <= 1.0:  # some drivers leave it unset
            time_increment = 0.0
        blind = options.blind
        if len(blind):
            seen = blind[blind < len(metres)]
            if len(seen) < len(blind):
                self.report.count(FEW_BEAMS)
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
        return StoredScan(
            packed=pack(np.asarray(scan.ranges)),
            angles=np.asarray(scan.angles),
            stamp=scan.stamp,
            time_increment=scan.time_increment,
            band=(low, high),
        )

    def scan_of_points(self, points: FloatArray, stamp: float) -> Scan:
        """A scan of bare points (N, 2) [m] within the caller's band."""
        low, high = self.options.range_min, self.options.range_max
        distance = np.hypot(*points.T)
        is_far_enough = distance > (-math.inf if low is None else low)
        kept = points[is_far_enough & (distance < (math.inf if high is None else high))]
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
