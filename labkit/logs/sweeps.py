"""Sweeps as a log holds them, the scans made of them, and codes for "nothing came back".

A scanner that saw nothing writes a special number; most logs do not say which. SICK's codes are
the nine largest numbers of the scanner's 13 to 16 bits, in millimetres or centimetres: 8.183 to
8.191 m, 81.83 to 81.91 m and so on. A known code counts where the ranges of a log end with it. A
remark names a number that may be an unknown code.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from labkit.logs.lines import DamageReport
from labkit.scan import LONGEST_RANGE, Scan
from labkit.support.arrays import BoolArray, FloatArray, as_floats
from labkit.support.errors import InvalidParameterError

Band = tuple[float, float]
Pose = tuple[float, float, float]
ROUNDED = 0.005  # [m]: the third decimal of a code may be lost
KNOWN: tuple[Band, ...] = (  # [m]
    (50.0, 52.0),  # of the Killian and ACES logs
    *(
        (((1 << bits) - 9) * unit - ROUNDED, ((1 << bits) - 1) * unit + ROUNDED)
        for unit in (0.01, 0.001)
        for bits in (13, 14, 15, 16)
    ),
)
SAME = 0.0015  # [m]: difference of one number printed in two ways
MANY, SOME = 0.01, 100  # share and number of ranges that end in one number, as a code would
MILLIMETRES = 100.0  # [m]: hardly a range in metres is longer, and none in millimetres shorter


class Sweep(NamedTuple):
    """One sweep of a log, and the poses that its line tells."""

    line: int  # in the file, or the number of the message
    scan: Scan  # ranges outside the declared band make no point
    laser: Pose = (0.0, 0.0, 0.0)
    robot: Pose = (0.0, 0.0, 0.0)
    vertex: Pose | None = None  # above it, in a graph


def make_scans(
    sweeps: Sequence[Sweep], report: DamageReport, no_return: ArrayLike | None
) -> tuple[Scan, ...]:
    """Scans of a log without the codes that `no_return` names or, by default, the known ones."""
    scans = [sweep.scan for sweep in sweeps]
    measured = [np.asarray(scan.ranges)[scan.beams] for scan in scans]
    codes = _as_codes(no_return) if no_return is not None else _find_codes(measured, report)
    ranges = np.concatenate([scan.ranges for scan in scans])
    returned = ranges[(ranges > 0.0) & (ranges < LONGEST_RANGE)]
    if returned.size and np.quantile(returned, 0.1) > MILLIMETRES:
        report.remarks.append(
            f"nearly all ranges exceed {MILLIMETRES:g} m: are they millimetres? labkit reads metres"
        )
    stamps = np.array([scan.stamp for scan in scans])
    if not stamps.any():  # a clock that stands at zero is none
        scans = [replace(scan, stamp=math.nan) for scan in scans]
    elif (late := np.flatnonzero(np.diff(stamps) <= 0.0) + 1).size:
        k = late[0]
        report.remarks.append(
            f"the clock of the scans stands still or runs backwards {late.size} times, first at "
            f"line {sweeps[k].line}: {stamps[k]:.10g} s after {stamps[k - 1]:.10g} s"
        )
    coded = (_within(each, codes) for each in measured)
    return tuple(
        scan.select(~mask) if mask.any() else scan for scan, mask in zip(scans, coded, strict=True)
    )


def _find_codes(measured: Sequence[FloatArray], report: DamageReport) -> tuple[Band, ...]:
    """The known code with which the ranges of a log end; a remark on it, or on an unknown one."""
    ranges = np.concatenate(measured)
    size, top = ranges.size, ranges.max(initial=0.0)
    codes = tuple(band for band in KNOWN if band[0] <= top <= band[1])
    coded = _within(ranges, codes)
    at_top = np.count_nonzero(ranges > top - SAME)
    if codes:
        ends = dict.fromkeys((ranges[coded].min(), top))  # one, if equal
        report.remarks.append(
            f"{coded.sum()} of {size} ranges ({100.0 * coded.mean():.2g} %) read "
            f"{' to '.join(f'{end:g}' for end in ends)} m: codes for no return, they make no "
            f"point; `no_return` (`--no-return`) names others, or none"
        )
    elif at_top > max(SOME, MANY * size):
        report.remarks.append(
            f"{at_top} of {size} ranges read {top:g} m, the longest of all; if that means no "
            f"return, name it as `no_return` (`--no-return`)"
        )
    return codes


def _within(ranges: FloatArray, bands: Sequence[Band]) -> BoolArray:
    low, high = np.reshape(bands, (-1, 2, 1)).swapaxes(0, 1)
    return np.asarray(((ranges >= low) & (ranges <= high)).any(axis=0))


def _as_codes(no_return: ArrayLike) -> tuple[Band, ...]:
    """Bands around the codes that a caller names, in metres."""
    codes = as_floats(no_return, "no_return", hint="give ranges in metres").ravel()
    if not (np.isfinite(codes) & (codes > 0.0)).all():
        raise InvalidParameterError(
            f"`no_return` must be positive ranges in metres, or () for none, got {no_return!r}"
        )
    return tuple((code - SAME, code + SAME) for code in codes.tolist())
