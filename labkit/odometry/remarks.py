"""The remark on a run as a whole, where no step shows the oddity: a likely cause, a way out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, groupby, islice
from statistics import median_low
from typing import Any, NamedTuple

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.odometry.causes import Motions, are_unlike, explain
from labkit.odometry.constants import MIN_AGREEMENT, MIN_MOTION, MIN_ODD_STEPS, MIN_STEPS, REST
from labkit.odometry.integration import is_within
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.wheels import is_at_rest
from labkit.scan import Scan
from labkit.se2 import from_xytheta, to_xytheta
from labkit.support.arrays import FloatArray


class Step(NamedTuple):
    """One step, as the remarks on a run need it."""

    record: StepRecord
    told: FloatArray | None = None  # by the wheels, (3,), in the frame of the scanner
    stamp: float = math.nan  # of the scan [s]
    largest: tuple[float, bool] = (math.nan, False)  # `largest_range` of the scan
    curvature: float = math.nan  # of the walls in the scan, as `bent_walls.curvature`


def remarks_on(steps: Sequence[Step], first_scan: int = 0) -> tuple[str, ...]:
    """The remark on a run by its steps, of which the first leads to scan `first_scan`; or none.

    One fault shows in many ways, so only the first of them is told: a cause that explains the whole
    run, then what the scans alone show, then steps that are odd.
    """
    motions = motions_of(steps)
    cause = explain(motions)
    largest = [step.largest for step in steps]
    if steps and steps[0].record.decision is Decision.START:
        steps = steps[1:]
        first_scan += 1
    records = [step.record for step in steps]
    remarks = chain(
        [cause] if cause else [],
        range_remarks(largest),
        repeat_remarks(records),
        standing_remarks(steps, common_range(largest)),
        blind_remarks(steps, common_range(largest)),
        impossible_remarks(steps),
        unmatched_remarks(records, first_scan),
        unlike_remarks(motions, common_range(largest)),
        against_prior_remarks(records, first_scan, common_range(largest)),
        free_remarks(records),
        doubtful_remarks(records, first_scan),
    )
    return tuple(islice(remarks, 1))


def motions_of(steps: Sequence[Step]) -> Motions:
    """The motions of all steps but the first, as the causes of a difference need them."""
    unknown = np.full(3, np.nan)
    scans = [motion_of_match(step.record) for step in steps[1:]]
    wheels = [step.told for step in steps[1:]]
    return Motions(
        scans=np.reshape([unknown if each is None else each for each in scans], (-1, 3)),
        wheels=np.reshape([unknown if each is None else each for each in wheels], (-1, 3)),
        times=np.array([step.stamp for step in steps]),
        curvatures=np.array([step.curvature for step in steps]),
    )


def motion_of_match(record: StepRecord) -> FloatArray | None:
    """Motion to where the match of a step ended, also if wrong wheels were believed instead.

    A refused match that agrees too little to measure an error of wheels tells none.
    """
    if record.decision.matched:
        return record.increment
    if record.T_taken_refused is None or record.agreement < MIN_AGREEMENT:
        return None
    return to_xytheta(from_xytheta(record.increment) @ record.T_taken_refused)


def repeat_remarks(records: Sequence[StepRecord]) -> Iterator[str]:
    """Scans that repeat the one before."""
    repeats = sum(record.repeats for record in records)
    if repeats >= MIN_ODD_STEPS:
        yield (
            f"{repeats} of {len(records)} scans repeat the one before to the last digit: does the "
            f"scanner hang? Only wheels can tell the motion there. If the log holds each scan "
            f"twice, take every second one, `log.scans[::2]` and `log.odometry[::2]`"
        )


def blind_remarks(steps: Sequence[Step], largest: float) -> Iterator[str]:
    """Most steps without a match; `largest` is the usual largest range [m]."""
    records = [step.record for step in steps]
    unmatched = [record for record in records if is_unmatched(record)]
    if len(unmatched) <= 0.5 * len(records):
        return
    count = f"{len(unmatched)} of {len(records)} steps"
    empty = sum(was_empty(record) for record in unmatched)
    if empty > 0.5 * len(unmatched):
        yield (
            f"{count} had no match that is believed, {empty} of them since a scan has fewer than "
            f"{MIN_PAIRS} points: does the scanner run? `range_min` and `range_max` drop points too"
        )
        return
    wheels = ""
    if any(step.told is not None for step in steps):
        wheels = (
            " If they match without wheels (`--prior none`), the wheels, or the place of the "
            "scanner on the robot, are wrong"
        )
    yield (
        f"{count} had no match that is believed, the first because {unmatched[0].reason}: are "
        f"ranges{reach(largest)} in metres (`range_unit` of `read_log`, `--range-unit`), and "
        f"angles in radians? Do people, or the robot itself (`range_min`, `--range-min`), hide the "
        f"view? Or do the scans lie too far apart?{wheels}"
    )


def is_unmatched(record: StepRecord) -> bool:
    """True for a step whose scan was not matched, though it is no repeat."""
    return not (record.decision.matched or record.repeats)


def was_empty(record: StepRecord) -> bool:
    """True for a step without a match, since one of its scans has too few points for any."""
    return record.termination is None and math.isnan(record.agreement)


def unmatched_remarks(records: Sequence[StepRecord], first_scan: int) -> Iterator[str]:
    """Many steps in a row that follow the wheels, or have no match."""
    led = [record.led for record in records]
    if longest := longest_stretch(led, MIN_STEPS, first_scan):
        yield (
            f"{longest.words} follow the wheels, since the scans fit the map too "
            f"little: does something move or hide the view?"
        )
    blind = [is_unmatched(record) and not record.led for record in records]
    if longest := longest_stretch(blind, MIN_STEPS, first_scan):
        yield (
            f"{longest.words} were not matched, the first because "
            f"{records[longest.first_step].reason}: their motion was taken from the prior, or was "
            f"zero"
        )


def unlike_remarks(motions: Motions, largest: float) -> Iterator[str]:
    """Wheels that tell other motions, though no cause is known; `largest` is as above [m]."""
    if are_unlike(motions):
        yield (
            f"scans and wheels tell different motions, and no cause explains it: are the wheels of "
            f"this drive, and ranges{reach(largest)} in metres? Without wheels (`--prior none`) "
            f"the scans are matched alone"
        )


def against_prior_remarks(
    records: Sequence[StepRecord], first_scan: int, largest: float
) -> Iterator[str]:
    """Several matches against the prior in a row; `largest` is the usual largest range [m]."""
    against_prior = [record.against_prior for record in records]
    if longest := longest_stretch(against_prior, MIN_ODD_STEPS, first_scan):
        yield (
            f"{longest.words} were all matched against the prior: are the wheels of this drive, in "
            f"radians, and in metres as the ranges{reach(largest)}? If so, they failed there, or "
            f"something that moves was taken for the room"
        )


def standing_remarks(steps: Sequence[Step], largest: float) -> Iterator[str]:
    """Wheels that stand while the scans move, or scans that stay while the wheels drive.

    `largest` is the usual largest range [m].
    """
    matched = [
        (step.told, step.record.increment)
        for step in steps
        if step.told is not None and step.record.decision.matched
    ]
    standing = sum(is_at_rest(told) and moves(increment) for told, increment in matched)
    if standing >= MIN_STEPS:
        yield (
            f"in {standing} steps the wheels told that the robot stands while its scans moved: did "
            f"their log end, or is it of another drive?"
        )
    driving = [increment for told, increment in matched if way_of(told) > MIN_MOTION[0]]
    staying = sum(way_of(increment) <= REST[0] for increment in driving)
    if staying >= MIN_STEPS and staying > 0.5 * len(driving):
        yield (
            f"in {staying} steps the wheels drove and the scans stayed: are ranges{reach(largest)} "
            f"in metres (`range_unit` of `read_log`, `--range-unit`)? Or do many beams see the "
            f"robot itself? `range_min` or `blind_beams` (`--range-min`, `--blind-beams`) leave "
            f"them out"
        )


def way_of(motion: FloatArray) -> float:
    """Length [m] of a motion."""
    return math.hypot(motion[0], motion[1])


def moves(motion: FloatArray) -> bool:
    """True for a motion that tells more than noise."""
    return not is_within(motion, MIN_MOTION)


def impossible_remarks(steps: Sequence[Step]) -> Iterator[str]:
    """Wheels that tell more than the robot can do."""
    impossible = [
        (motion, scales)
        for step in steps
        if step.told is not None and step.record.prior is None
        if (scales := step.record.scales) is not None
        if not scales.allow(motion := scales.correct(step.told))
    ]
    if len(impossible) >= MIN_ODD_STEPS:
        first_motion, scales = impossible[0]
        x, y, turn = first_motion.tolist()
        length, limit = f"{math.hypot(x, y):.3g} m", "`max_translation` (`--max-translation`)"
        if scales.allow(np.array([x, y, 0.0])):
            length, limit = f"a turn of {math.degrees(abs(turn)):.0f}°", "`max_rotation`"
        yield (
            f"in {len(impossible)} steps the wheels told more than the robot can do, the first "
            f"time {length}, and were left out: does their counter wrap? If the robot can do it, "
            f"raise {limit} of `SanityLimits`"
        )


def free_remarks(steps: Sequence[StepRecord]) -> Iterator[str]:
    """A way along walls that nothing measured."""
    unmeasured = sum(step.is_free for step in steps)
    if unmeasured > 0.5 * max(len(steps), MIN_STEPS):
        yield (
            f"{unmeasured} of {len(steps)} steps left a direction free, such as the way along a "
            f"wall, and no wheels told it: nothing measured how far the robot drove there; add "
            f"wheel odometry"
        )


def doubtful_remarks(records: Sequence[StepRecord], first_scan: int) -> Iterator[str]:
    """Most steps doubtful, or many in a row, other than by a free direction without wheels."""
    doubtful = [record.is_doubtful for record in records]
    unclear = [odd and not record.is_free for odd, record in zip(doubtful, records, strict=True)]
    if sum(doubtful) > 0.5 * max(len(doubtful), MIN_STEPS):
        first = doubtful.index(True)
        words = f"{sum(doubtful)} of {len(doubtful)} steps may be wrong, the first one to scan "
        words += str(first_scan + first)
    elif longest := longest_stretch(unclear, MIN_STEPS, first_scan):
        first, words = longest.first_step, f"{longest.words} may all be wrong, the first one"
    else:
        return
    yield (
        f"{words}: {records[first].reason or 'a direction is free'}; `StepRecord.is_doubtful` "
        f"marks them"
    )


def range_remarks(largest: Sequence[tuple[float, bool]]) -> Iterator[str]:
    """One largest range that more beams share than any other one."""
    common = common_range(largest)
    capped = sum(is_commonest and distance == common for distance, is_commonest in largest)
    if capped >= MIN_STEPS and capped > 0.5 * len(largest):
        yield (
            f"more beams end at {common:g} m, the largest range, than at any other one: does the "
            f"scanner tell beams without an answer so? Leave them out by "
            f"`Preprocessing(range_max={0.999 * common:.4g})`, or `--range-max`"
        )


def common_range(largest: Sequence[tuple[float, bool]]) -> float:
    """The median of the largest ranges [m]; NaN where no scan has one."""
    ranges = [distance for distance, _ in largest if math.isfinite(distance)]
    return median_low(ranges) if ranges else math.nan


def reach(largest: float) -> str:
    """How far the scans reach, in brackets; nothing where it is unknown."""
    return "" if math.isnan(largest) else f" (up to {largest:.4g} m)"


def largest_range(scan: Any) -> tuple[float, bool]:
    """The largest range of a scan [m], and whether several beams, the most, end there; else NaN."""
    if not isinstance(scan, Scan) or scan.ranges is None or scan.beams is None or len(scan) == 0:
        return math.nan, False
    ranges, counts = np.unique(scan.ranges[scan.beams], return_counts=True)
    return float(ranges[-1]), bool(1 < counts[-1] == counts.max())


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
