"""Remarks on a run as a whole, where no step shows the oddity: a likely cause, and what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

import numpy as np

from labkit.odometry.record import StepRecord
from labkit.scan import Scan
from labkit.support.arrays import FloatArray

LONG_BLIND = 10  # steps without a match in a row
LONG_AGAINST = 3  # matches against the prior in a row
ENOUGH_STEPS = 10  # from which a ratio of matches and wheels is told
CLEAR_TURN = math.radians(2.0)  # [rad]: wheels and matches that turn less tell no ratio
CLEAR_WAY = 0.05  # [m]: nor do those that drive less
USUAL_RATIO = 0.5, 1.5  # of matched over told motions; 0.96 to 1.00 on right logs
MANY_BEAMS = 0.05  # share of the beams, on average, that end at one largest range
SAME_RANGE = 1e-6  # [m]


def remarks_on(records: Sequence[StepRecord], largest: Sequence[FloatArray]) -> tuple[str, ...]:
    """Remarks on a run, from its records and the `largest_range` of each scan."""
    return (
        *blind_remarks(records),
        *against_prior_remarks(records),
        *wheel_remarks(records[1:]),
        *free_remarks(records[1:]),
        *range_remarks(largest),
    )


def blind_remarks(records: Sequence[StepRecord]) -> Iterator[str]:
    """Most steps without a match, or many in a row."""
    unmatched = [not record.decision.matched for record in records[1:]]
    if sum(unmatched) > 0.5 * len(unmatched):
        reason = records[1 + unmatched.index(True)].reason
        yield (
            f"{sum(unmatched)} of {len(unmatched)} steps had no match that is believed, the first "
            f"because {reason}; are ranges and wheels in metres, and angles in radians? If so, "
            f"does something hide the view?"
        )
        return
    led = [record.led for record in records[1:]]
    for first, last in stretches(led, LONG_BLIND):
        yield (
            f"scans {first} to {last} follow the wheels, since the scans fit the map too little: "
            f"does something move or hide the view?"
        )
    blind = [not record.decision.matched and not record.led for record in records[1:]]
    for first, last in stretches(blind, LONG_BLIND):
        yield (
            f"scans {first} to {last} were not matched, the first because "
            f"{records[first].reason}: their motion was taken from the prior, or was zero"
        )


def against_prior_remarks(records: Sequence[StepRecord]) -> Iterator[str]:
    """Several matches against the prior in a row."""
    against_prior = [record.against_prior for record in records[1:]]
    for first, last in stretches(against_prior, LONG_AGAINST):
        yield (
            f"scans {first} to {last} were all matched against the prior: either the wheels "
            f"failed there (are they in metres?), or something that moves was taken for the room"
        )


def wheel_remarks(steps: Sequence[StepRecord]) -> Iterator[str]:
    """Matches that turn or drive otherwise than the wheels tell, over the whole run."""
    both = [step for step in steps if step.prior is not None and step.decision.matched]
    matched = np.reshape([step.increment for step in both], (-1, 3))
    told = np.reshape([step.prior for step in both], (-1, 3))
    way = np.hypot(told[:, 0], told[:, 1])
    # Both must see a motion: what wheels alone tell may be their noise, as along a corridor.
    turned = np.minimum(abs(told[:, 2]), abs(matched[:, 2])) > CLEAR_TURN
    moved = np.minimum(way, np.hypot(matched[:, 0], matched[:, 1])) > CLEAR_WAY
    if turned.sum() >= ENOUGH_STEPS:
        ratio = float(np.median(matched[turned, 2] / told[turned, 2]))
        if not USUAL_RATIO[0] <= ratio <= USUAL_RATIO[1]:
            yield (
                f"the scans turn {ratio:.2f} times as far as the wheels: is the scanner upside "
                f"down, or does it count its angles clockwise? If so, read the log with "
                f"`mirrored=True`, or `--mirrored`; else ask whether the wheels' turns are in "
                f"radians"
            )
    if moved.sum() >= ENOUGH_STEPS:
        along = (matched[moved, :2] * told[moved, :2]).sum(axis=1)
        ratio = float(np.median(along / way[moved] ** 2))
        if not USUAL_RATIO[0] <= ratio <= USUAL_RATIO[1]:
            yield (
                f"the scans move {ratio:.3g} times as far as the wheels: does the scanner look "
                f"backwards, or are the wheels in another unit than metres?"
            )


def free_remarks(steps: Sequence[StepRecord]) -> Iterator[str]:
    """A way along walls that nothing measured."""
    untold = sum(step.prior is None and step.degenerate for step in steps)
    if untold > 0.5 * max(len(steps), ENOUGH_STEPS):
        yield (
            f"{untold} of {len(steps)} steps left a direction free, such as the way along a wall, "
            f"and no wheels told it: nothing measured how far the robot drove there; add wheel "
            f"odometry"
        )


def range_remarks(largest: Sequence[FloatArray]) -> Iterator[str]:
    """One largest range that many beams share."""
    ranges, shares = np.reshape(largest, (-1, 2)).T
    if len(ranges) < ENOUGH_STEPS or not np.isfinite(ranges).any():
        return
    common = float(np.nanmedian(ranges))
    same = np.abs(ranges - common) < SAME_RANGE
    share = float(np.where(same, shares, 0.0).mean())
    if share > MANY_BEAMS:
        yield (
            f"{100 * share:.0f} % of the beams end at {common:g} m, the largest range: does the "
            f"scanner tell beams without an answer so? Leave them out by "
            f"`Preprocessing(range_max={0.999 * common:.4g})`, or `--range-max`"
        )


def largest_range(scan: Scan) -> FloatArray:
    """The largest range of a scan [m], and the share of its beams that end there; else NaN."""
    if scan.ranges is None or scan.beams is None or len(scan) == 0:
        return np.array([math.nan, math.nan])
    ranges = scan.ranges[scan.beams]
    largest = ranges.max()
    return np.array([largest, np.mean(ranges > largest - SAME_RANGE)])


def stretches(odd: Iterable[bool], least: int) -> Iterator[tuple[int, int]]:
    """First and last scan of each run of odd steps, of at least so many; step k ends in scan k."""
    for is_odd, run in groupby(enumerate(odd, 1), lambda each: each[1]):
        scans = [k for k, _ in run]
        if is_odd and len(scans) >= least:
            yield scans[0], scans[-1]
