"""What is odd about a log though no line is damaged: told to its reader, not swallowed."""

from __future__ import annotations

import numpy as np

from labkit.arrays import FloatArray, IntArray
from labkit.logs.lines import DamageReport
from labkit.logs.no_return import MILLIMETRES

FAR = 1e5
"""Places farther than this from the origin [m] are seldom meant."""

SILENCE = 1.0
"""Between two messages of an odometry that lie farther apart [s], nobody knows the way."""


def tell_extent(report: DamageReport, extent: float) -> None:
    """Say whether points look like millimetres, by how far they lie from their middle [m]."""
    if extent > MILLIMETRES:
        report.remark(
            f"half of the points lie more than {extent:.4g} m from their middle: are they "
            f"millimetres? labkit reads metres"
        )


def tell_places(report: DamageReport, places: FloatArray, numbers: IntArray, what: str) -> None:
    """Say how many places (K, ≥ 2) lie beyond 100 km, and which is the first."""
    far = np.flatnonzero(np.abs(places[:, :2]).max(axis=1) > FAR)
    if len(far):
        x, y = places[far[0], :2]
        report.remark(
            f"{what} lies beyond 100 km in {len(far)} of {len(places)} lines, the first is "
            f"{numbers[far[0]]}: ({x:g}, {y:g})"
        )


def tell_stamps(report: DamageReport, stamps: FloatArray, numbers: IntArray) -> None:
    """Say whether the clock of the scans stands still or runs backwards."""
    steps = np.diff(stamps)
    for found, what in (
        (np.flatnonzero(steps < 0.0), "runs backwards"),
        (np.flatnonzero(steps == 0.0), "stands still"),
    ):
        if len(found):
            first = found[0] + 1
            report.remark(
                f"the clock of the scans {what} {len(found)} times, first at line "
                f"{numbers[first]}: {stamps[first]:.10g} s after {stamps[first - 1]:.10g} s"
            )


def tell_silence(report: DamageReport, times: FloatArray, stamps: FloatArray) -> None:
    """Say where the odometry is silent so long that its poses are only interpolated."""
    gaps = np.diff(times)
    usual = float(np.median(gaps)) if len(gaps) else 0.0
    long = np.flatnonzero(gaps > max(SILENCE, 10.0 * usual))
    if not len(long):
        return
    inside = sum(
        int(np.count_nonzero((stamps > times[k]) & (stamps < times[k + 1]))) for k in long.tolist()
    )
    longest = long[np.argmax(gaps[long])]
    report.remark(
        f"the odometry is silent {len(long)} times, for {gaps[longest]:.1f} s at the longest, "
        f"from {times[longest]:.10g} s on; the poses of {inside} scans in it are interpolated"
    )
