"""Doubts about what was read: codes for "nothing came back", clocks, units.

A scanner that saw nothing writes a special number; most logs do not say which. SICK's codes are
the nine largest numbers of the scanner's 13 to 16 bits, in millimetres or centimetres: 8.183 to
8.191 m, 81.83 to 81.91 m and so on. A known code counts where the ranges of a log end with it. A
remark names a number that may be an unknown code.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from labkit.logs.clocks import settle_clock
from labkit.logs.lines import DamageReport
from labkit.logs.reader import Reading, Sweep
from labkit.logs.stored import Band, StoredScan, StoredScans, within
from labkit.scan import LONGEST_RANGE, Scan, is_return
from labkit.support.arrays import FloatArray, IntArray, as_floats
from labkit.support.errors import InvalidParameterError

CODE_ROUNDING = 0.005  # [m]: the third decimal of a code may be lost
KNOWN_CODES: tuple[Band, ...] = (  # [m]
    (50.0, 52.0),  # of the Killian and ACES logs
    *(
        (((1 << bits) - 9) * unit - CODE_ROUNDING, ((1 << bits) - 1) * unit + CODE_ROUNDING)
        for unit in (0.01, 0.001)
        for bits in (13, 14, 15, 16)
    ),
)
CODE_PRECISION = 0.0015  # [m]: difference of one code printed in two ways
MIN_CODE_SHARE = 0.01  # of all ranges that end in one number, as a code would
MIN_CODE_COUNT = 100  # and at least so many of them
CODE_SCATTER = 0.015  # of the longest range, by which a code may scatter below it
MIN_SCATTERED_SHARE = 0.2  # of all ranges that lie so near to the longest
SHORTEST_RANGE = 0.02  # [m]: no scanner measures less
MIN_SAMPLE = 10  # scans: fewer tell nothing of a beam
SAMPLED_SCANS = 200  # of a log tell which beams never change
OWN_REACH = 1.0  # [m]: the robot's own body lies nearer
OWN_SCATTER = 0.02  # [m] of a beam that sees it, about its median
OWN_SHARE = 0.9  # of the scans in which such a beam reads the same
MIN_CHANGE = 0.1  # [m]: in a tenth of the other beams' readings, where the robot moves
MIN_OWN_BEAMS = 0.02  # of all beams: fewer hold no match still
MAX_SWEEP_STEPS = 1.5  # steps of the clock: a scanner begins no sweep before it ends the last
BATCH_SIZE = 512  # scans whose ranges are looked at together
MAX_USUAL_RANGE = 100.0  # [m]: hardly a range in metres is longer, and none in millimetres shorter


def make_scans(reading: Reading, report: DamageReport, no_return: ArrayLike | None) -> StoredScans:
    """Scans of a log without the codes that `no_return` names or, by default, the known ones.

    The list of sweeps is emptied: a long log is not held twice.
    """
    sweeps = reading.sweeps
    codes = _find_codes(sweeps, report) if no_return is None else _as_codes(no_return)
    _suspect_millimetres(sweeps, report)
    _suspect_own_body(sweeps, report)
    stamps = _settle_clock(reading, report)
    is_slow = _sweeps_outlast_steps(sweeps, stamps, report)
    scans = list[StoredScan | Scan]()
    sweeps.reverse()
    for stamp in stamps.tolist():
        scan = sweeps.pop().scan
        time_increment = 0.0 if is_slow else scan.time_increment
        if isinstance(scan, StoredScan):
            scan = replace(scan, stamp=stamp, time_increment=time_increment, codes=codes)
        elif scan.stamp != stamp and not math.isnan(scan.stamp):
            scan = replace(scan, stamp=stamp)
        scans.append(scan)
    return StoredScans(scans)


def _scans_of_ranges(sweeps: Sequence[Sweep]) -> list[StoredScan]:
    return [sweep.scan for sweep in sweeps if isinstance(sweep.scan, StoredScan)]


def _batches(sweeps: Sequence[Sweep], *, measured: bool) -> Iterator[FloatArray]:
    """Ranges of the scans that have beams, or of their points alone, some hundred scans at once."""
    scans = _scans_of_ranges(sweeps)
    for k in range(0, len(scans), BATCH_SIZE):
        batch = scans[k : k + BATCH_SIZE]
        yield np.concatenate(
            [scan.measured_ranges() if measured else scan.ranges for scan in batch]
        )


def _suspect_millimetres(sweeps: Sequence[Sweep], report: DamageReport) -> None:
    returned = short = 0
    for ranges in _batches(sweeps, measured=False):
        positive = ranges[(ranges > 0.0) & (ranges < LONGEST_RANGE)]
        returned += positive.size
        short += int(np.count_nonzero(positive <= MAX_USUAL_RANGE))
    if returned and short < 0.1 * returned:
        report.remarks.append(
            f"nearly all ranges exceed {MAX_USUAL_RANGE:g} m: are they millimetres or "
            f"centimetres? `range_unit` (`--range-unit mm`, `cm`) says so"
        )


def _suspect_own_body(sweeps: Sequence[Sweep], report: DamageReport) -> None:
    """Remark on near beams that never change while others do."""
    scans = _scans_of_ranges(sweeps)
    sample = scans[:: max(1, len(scans) // SAMPLED_SCANS)]
    count = len(sample[0].ranges) if sample else 0
    if len(sample) < MIN_SAMPLE or any(len(scan.ranges) != count for scan in sample):
        return
    ranges = np.array(
        [np.where(is_return(scan.ranges, *scan.band), scan.ranges, np.nan) for scan in sample]
    )
    blank = np.isnan(ranges).all(axis=0)
    ranges[:, blank] = math.inf  # no beam of the body, and none that changes
    usual = np.nanmedian(ranges, axis=0)
    with np.errstate(invalid="ignore"):
        change = np.abs(ranges - usual)
    is_same = np.count_nonzero(change <= OWN_SCATTER, axis=0) >= OWN_SHARE * len(sample)
    is_own = is_same & (usual < OWN_REACH)
    others = change[:, ~is_own & ~blank]
    others = others[np.isfinite(others)]
    is_moving = others.size > 0 and np.quantile(others, 0.9) > MIN_CHANGE
    if not (is_moving and np.mean(is_own) > MIN_OWN_BEAMS):
        return
    beams = np.flatnonzero(is_own)
    low, high = usual[is_own].min(), usual[is_own].max()
    report.remarks.append(
        f"{len(beams)} of {count} beams read the same {low:.3g} to {high:.3g} m in nearly all "
        f"scans, while others change: do they see the robot itself, or a code? `blind_beams` "
        f"(`--blind-beams {' '.join(_stretches(beams))}`) or `range_min` (`--range-min "
        f"{high + 2.0 * OWN_SCATTER:.2g}`) leaves them out"
    )


def _stretches(numbers: IntArray) -> list[str]:
    """Whole numbers in stretches, as 0-29."""
    ends = np.flatnonzero(np.diff(numbers) > 1) + 1
    parts = np.split(numbers, ends)
    return [f"{part[0]}-{part[-1]}" if len(part) > 1 else f"{part[0]}" for part in parts]


def _settle_clock(reading: Reading, report: DamageReport) -> FloatArray:
    """Stamps of the sweeps in seconds, NaN where the clock stands at zero; remarks on both."""
    sweeps = reading.sweeps
    stamps = np.array([sweep.scan.stamp for sweep in sweeps])
    if not stamps.any():  # a clock that stands at zero is none
        return np.full(len(stamps), np.nan)
    stamps = settle_clock(stamps, "the scans", report, is_named=reading.clock_is_named)
    if (late := np.flatnonzero(np.diff(stamps) <= 0.0) + 1).size:
        k = late[0]
        report.remarks.append(
            f"the clock of the scans stands still or runs backwards {late.size} times, first at "
            f"line {sweeps[k].line}: {stamps[k]:.10g} s after {stamps[k - 1]:.10g} s"
        )
    return stamps


def _sweeps_outlast_steps(
    sweeps: Sequence[Sweep], stamps: FloatArray, report: DamageReport
) -> bool:
    """Whether the declared times between beams cannot be true, and a remark on it."""
    scans = _scans_of_ranges(sweeps)
    longest = max((scan.time_increment * len(scan.ranges) for scan in scans), default=0)
    steps = np.abs(np.diff(stamps))
    step = float(np.median(steps)) if steps.size else math.nan
    if not longest > MAX_SWEEP_STEPS * step > 0.0:
        return False
    report.remarks.append(
        f"a sweep takes {longest:.3g} s by its time between beams, and {step:.3g} s pass from scan "
        f"to scan: the time between beams counts as unknown"
    )
    return True


def _find_codes(sweeps: Sequence[Sweep], report: DamageReport) -> tuple[Band, ...]:
    """The known code with which the ranges of a log end; a remark on it, or on an unknown one."""
    top = max((ranges.max(initial=0.0) for ranges in _batches(sweeps, measured=True)), default=0.0)
    codes = tuple(band for band in KNOWN_CODES if band[0] <= top <= band[1])
    size = coded = at_top = near_top = at_bottom = 0
    lowest = top
    shortest = min(
        (ranges.min(initial=top) for ranges in _batches(sweeps, measured=True)), default=top
    )
    bottom = max(shortest + CODE_PRECISION, SHORTEST_RANGE)
    for ranges in _batches(sweeps, measured=True):
        size += ranges.size
        known = ranges[within(ranges, codes)]
        coded += known.size
        lowest = min(lowest, known.min(initial=top))
        at_bottom += int(np.count_nonzero(ranges < bottom))
        at_top += int(np.count_nonzero(ranges > top - CODE_PRECISION))
        near_top += int(np.count_nonzero(ranges > (1.0 - CODE_SCATTER) * top))
    if top > bottom and at_bottom > max(MIN_CODE_COUNT, MIN_CODE_SHARE * size):
        report.remarks.append(
            f"{at_bottom} of {size} ranges read {shortest:.3g} to {bottom:.3g} m, the shortest of "
            f"all; if that means no return, begin the ranges above by `range_min` (`--range-min "
            f"{bottom + CODE_PRECISION:.3g}`)"
        )
    if codes:
        ends = dict.fromkeys((lowest, top))  # one, if equal
        report.remarks.append(
            f"{coded} of {size} ranges ({100.0 * coded / size:.2g} %) read "
            f"{' to '.join(f'{end:g}' for end in ends)} m: codes for no return, they make no "
            f"point; `no_return` (`--no-return`) names others, or none"
        )
    elif near_top > MIN_SCATTERED_SHARE * size and near_top > 2 * at_top:
        report.remarks.append(
            f"{near_top} of {size} ranges read {(1.0 - CODE_SCATTER) * top:.4g} to {top:g} m, the "
            f"longest of all; if that means no return, end the ranges below by `range_max` "
            f"(`--range-max {0.99 * (1.0 - CODE_SCATTER) * top:.4g}`)"
        )
    elif at_top > max(MIN_CODE_COUNT, MIN_CODE_SHARE * size):
        report.remarks.append(
            f"{at_top} of {size} ranges read {top:g} m, the longest of all; if that means no "
            f"return, name it as `no_return` (`--no-return`), or where it scatters end the ranges "
            f"below by `range_max` (`--range-max`)"
        )
    return codes


def _as_codes(no_return: ArrayLike) -> tuple[Band, ...]:
    """Bands around the codes that a caller names, in metres."""
    codes = as_floats(no_return, "no_return", hint="give ranges in metres").ravel()
    if not (np.isfinite(codes) & (codes > 0.0)).all():
        raise InvalidParameterError(
            f"`no_return` must be positive ranges in metres, or () for none, got {no_return!r}"
        )
    return tuple((code - CODE_PRECISION, code + CODE_PRECISION) for code in codes.tolist())
