"""Sweeps as a log holds them, the scans made of them, and codes for "nothing came back".

A scanner that saw nothing writes a number all the same, in most logs without saying which.
Such a code stands at the top of the range, alike to some millimetres in scan after scan,
where walls are spread. SICK's codes are the nine largest numbers of the scanner's 13 to 16
bits, in millimetres or centimetres: 8.183 to 8.191 m, 81.83 to 81.91 m and so on.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.logs.lines import DamageReport
from labkit.scan import Scan
from labkit.support.arrays import BoolArray, FloatArray, IntArray, as_floats, check_range
from labkit.support.errors import InvalidParameterError

Band = tuple[float, float]
Pose = tuple[float, float, float]
SICK: tuple[Band, ...] = tuple(
    (((1 << bits) - 9) * unit, ((1 << bits) - 1) * unit)
    for unit in (0.01, 0.001)
    for bits in (16, 15, 14, 13)
)
KNOWN = (*SICK, (50.0, 51.999))  # [m]; the last is of the Killian and ACES logs
SICK_LOG = 81.8  # [m]: from here on all is a code where no maximum is declared, as by FLASER
HIGHEST = 400.0  # [m]: no scanner of a robot sees farther
ROUNDED = 0.005  # [m]: the third decimal of a known code may be lost
SAME = 0.0015  # [m]: difference of one number printed in two ways
JITTER = 0.015  # [m]: spread of a code that is measured like a range
FEWEST = 0.015  # smallest share of the ranges that is a jittering code: else a beam or two
MOST = 0.9  # largest share of the ranges that one repeated number may hold and still be a code
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
    laser: Pose = (0.0, 0.0, 0.0)
    robot: Pose = (0.0, 0.0, 0.0)
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


def declared_maximum(declared: float) -> float:
    """Range [m] at which returns end: a maximum rounded up from a SICK's code is that code."""
    codes = (low for low, high in SICK if low < declared <= 1.002 * high)
    return next((low - SAME for low in codes), declared)


def count_ranges(sweeps: Iterable[FloatArray]) -> IntArray:
    """Histogram of ranges [m] by the millimetre; the last bin holds all from `HIGHEST` on."""
    counts = np.zeros(_bin(HIGHEST) + 1, dtype=np.intp)
    for ranges in sweeps:
        np.add.at(counts, (np.minimum(ranges, HIGHEST) * 1000.0 + 0.5).astype(np.intp), 1)
    return counts


def median_range(counts: IntArray) -> float:
    """Median range [m] of a histogram; 0 if it is empty."""
    return float(np.searchsorted(np.cumsum(counts), (counts.sum() + 1) // 2)) / 1000.0


def find_codes(counts: IntArray, *, sick: bool) -> tuple[Band, ...]:
    """Bands of ranges [m] that are codes, the farthest first; `sick`: none is declared."""
    left = counts.copy()
    left[-1] = 0
    bands: list[Band] = []
    if sick and counts[_bin(SICK_LOG) :].any():
        bands.append((SICK_LOG, np.inf))
        left[_bin(SICK_LOG) :] = 0
    while (measured := np.flatnonzero(left)).size:
        band = _code_at(measured[-1] / 1000.0, left, int(counts.sum()))
        if band is None:
            break
        bands.append(band)
        left[_bin(band[0]) :] = 0
    return tuple(bands)


def _code_at(top: float, counts: IntArray, total: int) -> Band | None:
    """The code at the farthest range [m], if there is one."""
    for low, high in KNOWN:
        band = (low - ROUNDED, high + ROUNDED)
        if band[0] <= top <= band[1] and _stands_out(counts, band, at_least=3, times=3.0):
            return band
    for width, at_least in ((2.0 * SAME, 10), (JITTER, max(10, round(FEWEST * total)))):
        band = (top + SAME - width, top + SAME)
        few = counts[_bin(band[0]) :].sum() <= MOST * total
        if few and _stands_out(counts, band, at_least=at_least, times=5.0):
            return band
    return None


def _stands_out(counts: IntArray, band: Band, *, at_least: int, times: float) -> bool:
    """Compare a band with the fullest one of its width in the metre below it."""
    first, last = map(_bin, band)
    width = last - first + 1
    inside = counts[first : last + 1].sum()
    below = counts[max(first - max(1000, width) - 1, 0) : first]
    sums = np.convolve(below, np.ones(min(width, len(below)), dtype=np.intp), "valid")
    return bool(inside >= at_least and inside > times * sums.max(initial=0))


def _bin(value: float) -> int:
    return round(min(max(value, 0.0), HIGHEST) * 1000.0)


def within(ranges: FloatArray, bands: Iterable[Band]) -> BoolArray:
    """Mask of the ranges that lie in one of the bands."""
    mask = np.zeros(ranges.shape, dtype=bool)
    for low, high in bands:
        mask |= (ranges >= low) & (ranges <= high)
    return mask


def as_codes(no_return: ArrayLike) -> tuple[Band, ...]:
    """Bands around the codes that a caller names, in metres."""
    codes = as_floats(no_return, "no_return", hint="give ranges in metres").ravel()
    if not (np.isfinite(codes) & (codes > 0.0)).all():
        raise InvalidParameterError(
            f"`no_return` must be positive ranges in metres, or () for none, got {no_return!r}"
        )
    return tuple((code - SAME, code + SAME) for code in codes.tolist())


def describe(bands: Sequence[Band], counts: IntArray) -> str:
    """The remark about the codes that were found."""
    texts, dropped = [], 0
    for low, high in bands:
        found = counts[_bin(low) : _bin(high) + 1]
        values = (np.flatnonzero(found) + _bin(low)) / 1000.0
        dropped += int(found.sum())
        ends = dict.fromkeys((values[0], values[-1]))  # one, if they are equal
        texts.append(" to ".join(f"{value:g}" for value in ends) + " m")
    return (
        f"{dropped} of {counts.sum()} ranges ({100.0 * dropped / counts.sum():.2g} %) read "
        f"{', '.join(texts[:4])}: codes for no return, they make no point; `no_return` names "
        f"others, or none"
    )
