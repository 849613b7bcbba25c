"""Remarks on a run as a whole, where no step shows the oddity: a likely cause, and what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from statistics import median_low
from typing import Any, NamedTuple

import numpy as np

from labkit.odometry.constants import (
    MAX_SHARE_AT_LIMIT,
    MIN_AGAINST_PRIOR,
    MIN_MOTION,
    MIN_RATIO,
    MIN_STEPS,
    REST,
    STRAIGHT,
)
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.wheels import is_at_rest, scale_of
from labkit.scan import Scan
from labkit.support.arrays import FloatArray


class Step(NamedTuple):
    """One step, as the remarks on a run need it."""

    record: StepRecord
    told: FloatArray | None = None  # by the wheels, (3,), in the frame of the scanner
    largest: tuple[float, float] = (math.nan, math.nan)  # `largest_range` of its scan
    curvature: float = math.nan  # of the walls in its scan, as `bent_walls.curvature`


def remarks_on(steps: Sequence[Step], first_scan: int = 0) -> tuple[str, ...]:
    """Remarks on a run by its steps, of which the first leads to scan `first_scan`.

    Likely causes come first.
    """
    largest = [step.largest for step in steps]
    if steps and steps[0].record.decision is Decision.START:
        steps = steps[1:]
        first_scan += 1
    records = [step.record for step in steps]
    lag = lag_of(steps)
    return (
        *repeat_remarks(records),
        *wall_remarks([step.curvature for step in steps]),
        *(lag_remarks(lag) if lag else wheel_remarks(records)),
        *unbelievable_remarks(steps),
        *blind_remarks(records, first_scan, common_range(largest)),
        *against_prior_remarks(records, first_scan),
        *free_remarks(records),
        *range_remarks(largest),
    )


def repeat_remarks(records: Sequence[StepRecord]) -> Iterator[str]:
    """Scans that repeat the one before."""
    repeats = sum(record.repeats for record in records)
    if repeats >= MIN_AGAINST_PRIOR:
        yield (
            f"{repeats} of {len(records)} scans repeat the one before to the last digit: does the "
            f"scanner hang, or does the log hold scans twice? Only wheels can tell the motion there"
        )


def wall_remarks(curvatures: Sequence[float]) -> Iterator[str]:
    """Walls that look bent."""
    known = [each for each in curvatures if math.isfinite(each)]
    if len(known) < MIN_STEPS or STRAIGHT[0] <= median_low(known) <= STRAIGHT[1]:
        return
    width = "wide" if median_low(known) < STRAIGHT[0] else "narrow"
    yield (
        f"straight walls look bent in {len(known)} scans, as if the angles of the beams were told "
        f"too {width}: are they right, and in radians? Give those of the first and the last beam "
        f"by `angles` of `read_log`, or `--angles`"
    )


def lag_of(steps: Sequence[Step]) -> int:
    """By how many steps the wheels' turns come later than those of the matches; 0 if none fits.

    A lag fits if it leaves less than half of the difference without it, and at most other lags.
    """
    turns = [step.record.increment[2] if step.record.decision.matched else 0.0 for step in steps]
    told = [math.nan if step.told is None else step.told[2] for step in steps]
    turning = [k for k, turn in enumerate(turns) if abs(turn) > MIN_MOTION[1]]
    differences = {}
    for lag in range(-MIN_STEPS, MIN_STEPS + 1):
        pairs = [(turns[k], told[k + lag]) for k in turning if 0 <= k + lag < len(steps)]
        known = [abs(turn - other) for turn, other in pairs if not math.isnan(other)]
        if len(known) >= MIN_STEPS:
            differences[lag] = median_low(known)
    best = min(differences, key=differences.__getitem__, default=0)
    if best == 0 or 0 not in differences:
        return 0
    usual = min(differences[0], median_low(differences.values()))
    return best if differences[best] < 0.5 * usual else 0


def lag_remarks(lag: int) -> Iterator[str]:
    """Wheels that come too late, or too early."""
    when = "late" if lag > 0 else "early"
    yield (
        f"scans and wheels agree best if the wheels come {abs(lag)} scans too {when}: are their "
        f"clocks apart?"
    )


def blind_remarks(records: Sequence[StepRecord], first_scan: int, largest: float) -> Iterator[str]:
    """Most steps without a match, or many in a row; `largest` is the usual largest range [m]."""
    unmatched = [not (record.decision.matched or record.repeats) for record in records]
    if sum(unmatched) > 0.5 * len(unmatched):
        reason = records[unmatched.index(True)].reason
        farthest = "" if math.isnan(largest) else f" (up to {largest:.4g} m)"
        yield (
            f"{sum(unmatched)} of {len(unmatched)} steps had no match that is believed, the first "
            f"because {reason}; are ranges{farthest} and wheels in metres, and angles in "
            f"radians? If so, does something hide the view?"
        )
        return
    led = [record.led for record in records]
    if longest := longest_stretch(led, MIN_STEPS, first_scan):
        yield (
            f"{longest.words} follow the wheels, since the scans fit the map too "
            f"little: does something move or hide the view?"
        )
    blind = [
        is_unmatched and not record.led
        for is_unmatched, record in zip(unmatched, records, strict=True)
    ]
    if longest := longest_stretch(blind, MIN_STEPS, first_scan):
        yield (
            f"{longest.words} were not matched, the first because "
            f"{records[longest.first_step].reason}: their motion was taken from the prior, or was "
            f"zero"
        )


def against_prior_remarks(records: Sequence[StepRecord], first_scan: int) -> Iterator[str]:
    """Several matches against the prior in a row."""
    against_prior = [record.against_prior for record in records]
    if longest := longest_stretch(against_prior, MIN_AGAINST_PRIOR, first_scan):
        yield (
            f"{longest.words} were all matched against the prior: either the "
            f"wheels failed there (are they in metres and radians?), or something that moves was "
            f"taken for the room"
        )


def wheel_remarks(steps: Sequence[StepRecord]) -> Iterator[str]:
    """Matches that turn or drive otherwise than the wheels tell, over the whole run."""
    compared = [step for step in steps if step.prior is not None and step.decision.matched]
    matches = np.reshape([step.increment for step in compared], (-1, 3))
    wheels = np.reshape([step.prior for step in compared], (-1, 3))
    # Both must see a motion: what wheels alone tell may be their noise, as along a corridor.
    turns = np.minimum(abs(wheels[:, 2]), abs(matches[:, 2])) > MIN_MOTION[1]
    scales = [scale_of(told, measured) for told, measured in zip(wheels, matches, strict=True)]
    if turns.sum() >= MIN_STEPS:
        ratio = float(np.median(matches[turns, 2] / wheels[turns, 2]))
        if ratio < 0.0:
            yield (
                f"the scans turn {ratio:.2f} times as far as the wheels: is the scanner upside "
                f"down, or does it count its angles clockwise? If so, read the log with "
                f"`mirrored=True`, or `--mirrored`"
            )
        elif not MIN_RATIO <= ratio <= 1.0 / MIN_RATIO:
            yield (
                f"the scans turn {ratio:.2g} times as far as the wheels: are the wheels' turns in "
                f"radians, and those of the scanner's angles?"
            )
    if np.isfinite(scales).sum() >= MIN_STEPS:
        ratio = float(np.nanmedian(scales))
        if not MIN_RATIO <= ratio <= 1.0 / MIN_RATIO:
            question = "are the wheels in another unit than metres?"
            if ratio < 0.0:
                question = (
                    "does the scanner look backwards? If so, tell its place on the robot by "
                    "`laser_offset`, or `--laser-offset`: its third number is π"
                )
            yield f"the scans move {ratio:.3g} times as far as the wheels: {question}"
            return
    told = np.hypot(wheels[:, 0], wheels[:, 1])
    measured = np.hypot(matches[:, 0], matches[:, 1])
    drives = told > REST[0]
    if drives.sum() >= MIN_STEPS and np.median(measured[drives] / told[drives]) < MIN_RATIO:
        yield (
            f"the scans moved by {measured.sum():.2f} m in all where the wheels told "
            f"{told.sum():.2f} m: do many beams see the robot itself? `range_min` "
            f"or `blind_beams` of `read_log` (`--range-min`, `--blind-beams`) leave them out"
        )


def unbelievable_remarks(steps: Sequence[Step]) -> Iterator[str]:
    """Wheels that tell more than the robot can do, or that it stands while its scans move."""
    impossible = [
        (told, record.scales)
        for record, told, *_ in steps
        if told is not None and not is_at_rest(told)
        if record.prior is None and record.scales is not None
    ]
    if len(impossible) >= MIN_AGAINST_PRIOR:
        first_told, scales = impossible[0]
        x, y, turn = first_told.tolist()
        motion, limit = f"{math.hypot(x, y):.3g} m", "`max_translation` (`--max-translation`)"
        question = "are they in metres, or does their counter wrap?"
        if scales.allow(np.array([x, y, 0.0])):
            motion, limit = f"a turn of {math.degrees(abs(turn)):.0f}°", "`max_rotation`"
            question = "are their turns in radians?"
        yield (
            f"in {len(impossible)} steps the wheels told more than the robot can do, the first "
            f"time {motion}, and were left out: {question} If the robot "
            f"can do it, raise {limit}"
        )
    standing = 0
    for record, told, *_ in steps:
        x, y, turn = record.increment
        has_moved = math.hypot(x, y) > MIN_MOTION[0] or abs(turn) > MIN_MOTION[1]
        is_standing = told is not None and is_at_rest(told)
        standing += record.decision.matched and is_standing and has_moved
    if standing >= MIN_STEPS:
        yield (
            f"in {standing} steps the wheels told that the robot stands while its scans moved: did "
            f"their log end, or is it of another drive?"
        )


def free_remarks(steps: Sequence[StepRecord]) -> Iterator[str]:
    """A way along walls that nothing measured."""
    unmeasured = sum(step.prior is None and step.degenerate for step in steps)
    if unmeasured > 0.5 * max(len(steps), MIN_STEPS):
        yield (
            f"{unmeasured} of {len(steps)} steps left a direction free, such as the way along a "
            f"wall, and no wheels told it: nothing measured how far the robot drove there; add "
            f"wheel odometry"
        )


def range_remarks(largest: Sequence[tuple[float, float]]) -> Iterator[str]:
    """One largest range that many beams share."""
    ranges, shares = np.reshape(largest, (-1, 2)).T
    common = common_range(largest)
    if len(ranges) < MIN_STEPS or math.isnan(common):
        return
    share = float(np.where(ranges == common, shares, 0.0).mean())
    if share > MAX_SHARE_AT_LIMIT:
        yield (
            f"{100 * share:.0f} % of the beams end at {common:g} m, the largest range: does the "
            f"scanner tell beams without an answer so? Leave them out by "
            f"`Preprocessing(range_max={0.999 * common:.4g})`, or `--range-max`"
        )


def common_range(largest: Sequence[tuple[float, float]]) -> float:
    """The median of the largest ranges [m]; NaN where no scan has one."""
    ranges = [distance for distance, _ in largest if math.isfinite(distance)]
    return median_low(ranges) if ranges else math.nan


def largest_range(scan: Any) -> tuple[float, float]:
    """The largest range of a scan [m], and the share of its beams that end there; else NaN."""
    if not isinstance(scan, Scan) or scan.ranges is None or scan.beams is None or len(scan) == 0:
        return math.nan, math.nan
    ranges = scan.ranges[scan.beams]
    largest = float(ranges.max())
    return largest, float(np.mean(ranges == largest))


class Stretch(NamedTuple):
    """The longest run of odd steps."""

    first_step: int
    words: str  # its scans, and how many other runs there are


def longest_stretch(odd: Iterable[bool], min_length: int, first_scan: int) -> Stretch | None:
    """The longest run of at least so many odd steps, of which the first leads to `first_scan`."""
    long: list[list[int]] = []
    for is_odd, run in groupby(enumerate(odd), lambda numbered: numbered[1]):
        steps = [k for k, _ in run]
        if is_odd and len(steps) >= min_length:
            long.append(steps)
    if not long:
        return None
    longest = max(long, key=len)
    words = f"scans {first_scan + longest[0]} to {first_scan + longest[-1]}"
    if len(long) > 1:
        words += f", and those of {len(long) - 1} other stretches,"
    return Stretch(longest[0], words)
