"""Sweeps as a log holds them, and the scans made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, check_range
from labkit.logs.lines import DamageReport
from labkit.logs.no_return import as_codes, count_ranges, describe, find_codes, median_range, within
from labkit.scan import Scan

Pose = tuple[float, float, float]
ORIGIN: Pose = (0.0, 0.0, 0.0)

MILLIMETRES = 100.0  # [m]: ranges whose median is larger are hardly metres


@dataclass(frozen=True, eq=False, kw_only=True)
class Sweep:
    """One sweep as its file has it; ranges outside the declared band are no returns."""

    line: int  # in the file, or the number of the message
    ranges: FloatArray  # (B,) [m]
    angles: FloatArray  # (B,) [rad]
    stamp: float  # [s]
    range_min: float = 0.0
    range_max: float = np.inf
    laser: Pose = ORIGIN
    robot: Pose = ORIGIN
    vertex: Pose | None = None  # above it, in a graph


def make_scans(
    sweeps: Sequence[Sweep],
    report: DamageReport,
    *,
    range_max: float | None,
    no_return: ArrayLike | None,
    sick: bool,
) -> tuple[Scan, ...]:
    """Turn sweeps into scans: ranges that are no returns make no point.

    No returns are the ranges outside the declared band, and the codes that `no_return` names
    or, by default, that the ranges of the whole log show; `range_max` takes the place of both.
    """
    codes = () if no_return is None else as_codes(no_return)
    if range_max is not None:
        check_range(range_max, "range_max", above=0.0, unit="m")
    elif no_return is None:
        counts = count_ranges(
            sweep.ranges[(sweep.ranges > sweep.range_min) & (sweep.ranges < sweep.range_max)]
            for sweep in sweeps
        )
        codes = find_codes(counts, sick=sick)
        if median_range(counts) > MILLIMETRES:
            report.remarks.append(
                f"half of the ranges lie beyond {MILLIMETRES:g} m: are they millimetres? labkit "
                f"reads metres"
            )
        elif codes:
            report.remarks.append(describe(codes, counts))
    stamps = np.array([sweep.stamp for sweep in sweeps])
    if not stamps.any():  # a clock that stands at zero is none
        stamps[:] = np.nan
    _remark_clock(stamps, sweeps, report)
    scans = []
    for sweep, stamp in zip(sweeps, stamps.tolist(), strict=True):
        scan = Scan.from_ranges(
            sweep.ranges,
            sweep.angles,
            stamp=stamp,
            range_min=sweep.range_min,
            range_max=sweep.range_max if range_max is None else range_max,
        )
        coded = within(sweep.ranges[scan.beams], codes)
        scans.append(scan.select(~coded) if coded.any() else scan)
    return tuple(scans)


def _remark_clock(stamps: FloatArray, sweeps: Sequence[Sweep], report: DamageReport) -> None:
    """Note a clock that stands still or runs backwards."""
    steps = np.diff(stamps)
    for mask, what in ((steps < 0.0, "runs backwards"), (steps == 0.0, "stands still")):
        if mask.any():
            k = int(np.argmax(mask)) + 1
            report.remarks.append(
                f"the clock of the scans {what} {np.count_nonzero(mask)} times, first at line "
                f"{sweeps[k].line}: {stamps[k]:.10g} s after {stamps[k - 1]:.10g} s"
            )
