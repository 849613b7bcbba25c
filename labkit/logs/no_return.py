"""Which ranges of a log mean "nothing came back": told from a wall by how they are spread.

A scanner that saw nothing writes a number all the same, in most logs without saying which.
Such a code stands at the top of the range, the same to the millimetre in scan after scan,
where walls are spread: a wall looked at from many places, or under many angles, gives no
number much more often than its neighbours. SICK's codes are the nine largest numbers of the
scanner's 13 to 16 bits, in millimetres or centimetres: 8.183 to 8.191 m, 81.83 to 81.91 m,
32.759 to 32.767 m and so on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import BoolArray, FloatArray, IntArray, as_floats
from labkit.errors import InvalidParameterError
from labkit.logs.lines import DamageReport
from labkit.scan import Scan

Band = tuple[float, float]

SICK_NO_RETURN = 81.8
"""From here on an ``FLASER`` line says "no return" [m]: 81.83 and 81.91 are met in logs."""

FIFTY = (50.0, 51.999)
"""Codes that the Killian and ACES logs write [m]."""

SICK: tuple[Band, ...] = tuple(
    (((1 << bits) - 9) * unit, ((1 << bits) - 1) * unit)
    for unit in (0.01, 0.001)
    for bits in (16, 15, 14, 13)
)

HIGHEST = 400.0
"""Ranges beyond it [m] are not counted: no scanner of a robot sees so far."""

ROUNDED = 0.005
"""A code may have lost its third decimal [m]."""

SAME = 0.0015
"""Ranges that differ by less [m] are one number, printed or rounded in two ways."""

MILLIMETRES = 100.0
"""Where half the returns lie farther [m], they are hardly metres."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Beams:
    """One sweep as its file has it: all ranges [m], directions [rad], and the band that counts."""

    ranges: FloatArray
    angles: FloatArray
    stamp: float
    range_min: float = 0.0
    range_max: float = np.inf


def declared_maximum(declared: float) -> float:
    """The range [m] at which returns end: a maximum rounded up from a code is that code.

    >>> [round(declared_maximum(declared), 2) for declared in (81.92, 8.2, 50.0, 8.3)]
    [81.83, 8.18, 50.0, 8.3]
    """
    for low, high in SICK:
        if low < declared <= 1.002 * high:
            return low - SAME
    return declared


@dataclass(frozen=True, kw_only=True)
class ScanSettings:
    """What a caller wants of the scans of a log.

    Attributes
    ----------
    range_max : float or None
        The maximum [m] in place of the log's own.
    no_return : tuple of (low, high), or None
        The codes in place of those that the ranges tell.
    keep : bool
        Whether all sweeps stay in memory, or are read again when they are asked for.
    """

    range_max: float | None = None
    no_return: tuple[Band, ...] | None = None
    keep: bool = True


class RangeCounts:
    """How often each millimetre was measured in a log; the memory it takes never grows."""

    def __init__(self) -> None:
        self.counts = np.zeros(round(HIGHEST * 1000.0) + 1, dtype=np.int64)
        self._far = 0

    def add(self, beams: Beams) -> None:
        """Count the ranges of one sweep that lie within its band."""
        r = beams.ranges
        valid = r[(r > beams.range_min) & (r < min(beams.range_max, HIGHEST))]
        np.add.at(self.counts, (valid * 1000.0 + 0.5).astype(np.intp), 1)
        if beams.range_max > HIGHEST:
            self._far += int(np.count_nonzero((r >= HIGHEST) & (r < beams.range_max)))

    @property
    def total(self) -> int:
        """How many ranges were counted."""
        return int(self.counts.sum()) + self._far

    def median(self) -> float:
        """The median range [m], inf where most lie beyond `HIGHEST`; NaN for none."""
        total = self.total
        if not total:
            return np.nan
        index = int(np.searchsorted(np.cumsum(self.counts), (total + 1) // 2))
        return index / 1000.0 if index < len(self.counts) else np.inf

    def between(self, band: Band) -> IntArray:
        """The counts from one range to another [m], both included."""
        first, last = (round(min(max(edge, 0.0), HIGHEST) * 1000.0) for edge in band)
        return self.counts[first : last + 1]


def find_codes(counts: RangeCounts, *, sick: bool) -> tuple[Band, ...]:
    """The bands of ranges that are codes for "no return", the farthest first.

    Parameters
    ----------
    counts : RangeCounts
        All ranges of the log below its declared maximum.
    sick : bool
        Whether the log is of a kind that declares no maximum, and by convention comes from
        a SICK: then all from 81.8 m on is a code.
    """
    left = RangeCounts()
    left.counts = counts.counts.copy()
    bands: list[Band] = []
    if sick and left.between((SICK_NO_RETURN, HIGHEST)).any():
        bands.append((SICK_NO_RETURN, np.inf))
        left.between(bands[-1])[:] = 0
    while (band := _code_at_the_top(left)) is not None:
        bands.append(band)
        left.between(band)[:] = 0
    return tuple(bands)


def _code_at_the_top(counts: RangeCounts) -> Band | None:
    """The code that the farthest ranges are, if they are one."""
    measured = np.flatnonzero(counts.counts)
    if not len(measured):
        return None
    top = measured[-1] / 1000.0
    for low, high in (*SICK, FIFTY):
        known = (low - ROUNDED, high + ROUNDED)
        if known[0] <= top <= known[1] and _stands_out(counts, known, at_least=3, times=3.0):
            return known
    repeated = (top - SAME, top + SAME)
    return repeated if _stands_out(counts, repeated, at_least=10, times=5.0) else None


def _stands_out(counts: RangeCounts, band: Band, *, at_least: int, times: float) -> bool:
    """Whether a band holds that many times more ranges than any as wide just below it."""
    low, high = band
    inside = int(counts.between(band).sum())
    width = round((high - low) * 1000.0) + 1
    below = counts.between((low - max(1.0, high - low) - 0.001, low - 0.001))
    sums = np.convolve(below, np.ones(min(width, len(below)), dtype=np.int64), "valid")
    return inside >= at_least and inside > times * (sums.max() if len(sums) else 0)


@dataclass(frozen=True, kw_only=True)
class NoReturns:
    """What makes no point in a log's scans: codes, or all beyond a maximum of the caller.

    Attributes
    ----------
    bands : tuple of (low, high)
        Ranges [m] that are codes, both ends included.
    range_max : float or None
        The caller's maximum [m]; None leaves it to each sweep.
    """

    bands: tuple[Band, ...] = ()
    range_max: float | None = None

    def scan(self, beams: Beams) -> Scan:
        """The scan of a sweep."""
        scan = Scan.from_ranges(
            beams.ranges,
            beams.angles,
            stamp=beams.stamp,
            range_min=beams.range_min,
            range_max=beams.range_max if self.range_max is None else self.range_max,
        )
        if not self.bands or scan.beams is None:
            return scan
        codes = within(beams.ranges[scan.beams], self.bands)
        return scan.select(~codes) if codes.any() else scan


def within(ranges: FloatArray, bands: Iterable[Band]) -> BoolArray:
    """Which ranges lie in one of the bands."""
    mask = np.zeros(ranges.shape, dtype=bool)
    for low, high in bands:
        mask |= (ranges >= low) & (ranges <= high)
    return mask


def as_codes(no_return: ArrayLike) -> tuple[Band, ...]:
    """Bands of the codes that a caller names, in metres."""
    codes = as_floats(no_return, "no_return", hint="give ranges in metres").ravel()
    if not (np.isfinite(codes) & (codes > 0.0)).all():
        raise InvalidParameterError(
            f"`no_return` must be positive ranges in metres, or () for none, got {no_return!r}"
        )
    return tuple((code - SAME, code + SAME) for code in codes.tolist())


def settle(
    counts: RangeCounts, settings: ScanSettings, report: DamageReport, *, sick: bool
) -> NoReturns:
    """What makes no point in the log's scans: what the caller says, or else its ranges.

    Codes that were found in the ranges, and ranges that look like millimetres, are told.
    """
    if settings.no_return is not None or settings.range_max is not None:
        return NoReturns(bands=settings.no_return or (), range_max=settings.range_max)
    codes = find_codes(counts, sick=sick)
    if counts.median() > MILLIMETRES:
        report.remark(
            f"half of the ranges lie beyond {MILLIMETRES:g} m: are they millimetres? labkit reads "
            f"metres"
        )
    elif text := _text(codes, counts):
        report.remark(text)
    return NoReturns(bands=codes)


def _text(bands: Iterable[Band], counts: RangeCounts) -> str:
    """What the log says of the codes that were found in it; empty for none."""
    texts, dropped = [], 0
    for band in bands:
        found = counts.between(band)
        values = (np.flatnonzero(found) + round(band[0] * 1000.0)) / 1000.0
        dropped += int(found.sum())
        if len(values):
            texts.append(
                f"{values[0]:g} m" if len(values) == 1 else f"{values[0]:g} to {values[-1]:g} m"
            )
    if not dropped:
        return ""
    return (
        f"{dropped} of {counts.total} ranges ({100.0 * dropped / counts.total:.2g} %) read "
        f"{', '.join(texts[:4])}: codes for no return, they make no point; `no_return` names "
        f"others, or none"
    )
