"""Sweeps as a log holds them, the scans made of them, and codes for "nothing came back".

A scanner that saw nothing writes a special number; most logs do not say which. SICK's codes are
the nine largest numbers of the scanner's 13 to 16 bits, in millimetres or centimetres: 8.183 to
8.191 m, 81.83 to 81.91 m and so on. A known code counts where the ranges of a log end with it,
more often than a wall would stand there. A remark names a number that may be an unknown code.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.logs.lines import DamageReport
from labkit.scan import Scan
from labkit.support.arrays import BoolArray, FloatArray, as_floats, check_range
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
ROUNDED = 0.005  # [m]: the third decimal of a known code may be lost
SAME = 0.0015  # [m]: difference of one number printed in two ways
MANY, SOME = 0.01, 100  # share and number of ranges that end in one number, as a code would
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
    or, by default, the known ones of the log; `range_max` takes the place of both.
    """
    codes = () if no_return is None else as_codes(no_return)
    if range_max is not None:
        check_range(range_max, "range_max", above=0.0, unit="m")
    elif no_return is None:
        bands = ((sweep.ranges, sweep.range_min, sweep.range_max) for sweep in sweeps)
        ranges = np.concatenate([r[(r > low) & (r < high)] for r, low, high in bands])
        codes = find_codes(ranges, sick=sick)
        report.remarks += remarks_on(ranges, codes)
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


def find_codes(ranges: FloatArray, *, sick: bool) -> tuple[Band, ...]:
    """Bands of known codes [m] in a log's ranges, farthest first; `sick` as in `SICK_LOG`."""
    bands: list[Band] = []
    if sick and (ranges >= SICK_LOG).any():
        bands.append((SICK_LOG, np.inf))
    while (left := ranges[ranges < min((low for low, _ in bands), default=np.inf)]).size:
        top = left.max()
        rounded = ((low - ROUNDED, high + ROUNDED) for low, high in KNOWN)
        band = next(((low, high) for low, high in rounded if low <= top <= high), None)
        if band is None or not _stands_out(left, band):
            break
        bands.append(band)
    return tuple(bands)


def _stands_out(ranges: FloatArray, band: Band) -> bool:
    """Compare a band with the fullest one of its width in the metre below it."""
    low, width = band[0], band[1] - band[0]
    below = low - width * np.arange(np.ceil(1.0 / width) + 1.0)[::-1]
    fullest = np.histogram(ranges, below)[0].max()
    return bool(np.count_nonzero(ranges >= low) > max(2, 3 * fullest))


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


def remarks_on(ranges: FloatArray, codes: Sequence[Band]) -> list[str]:
    """Remarks for a user on a log's ranges: their unit, and codes found or suspected."""
    if ranges.size and np.median(ranges) > MILLIMETRES:
        far = f"half of the ranges lie beyond {MILLIMETRES:g} m"
        return [f"{far}: are they millimetres? labkit reads metres"]
    remarks = []
    coded = within(ranges, codes)
    if codes:
        ends = dict.fromkeys((ranges[coded].min(), ranges[coded].max()))  # one, if equal
        remarks.append(
            f"{coded.sum()} of {ranges.size} ranges ({100.0 * coded.mean():.2g} %) read "
            f"{' to '.join(f'{end:g}' for end in ends)} m: codes for no return, they make no "
            f"point; `no_return` (`--no-return`) names others, or none"
        )
    top = ranges[~coded].max(initial=0.0)
    at_top = np.count_nonzero(ranges[~coded] > top - SAME)
    if at_top > max(SOME, MANY * ranges.size):
        remarks.append(
            f"{at_top} of {ranges.size} ranges read {top:g} m, the longest of all; if that means "
            f"no return, name it as `no_return`"
        )
    return remarks
