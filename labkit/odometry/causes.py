"""Causes that set scans and wheels apart over a whole run: one table, judged by one number.

A cause is a hypothesis: it changes what the scans measured, or what the wheels told, so that both
agree if it holds. It is judged by what is left between them. The cause that leaves least is told
if it leaves less than half of what is left without it; of those that leave nearly as little, the
first one of the table, which has the fewest freedoms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from labkit.odometry.constants import (
    LEAST_WHEEL_ERROR,
    MAX_LEFT,
    MIN_MOTION,
    MIN_STEPS,
    USUAL_CHANGE,
)
from labkit.se2 import wrap
from labkit.support.arrays import EPSILON, BoolArray, FloatArray

WAY, TURN = 0, 1
UNITS = {  # by how many times too far the wheels seem to move
    1000.0: "are they in millimetres?",
    100.0: "are they in centimetres?",
    1.0 / 0.3048: "are they in feet?",
    0.3048: "are the ranges in feet?",
    0.01: "were they divided by 100 once too often?",
    0.001: "were they divided by 1000 once too often?",
}


class Motions(NamedTuple):
    """The motions of N steps as scans measured them and as the wheels told them.

    Both are rows (Δx, Δy, Δψ) in the frame of the scanner [m, m, rad], and NaN where unknown.
    """

    scans: FloatArray  # (N, 3)
    wheels: FloatArray  # (N, 3)
    times: FloatArray  # (N + 1,) of the scans [s]; NaN without stamps
    curvatures: FloatArray  # of the walls in the scans; see `labkit.odometry.bent_walls`

    def of(self, part: int) -> tuple[FloatArray, FloatArray]:
        """Of scans and wheels the ways as complex numbers x + iy, or the turns."""
        if part == TURN:
            return self.scans[:, 2], self.wheels[:, 2]
        return self.scans[:, 0] + 1j * self.scans[:, 1], self.wheels[:, 0] + 1j * self.wheels[:, 1]

    def motion_mask(self, part: int) -> BoolArray:
        """Steps in which scans or wheels tell a motion, and both are known."""
        of_scans, of_wheels = self.of(part)
        return np.maximum(abs(of_scans), abs(of_wheels)) > MIN_MOTION[part]

    def ratios(self, part: int) -> FloatArray:
        """How many times as far as the scans the wheels moved, in steps where both did."""
        of_scans, of_wheels = self.of(part)
        steps = self.motion_mask(part) & (np.minimum(abs(of_scans), abs(of_wheels)) > EPSILON)
        return np.asarray(of_wheels[steps] / of_scans[steps])

    def left(self, alike: Motions) -> float:
        """Share of the difference that is left where a cause makes scans and wheels `alike`.

        It counts the steps of which the cause tells anything. Ways and turns are multiplied, so
        that a cause may change one of them and leave the other.
        """
        share = 1.0
        for part in (WAY, TURN):
            steps = self.motion_mask(part) & np.isfinite(alike.scans + alike.wheels).all(axis=1)
            if steps.sum() >= MIN_STEPS:
                before, after = (difference(*each.of(part), steps, part) for each in (self, alike))
                share *= after / before
        return share


def difference(a: FloatArray, b: FloatArray, steps: BoolArray, part: int) -> float:
    """Median of |a − b| / (|a| + |b|) over some steps, and at least as much as good wheels err."""
    a, b = a[steps], b[steps]
    apart = wrap(a - b) if part == TURN else a - b
    sums = abs(a) + abs(b)
    relative = np.divide(abs(apart), sums, out=np.zeros(len(sums)), where=sums > 0.0)
    usual_error = LEAST_WHEEL_ERROR[part] / (2.0 * USUAL_CHANGE[part])
    return max(usual_error, float(np.median(relative)))


class Explanation(NamedTuple):
    """A cause, fitted to a run: the share of the difference that it leaves, and its remark."""

    left: float
    remark: str


def upside_down(motions: Motions) -> Explanation:
    """A scanner that hangs upside down, or counts its angles clockwise."""
    alike = motions._replace(wheels=motions.wheels * [1.0, -1.0, -1.0])
    remark = (
        "the scans turn against the wheels: is the scanner upside down, or does it count its "
        "angles clockwise? If so, read the log with `mirrored=True`, or `--mirrored` (without it, "
        "if it was read so). If the map shows left on the left, the wheels count turns clockwise: "
        "change the sign of their turns"
    )
    return Explanation(motions.left(alike), remark)


def clockwise_turns(motions: Motions) -> Explanation:
    """Wheels that count their turns clockwise, beside scans that are right."""
    alike = motions._replace(wheels=motions.wheels * [1.0, 1.0, -1.0])
    remark = (
        "the wheels turn against the scans: do they count turns clockwise? If so, change the sign "
        "of their turns"
    )
    return Explanation(motions.left(alike), remark)


def turns_in_degrees(motions: Motions) -> Explanation | None:
    """Turns of wheels in degrees, compared by their size.

    More than half a turn is told as another one, so that which step told it is lost.
    """
    of_scans, of_wheels = motions.of(TURN)
    steps = np.minimum(abs(of_scans), abs(of_wheels)) > MIN_MOTION[TURN]  # no noise of one of them
    if not steps.any():
        return None
    by_size = np.flatnonzero(steps)[np.argsort(abs(of_wheels[steps]))]
    sizes = np.sort(abs(wrap(np.degrees(of_scans[steps]))))
    scans = np.full_like(motions.scans, np.nan)
    scans[by_size, :2] = motions.scans[by_size, :2]
    scans[by_size, 2] = np.copysign(sizes, of_wheels[by_size])
    remark = (
        f"the wheels tell turns of {math.degrees(np.median(abs(of_wheels[steps]))):.0f}° where the "
        f"scans turn by {math.degrees(np.median(abs(of_scans[steps]))):.0f}°, by the median: are "
        f"their turns, or headings, in degrees? Tell them in radians"
    )
    return Explanation(motions.left(motions._replace(scans=scans)), remark)


def mount_angle(motions: Motions) -> Explanation | None:
    """A scanner that is turned on the robot, by half a turn if it looks backwards."""
    ratios = motions.ratios(WAY)
    if not ratios.size:
        return None
    angle = float(np.angle(np.sum(ratios / abs(ratios))))
    c, s = math.cos(angle), math.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    remark = (
        f"the scans move in a direction {abs(math.degrees(angle)):.0f}° off that of the wheels: is "
        f"the scanner turned on the robot, or does it look backwards? If so, add {angle:.2f} to "
        f"the third number of `laser_offset`, or `--laser-offset`"
    )
    return Explanation(motions.left(motions._replace(scans=motions.scans @ R.T)), remark)


def other_unit(motions: Motions, factor: float, question: str) -> Explanation:
    """Wheels, or ranges, in another unit than metres."""
    alike = motions._replace(scans=motions.scans * [factor, factor, 1.0])
    remark = f"the wheels move {factor:.4g} times as far as the scans: {question}"
    return Explanation(motions.left(alike), remark)


def other_scale(motions: Motions) -> Explanation | None:
    """Wheels or ranges that tell all ways too long, or too short, by one factor."""
    ratios = motions.ratios(WAY)
    if not ratios.size:
        return None
    factor = float(np.median(abs(ratios)))
    question = "are their metres right, and those of the ranges? The run goes by the ranges"
    return other_unit(motions, factor, question)


def other_turns(motions: Motions) -> Explanation | None:
    """Wheels that tell all turns too large, or too small, by one factor."""
    ratios = motions.ratios(TURN)
    if not ratios.size:
        return None
    factor = float(np.median(ratios))
    alike = motions._replace(scans=motions.scans * [1.0, 1.0, factor])
    remark = (
        f"the wheels turn {factor:.3g} times as far as the scans: are their turns in radians, and "
        f"the angles of the beams right (`angles` of `read_log`, `--angles`)?"
    )
    return Explanation(motions.left(alike), remark)


def other_clock(motions: Motions) -> Explanation | None:
    """Wheels that come late, or early, by up to ten steps."""
    times = motions.times
    if len(times) < MIN_STEPS:
        return None
    unit = "s"
    if not (np.diff(times) > 0.0).all():
        times = np.arange(len(times), dtype=float)
        unit = "scans"
    step = float(np.median(np.diff(times)))
    lags = 0.25 * step * np.arange(-4 * MIN_STEPS, 4 * MIN_STEPS + 1)
    shares = []
    for lag in lags:
        earlier = motions._replace(wheels=delay(motions.wheels, times, -lag))
        later = motions._replace(scans=delay(motions.scans, times, lag))
        # A shift between two scans smooths noise; only a lag helps whichever of both is shifted.
        shares.append(max(motions.left(earlier), motions.left(later)))
    best = int(np.argmin(shares))
    nearly_best = np.flatnonzero(MAX_LEFT * np.array(shares) < shares[best])
    if np.ptp(nearly_best) >= len(nearly_best):
        return None  # lags far apart fit alike, as those of another drive do
    when = "late" if lags[best] > 0.0 else "early"
    remark = (
        f"scans and wheels agree best if the wheels come {abs(lags[best]):.2g} {unit} too {when}: "
        f"are their clocks apart? Shift the times of one of them"
    )
    return Explanation(shares[best], remark)


def delay(rows: FloatArray, times: FloatArray, lag: float) -> FloatArray:
    """Motions (N, 3) between `times`, each as much later; NaN where one of those is unknown."""
    is_unknown = np.isnan(rows[:, 0])
    path = np.cumsum(np.column_stack([np.nan_to_num(rows), is_unknown]), axis=0)
    path = np.vstack([np.zeros(4), path])
    columns = [np.interp(times - lag, times, each, np.nan, np.nan) for each in path.T]
    delayed = np.diff(columns, axis=1).T
    delayed[delayed[:, 3] > 0.0] = np.nan
    return delayed[:, :3]


def bent_walls(motions: Motions) -> Explanation | None:
    """Angles of the beams that are told too wide, or too narrow: straight walls look bent."""
    widths = motions.curvatures[np.isfinite(motions.curvatures)] ** -0.5
    if len(widths) < MIN_STEPS:
        return None
    every = np.ones(len(widths), np.bool_)
    width = float(np.median(widths))
    left = difference(widths, np.full_like(widths, width), every, TURN)
    left /= difference(widths, np.ones_like(widths), every, TURN)
    remark = (
        f"straight walls look bent, as if the angles of the beams were told {width:.2g} times as "
        f"wide as they are: give the right ones of the first and the last beam, in radians, by "
        f"`angles` of `read_log`, or `--angles`"
    )
    return Explanation(left, remark)


CAUSES: tuple[Callable[[Motions], Explanation | None], ...] = (
    upside_down,
    clockwise_turns,
    turns_in_degrees,
    *(partial(other_unit, factor=factor, question=question) for factor, question in UNITS.items()),
    bent_walls,
    mount_angle,
    other_scale,
    other_turns,
    other_clock,
)


def explain(motions: Motions) -> str | None:
    """The remark of the cause that explains best why scans and wheels differ, or None."""
    explanations = [each for cause in CAUSES if (each := cause(motions)) is not None]
    least = min(each.left for each in explanations)
    enough = min(MAX_LEFT, least / MAX_LEFT)
    return next((each.remark for each in explanations if each.left < enough), None)


def are_unlike(motions: Motions) -> bool:
    """True if scans and wheels differ by more than half of what they tell, in ways and in turns."""
    product = 1.0
    for part in (WAY, TURN):
        steps = motions.motion_mask(part)
        if steps.sum() < MIN_STEPS:
            return False
        product *= 2.0 * difference(*motions.of(part), steps, part)  # over their mean
    return product > MAX_LEFT**2
