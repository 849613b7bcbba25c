"""Cost of a single disturbance of the odometry: each on each log, with wheels and without.

``nice python tests/bench/disturbances.py LOG... --out FILE`` disturbs each log (`odometry_logs`
tells how references are found), or its first N scans by ``--scans N``, two runs at a time, and
writes each result as a line of JSON when it is known. ``--repeats R`` makes R runs, which differ by
a millimetre of noise: one run scatters by a factor of two, so compare medians. All rows are run
once before any is run again.
``disturbances.py --page FILE...`` writes ``book/disturbances.md`` from the results.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, product
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np

import labkit
from labkit import Scan, Target, from_xytheta, icp, to_xytheta
from labkit.correspondences import loss_of
from labkit.evaluation import ate
from labkit.odometry import MapOdometry, StepRecord, increments_between, integrate
from labkit.odometry.constants import MARGIN
from labkit.odometry.record import Placement
from labkit.odometry.search import search
from labkit.parameters import ACCURATE
from labkit.schedule import gate_of
from labkit.se2 import relative, wrap
from labkit.support.arrays import BoolArray, FloatArray
from labkit.support.warm import warm
from odometry_logs import LOST, WRONG, logs_in, wheels_of
from tables import markdown

REFERENCE_STD = 0.02, 0.02, math.radians(0.25)  # [m], [m], [rad] of a step: by the map and by two
# scans alone it is told alike to 5 mm, and 2 to 3 cm off the reference
NEAR = 0.5, math.radians(30.0)  # [m], [rad]: a reference errs by less, and along a corridor scans
# fit farther away, too
JITTER = 0.001  # [m] of range noise, which makes another draw of the same run
BOOK = Path(__file__).parents[2] / "book"


@dataclass(frozen=True, eq=False)
class Drive:
    """Scans, what the wheels say of the steps between them (K−1, 3), and the true poses (K, 3)."""

    scans: list[Scan]
    wheels: FloatArray
    truth: FloatArray  # NaN where there is none


Change = Callable[[Drive, np.random.Generator], Drive]


def on_ranges(change: Callable[[FloatArray, FloatArray, int, np.random.Generator], Any]) -> Change:
    """A disturbance of the ranges (B,), in place: `change(ranges, angles, k, rng)`."""

    def disturb(drive: Drive, rng: np.random.Generator) -> Drive:
        scans = []
        for k, scan in enumerate(drive.scans):
            ranges = np.full(len(scan.ranges), np.nan)
            ranges[scan.beams] = scan.ranges[scan.beams]
            change(ranges, scan.angles, k, rng)
            scans.append(Scan.from_ranges(ranges, scan.angles, stamp=scan.stamp))
        return replace(drive, scans=scans)

    return disturb


def thinned(step: int) -> Change:
    def disturb(drive: Drive, rng: np.random.Generator) -> Drive:
        del rng
        scans = []
        for scan in drive.scans:
            ranges = np.full(len(scan.ranges), np.nan)
            ranges[scan.beams] = scan.ranges[scan.beams]
            scans.append(Scan.from_ranges(ranges[::step], scan.angles[::step], stamp=scan.stamp))
        return replace(drive, scans=scans)

    return disturb


def noise(sd: float) -> Change:
    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        ranges += rng.normal(0.0, sd, len(ranges))

    return on_ranges(change)


def ghosts(share: float) -> Change:
    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        hit = rng.random(len(ranges)) < share
        ranges[hit] = rng.uniform(0.3, 10.0, hit.sum())

    return on_ranges(change)


def dropouts(share: float) -> Change:
    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        ranges[rng.random(len(ranges)) < share] = np.nan

    return on_ranges(change)


def largest_range(value: float) -> Change:
    """A scanner that reaches so far [m], and tells so where nothing returns."""

    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        np.minimum(np.nan_to_num(ranges, nan=value), value, out=ranges)

    return on_ranges(change)


def thing(share: float, *, moving: bool) -> Change:
    """A board 1 m ahead, or something round that walks to and fro about 1.5 m away."""

    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        width = share * np.ptp(angles)
        sway = 0.25 * np.ptp(angles) * math.sin(math.tau * k / 40.0) if moving else 0.0
        off = angles - 0.5 * (angles[0] + angles[-1]) - sway
        far = np.full(len(angles), 1.5 + 0.5 * math.sin(math.tau * k / 27.0))
        if not moving:
            far = 1.0 / np.maximum(np.cos(off), 0.2)
        far += rng.normal(0.0, 0.01, len(angles))
        hidden = (np.abs(off) < 0.5 * width) & ~(ranges < far)
        ranges[hidden] = far[hidden]

    return on_ranges(change)


def door(drive: Drive, rng: np.random.Generator) -> Drive:
    """A door shut 1.2 m before the robot, 70° wide, in 6 of each 24 scans."""

    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        if k % 24 < 18:
            return
        off = angles - 0.5 * (angles[0] + angles[-1])
        far = 1.2 / np.maximum(np.cos(off), 0.2) + rng.normal(0.0, 0.01, len(angles))
        hidden = (np.abs(off) < math.radians(35.0)) & ~(ranges < far)
        ranges[hidden] = far[hidden]

    return on_ranges(change)(drive, rng)


def glass(drive: Drive, rng: np.random.Generator) -> Drive:
    """A sector of a third of the view: 40 % of its beams are lost, 30 % end behind the pane."""

    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        off = angles - 0.5 * (angles[0] + angles[-1])
        draws = np.where(np.abs(off) < np.ptp(angles) / 6.0, rng.random(len(ranges)), 1.0)
        ranges[draws < 0.4] = np.nan
        ranges[(draws >= 0.4) & (draws < 0.7)] *= 1.6

    return on_ranges(change)(drive, rng)


def specks(share: float) -> Change:
    """Dust, rain or leaves 1 to 2 m away."""

    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        hit = rng.random(len(ranges)) < share
        ranges[hit] = np.fmin(ranges[hit], rng.uniform(1.0, 2.0, hit.sum()))

    return on_ranges(change)


def view(width: float) -> Change:
    """A scanner that sees so much [rad] ahead."""

    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        off = angles - 0.5 * (angles[0] + angles[-1])
        ranges[np.abs(off) > 0.5 * width] = np.nan

    return on_ranges(change)


def casing(share: float) -> Change:
    """The robot's own casing, 0.3 m away, in so much of the view, half of it on either side."""

    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        off = angles - 0.5 * (angles[0] + angles[-1])
        own = np.abs(off) > 0.5 * (1.0 - share) * np.ptp(angles)
        ranges[own] = 0.3 + rng.normal(0.0, 0.002, own.sum())

    return on_ranges(change)


def people(drive: Drive, rng: np.random.Generator) -> Drive:
    """Two people, 0.4 m wide, who walk 1.5 and 2.2 m ahead of the robot and sway."""

    def change(ranges: FloatArray, angles: FloatArray, k: int, rng: np.random.Generator) -> None:
        off = angles - 0.5 * (angles[0] + angles[-1])
        for distance, side, period in ((1.5, 0.35, 9.0), (2.2, -0.2, 13.0)):
            away = distance + 0.2 * math.sin(math.tau * k / (1.7 * period))
            bearing = side + 0.15 * math.sin(math.tau * k / period)
            far = away + rng.normal(0.0, 0.01, len(angles))
            hidden = (np.abs(off - bearing) < 0.2 / away) & ~(ranges < far)
            ranges[hidden] = far[hidden]

    return on_ranges(change)(drive, rng)


def kept(drive: Drive, scans: Any) -> Drive:
    """Some of the scans; the wheels go on between them."""
    T = from_xytheta(integrate(drive.wheels))[scans]
    wheels = to_xytheta(relative(T[:-1], T[1:]))
    return Drive([drive.scans[k] for k in scans], wheels, drive.truth[scans])


def every(step: int) -> Change:
    return lambda drive, rng: kept(drive, np.arange(0, len(drive.scans), step))


def gaps(length: int) -> Change:
    def disturb(drive: Drive, rng: np.random.Generator) -> Drive:
        count = len(drive.scans)
        lost = {k + i for k in np.linspace(0, count, 8).astype(int)[1:-1] for i in range(length)}
        return kept(drive, [k for k in range(count) if k not in lost])

    return disturb


def repeats(drive: Drive, rng: np.random.Generator) -> Drive:
    twice = rng.random(len(drive.scans)) < 0.1
    return kept(drive, np.repeat(np.arange(len(drive.scans)), 1 + twice))


def empty(drive: Drive, rng: np.random.Generator) -> Drive:
    blank = rng.random(len(drive.scans)) < 0.1
    nothing = Scan.from_ranges([math.inf], [0.0])
    return replace(
        drive, scans=[nothing if b else s for b, s in zip(blank, drive.scans, strict=True)]
    )


def frozen(drive: Drive, rng: np.random.Generator) -> Drive:
    scans, first = list(drive.scans), len(drive.scans) // 2
    scans[first + 1 : first + 16] = 15 * [scans[first]]
    return replace(drive, scans=scans)


def standing_long(count: int) -> Change:
    """So many scans more at one place, each with 5 mm of noise, and wheels that tell rest."""

    def disturb(drive: Drive, rng: np.random.Generator) -> Drive:
        where = len(drive.scans) // 3
        copies = np.full(count, where)
        order = np.concatenate(
            [np.arange(where + 1), copies, np.arange(where + 1, len(drive.scans))]
        )
        longer = kept(drive, order)
        noisy = noise(0.005)(replace(longer, scans=longer.scans[where : where + count]), rng)
        scans = [*longer.scans[:where], *noisy.scans, *longer.scans[where + count :]]
        return replace(longer, scans=scans)

    return disturb


def half_rate(drive: Drive, rng: np.random.Generator) -> Drive:
    """A sweep lasts two steps, and tells the time between its beams.

    Each beam's point is taken from the scan that is nearest in time, and seen from where the
    scanner was when that beam was measured: rough where the robot turns fast.
    """
    del rng
    T = from_xytheta(np.nan_to_num(drive.truth))
    known = np.isfinite(drive.truth[:, 0])
    scans = []
    order = np.arange(0, len(drive.scans) - 2, 2)
    for k in order:
        scan = drive.scans[k]
        count = len(scan.angles)
        increment = (drive.scans[k + 2].stamp - scan.stamp) / count
        if not known[k : k + 3].all():
            scans.append(replace(scan, time_increment=0.0))
            continue
        pieces = []
        for part in (0, 1):
            piece = drive.scans[k + part]
            fractions = 2.0 * piece.beams / count - part  # of the step from k + part on
            mine = (fractions >= 0.0) & (fractions < 1.0)
            motion = to_xytheta(relative(T[k + part], T[k + part + 1]))
            T_piece_beam = from_xytheta(fractions[mine, None] * motion)
            seen = np.einsum(
                "nji,nj->ni", T_piece_beam[:, :2, :2], piece.points[mine] - T_piece_beam[:, :2, 2]
            )
            pieces.append((piece.beams[mine], seen))
        beams = np.concatenate([beams for beams, _ in pieces])
        points = np.concatenate([seen for _, seen in pieces])
        ranges = np.full(count, np.nan)
        angles = scan.angles.copy()
        ranges[beams] = np.hypot(*points.T)
        angles[beams] = np.arctan2(points[:, 1], points[:, 0])
        scans.append(Scan.from_ranges(ranges, angles, stamp=scan.stamp, time_increment=increment))
    return replace(kept(drive, order), scans=scans)


def scaled(factor: float) -> Change:
    return lambda drive, rng: replace(drive, wheels=factor * drive.wheels)


def _somewhere(drive: Drive, rng: np.random.Generator, each: int) -> Any:
    """One step in so many."""
    count = len(drive.wheels)
    return np.sort(rng.choice(np.arange(1, count), max(1, count // each), replace=False))


def jumps(drive: Drive, rng: np.random.Generator) -> Drive:
    wheels, where = drive.wheels.copy(), _somewhere(drive, rng, 60)
    sign = rng.choice([-1.0, 1.0], len(where))
    wheels[where, 2] += sign * np.radians(rng.uniform(30.0, 80.0, len(where)))
    return replace(drive, wheels=wheels)


def slips(drive: Drive, rng: np.random.Generator) -> Drive:
    wheels, where = drive.wheels.copy(), _somewhere(drive, rng, 60)
    far, bearing = rng.uniform(0.5, 2.0, len(where)), rng.uniform(0.0, math.tau, len(where))
    wheels[where, :2] += (far * [np.cos(bearing), np.sin(bearing)]).T
    return replace(drive, wheels=wheels)


def standing(drive: Drive, rng: np.random.Generator) -> Drive:
    wheels, count = drive.wheels.copy(), len(drive.wheels)
    first = count // 3
    wheels[first : first + 30] = 0.0
    return replace(drive, wheels=wheels)


def late(seconds: float) -> Change:
    """Wheels that tell at each scan where the robot was so many seconds before."""

    def disturb(drive: Drive, rng: np.random.Generator) -> Drive:
        stamps = np.array([scan.stamp for scan in drive.scans])
        poses = integrate(drive.wheels)
        poses[:, 2] = np.unwrap(poses[:, 2])
        before = np.column_stack([np.interp(stamps - seconds, stamps, each) for each in poses.T])
        return replace(drive, wheels=increments_between(before))

    return disturb


def wraps(drive: Drive, rng: np.random.Generator) -> Drive:
    """An encoder of 20.48 m that wraps in three steps."""
    wheels = drive.wheels.copy()
    wheels[np.sort(rng.choice(np.arange(1, len(wheels)), 3, replace=False)), 0] -= 20.48
    return replace(drive, wheels=wheels)


def late_at_random(drive: Drive, rng: np.random.Generator) -> Drive:
    """Wheels that tell at each scan where the robot was, 0 to 1 step before."""
    steps = np.arange(len(drive.scans))
    when = steps - rng.uniform(0.0, 1.0, len(steps))
    poses = integrate(drive.wheels)
    poses[:, 2] = np.unwrap(poses[:, 2])
    before = np.column_stack([np.interp(when, steps, column) for column in poses.T])
    return replace(drive, wheels=increments_between(before))


def missing(drive: Drive, rng: np.random.Generator) -> Drive:
    wheels, count = drive.wheels.copy(), len(drive.wheels)
    wheels[rng.random(count) < 0.1] = np.nan
    wheels[count // 2 : count // 2 + 30] = np.nan
    return replace(drive, wheels=wheels)


def clean(drive: Drive, rng: np.random.Generator) -> Drive:
    del rng
    return drive


DISTURBANCES: dict[str, tuple[Change, str]] = {
    "clean": (clean, "Nothing is disturbed: what the others are compared with."),
    "half of the beams": (thinned(2), "Walls have points enough; only thin things are lost."),
    "a quarter of the beams": (thinned(4), "Normals come from neighbours that lie far apart."),
    "noise of 10 mm more": (noise(0.01), "Lines through neighbours average most of it."),
    "noise of 30 mm more": (noise(0.03), "More than δ = 20 mm, so that most pairs weigh less."),
    "noise of 60 mm more": (noise(0.06), "Residuals near the gate of 160 mm: support falls."),
    "10 % ghosts": (ghosts(0.1), "A beam that ends anywhere has no partner, or a wrong one."),
    "30 % ghosts": (ghosts(0.3), "They fill the map, too, and half of them look through walls."),
    "10 % dropouts": (dropouts(0.1), "A beam without an answer says nothing, and nothing wrong."),
    "50 % dropouts": (dropouts(0.5), "As half of the beams, but with gaps at random."),
    "no return told as 8 m": (
        largest_range(8.0),
        "A ring that goes along with the robot; a remark tells to leave it out.",
    ),
    "a third carried along": (
        thing(1 / 3, moving=False),
        "A board 1 m ahead stands still for the scanner: scans fit too little, so wheels lead.",
    ),
    "half carried along": (
        thing(1 / 2, moving=False),
        "The board fits where the robot would stand, which tells nothing while wheels lead.",
    ),
    "a third moving": (
        thing(1 / 3, moving=True),
        "Somebody walks to and fro 1.5 m away; most of each sweep lies where it lay.",
    ),
    "half moving": (thing(1 / 2, moving=True), "The same, and little else is seen."),
    "a door shut 6 of 24": (door, "A wall that comes and goes, 1.2 m ahead, in bursts."),
    "people ahead": (people, "Two people walk ahead of the robot: they move as it does."),
    "own casing": (casing(1 / 3), "A third of the view is the robot itself."),
    "a sector of glass": (glass, "Beams go through, or are lost, in a third of the view."),
    "20 % specks": (specks(0.2), "Short beams 1 to 2 m away, which hide what lies behind."),
    "a view of 90°": (view(math.pi / 2.0), "Often one wall, or a corner of it."),
    "standing for 300 scans": (standing_long(300), "At rest nothing may add up."),
    "half the rate, skew told": (half_rate, "Sweeps that last two steps of up to 1 m and 90°."),
    "every 2nd scan": (every(2), "Steps of 2 m and up to 110°: the scans overlap less."),
    "every 3rd scan": (every(3), "Steps of 3 m; the wheels' own error grows with the way."),
    "every 5th scan": (every(5), "Steps of 5 m, out of one room into the next."),
    "gaps of 5 scans": (gaps(5), "Six steps are long; only wheels say where they lead."),
    "gaps of 15 scans": (gaps(15), "After 15 m the map may show nothing that is in view."),
    "repeated scans": (repeats, "One scan in ten comes twice: a step that is none."),
    "empty scans": (empty, "One scan in ten has no points: the wheels carry that step."),
    "a frozen scanner": (
        frozen,
        "A scan that repeats the one before, while the wheels move, is left out.",
    ),
    "wheels + 10 %": (scaled(1.1), "The factor is learned from the first matches."),
    "wheels − 20 %": (
        scaled(0.8),
        "The factor is learned from the matches, but along corridors nothing measures it.",
    ),
    "wheels jump 30–80°": (jumps, "More unlike the last motions than a match with support is."),
    "wheels slip 0.5–2 m": (slips, "Short slips lie within the window around the wheels."),
    "wheels stand for 30 steps": (
        standing,
        "Wheels that stand while the scan moves are taken for none.",
    ),
    "wheels late by 0.2 s": (late(0.2), "In these logs one step late: wrong at each turn."),
    "wheels late by 0 to 1 step": (late_at_random, "Each step is told too short or too long."),
    "wheels wrap": (wraps, "Three steps of −20.48 m: more than the robot can do tells nothing."),
    "wheels missing": (missing, "Some steps start from the last motion, and a search helps."),
}


@cache
def drive_of(name: str, count: int | None) -> Drive:
    """The first scans of a log, without the poses of its reference that the scans contradict."""
    log, reference, _ = logs_in([name])[0]
    if reference is None:
        raise SystemExit(f"{name} has no reference")
    truth = np.full((len(log), 3), np.nan)
    truth[reference.scans] = reference.poses
    scans, wheels = list(log.scans[:count]), wheels_of(log)
    drive = Drive(scans, wheels[: len(scans) - 1], truth[: len(scans)])
    drive.truth[wrong_poses(drive)] = np.nan
    return drive


def wrong_poses(drive: Drive) -> list[int]:
    """Scans whose true poses are none: the scan before them and the one after contradict them.

    These two do not contradict each other, so that the poses between them are wrong, one to three.
    """
    count = len(drive.scans)
    contradicted = [k for k in range(1, count) if contradicts(drive, k - 1, k)]
    wrong: list[int] = []
    for first, after in pairwise(contradicted):
        if after - first <= 3 and not contradicts(drive, first - 1, after):
            wrong += range(first, after)
    return wrong


def contradicts(drive: Drive, first: int, second: int) -> bool:
    """True if two scans fit better by far at another pose than at the true one, but near to it.

    They are matched from the true motion, from that of the wheels, and from what a search finds.
    """
    if np.isnan(drive.truth[[first, second]]).any():
        return False
    T_true = relative(*from_xytheta(drive.truth[[first, second]]))
    told = integrate(drive.wheels[first:second])[-1]
    source, target = drive.scans[second], Target(drive.scans[first])
    guesses = [T_true, from_xytheta(told), *search(source, target, T_true, NEAR)]
    matches = [icp(source, target, T, ACCURATE) for T in guesses]
    motions = [to_xytheta(relative(T_true, match.T_target_source)) for match in matches]
    costs = [
        match.correspondences.cost
        for match, motion in zip(matches, motions, strict=True)
        if are_apart(motion, WRONG) and not are_apart(motion, NEAR)
    ]
    there = Placement(source=source, target=target, parameters=ACCURATE, T_target_source=T_true)
    max_loss = loss_of(gate_of(ACCURATE, False), ACCURATE.huber_delta)
    gain = there.correspondences.cost - min(costs, default=math.inf)
    return gain > MARGIN * max_loss


def are_apart(errors: FloatArray, limits: tuple[float, float]) -> BoolArray:
    """Which errors (..., 3) exceed either of the limits, [m] and [rad]."""
    shifts = np.hypot(errors[..., 0], errors[..., 1])
    return np.asarray((shifts > limits[0]) | (np.abs(errors[..., 2]) > limits[1]))


def ate_of(poses: FloatArray, truth: FloatArray) -> float:
    known = np.isfinite(truth[:, 0])
    return float(ate(poses[known], truth[known]).translation.rmse)


def off(poses: FloatArray, truth: FloatArray, limits: tuple[float, float]) -> BoolArray:
    """Which steps are off, shape (K−1,)."""
    T, T_true = from_xytheta(poses), from_xytheta(np.nan_to_num(truth))
    errors = to_xytheta(relative(relative(T_true[:-1], T_true[1:]), relative(T[:-1], T[1:])))
    known = np.isfinite(truth[:-1, 0]) & np.isfinite(truth[1:, 0])
    return known & are_apart(errors, limits)


def nees_of(records: Sequence[StepRecord], truth: FloatArray) -> FloatArray:
    """Squared errors of the steps over their covariances and the reference's, where it is known."""
    known = np.isfinite(truth[:-1, 0]) & np.isfinite(truth[1:, 0])
    motions = increments_between(np.nan_to_num(truth))
    nees = []
    for k in np.flatnonzero(known):
        error = records[k].increment - motions[k]
        error[2] = wrap(error[2])
        covariance = records[k].covariance + np.diag(np.square(REFERENCE_STD))
        nees.append(error @ np.linalg.solve(covariance, error))
    return np.array(nees)


def jittered(drive: Drive, seed: int) -> Drive:
    """The same drive with a millimetre of range noise: another draw of a run that scatters."""
    return noise(JITTER)(drive, np.random.default_rng(seed))


def measure(task: tuple[str, int | None, str, bool, int]) -> dict[str, Any]:
    """One run."""
    path, count, name, with_wheels, seed = task
    rng = np.random.default_rng(seed)
    drive = DISTURBANCES[name][0](jittered(drive_of(path, count), seed), rng)
    odometry = MapOdometry()
    poses, records = [], []
    began = time.process_time()
    for k, scan in enumerate(drive.scans):
        prior = None if k == 0 or not with_wheels else drive.wheels[k - 1]
        if prior is not None and np.isnan(prior).any():
            prior = None
        records.append(odometry.update(scan, prior))
        poses.append(odometry.pose)
    seconds = time.process_time() - began
    found = np.array(poses)
    alone = integrate(np.nan_to_num(drive.wheels))
    wrong, lost = (off(found, drive.truth, limits) for limits in (WRONG, LOST))
    flags = np.array([record.is_doubtful for record in records[1:]])
    return {
        "log": Path(path).name.partition(".")[0],
        "disturbance": name,
        "wheels": with_wheels,
        "seed": seed,
        "ate": ate_of(found, drive.truth),
        "alone": ate_of(alone, drive.truth),
        "steps": len(wrong),
        "wrong": int(wrong.sum()),
        "lost": int(lost.sum()),
        "flagged": int(flags.sum()),
        "flagged_wrong": int((flags & wrong).sum()),
        "nees": float(np.median(nees_of(records[1:], drive.truth))),
        "against": sum(record.against_prior for record in records),
        "prior": sum(record.decision.value == "prior" for record in records),
        "ms": 1e3 * seconds / len(drive.scans),
    }


COLUMNS = (
    "disturbance",
    "ATE",
    "least",
    "most",
    "wheels",
    "wrong",
    "told",
    "doubted",
    "NEES",
    "runs",
)


def row_of(name: str, runs: list[dict[str, Any]]) -> list[str]:
    """The row of a disturbance: ATE [m], its range, that of the wheels, and wrong steps."""
    errors = [run["ate"] for run in runs]
    figures = [f"{error:.2f}" for error in (np.median(errors), min(errors), max(errors))]
    alone = "–"
    if runs[0]["wheels"]:
        alone = f"{np.median([run['alone'] for run in runs]):.2f}"
    else:
        name += ", no wheels"
    wrong, told, flagged, steps = (
        sum(run[key] for run in runs) for key in ("wrong", "flagged_wrong", "flagged", "steps")
    )
    doubted = f"{100.0 * (flagged - told) / max(1, steps - wrong):.1f} %"
    counted = [run["nees"] for run in runs if "nees" in run]
    nees = f"{np.median(counted):.1f}" if counted else "–"
    return [name, *figures, alone, str(wrong), str(told), doubted, nees, str(len(runs))]


def page(results: list[dict[str, Any]], version: str) -> str:
    """The page of the book: a table for each log, and a sentence on each disturbance."""
    parts = [INTRO.format(version)]
    for log in dict.fromkeys(run["log"] for run in results):
        rows = []
        for name, wheels in product(DISTURBANCES, (True, False)):
            of_row = log, name, wheels
            runs = [
                run for run in results if (run["log"], run["disturbance"], run["wheels"]) == of_row
            ]
            if runs:
                rows.append(row_of(name, runs))
        parts += [f"## {log}", markdown(COLUMNS, rows)]
    calm = [run for run in results if run["disturbance"] == "clean" and run["wheels"]]
    right = sum(run["steps"] - run["wrong"] for run in calm)
    doubted = sum(run["flagged"] - run["flagged_wrong"] for run in calm)
    believed = [run for run in results if run["flagged"] < 0.5 * run["steps"]]
    wrong = sum(run["wrong"] for run in believed)
    told = sum(run["flagged_wrong"] for run in believed)
    shares = 100.0 * told / max(1, wrong), 100.0 * doubted / max(1, right)
    parts.append(KNOWN.format(told, wrong, shares[0], doubted, right, shares[1]))
    shown = {run["disturbance"] for run in results}
    why = [f"- **{name}**: {why}" for name, (_, why) in DISTURBANCES.items() if name in shown]
    return "\n\n".join([*parts, "## Why", "\n".join(why)]) + "\n"


INTRO = """\
# Disturbances

What does one disturbance cost the odometry? Each row disturbs the scans or the wheels of a recorded
log in one way, and runs the [lab's odometry](odometry.md) on it. The figures are ATE in metres: the
median of some runs, whose ranges differ by a millimetre of noise, the least and the most, and that
of the wheels alone, disturbed as they are. One run scatters by a factor of two, and so may the
median of few. The runs of a row have the seeds 0, 1, …; a single run has seed 0.

- A step is *wrong* if it is off by more than 0.2 m or 5°, and *told* if its record is doubtful
  (`StepRecord.is_doubtful`); both are sums over the runs. *Doubted* is the share of the right steps
  that are doubtful, too.
- *NEES* is the median of the steps' squared errors over their covariances, to which the reference's
  own error of 2 cm and 0.25° is added: 2.4 if both keep their word.
- Poses of the references that the scans before and after contradict do not count: five of csail's,
  two of acapulco's.

`tests/bench/disturbances.py` writes this page; measured was labkit {}."""

KNOWN = """\
## Does it know?

The columns *told* and *doubted* answer for each row. In the runs that doubt less than half of their
steps {0:,} of {1:,} wrong ones are doubtful ({2:.0f} %); on the clean logs with wheels {3:,} of
{4:,} right ones are ({5:.1f} %)."""


def main() -> int:
    """Run, print and write; or write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="*", metavar="LOG")
    parser.add_argument("--scans", type=int, metavar="N", help="use the first N scans of each log")
    parser.add_argument("--only", nargs="+", default=[""], metavar="WORD", help="of their names")
    parser.add_argument("--wheels", choices=("with", "without", "both"), default="both")
    parser.add_argument("--repeats", type=int, default=1, metavar="R", help="with other seeds")
    parser.add_argument("--jobs", type=int, default=2, metavar="N")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the results, JSON lines")
    parser.add_argument("--page", nargs="+", type=Path, metavar="FILE", help="results to write up")
    parser.add_argument("--measured", default=labkit.__version__, help="the version, for the page")
    args = parser.parse_args()
    if args.page:
        lines = [line for path in args.page for line in path.read_text("utf-8").splitlines()]
        results = [json.loads(line) for line in lines]
        (BOOK / "disturbances.md").write_text(page(results, args.measured), encoding="utf-8")
        return 0
    ways = {"with": [True], "without": [False], "both": [True, False]}[args.wheels]
    names = [name for name in DISTURBANCES if any(word in name for word in args.only)]
    tasks = [
        (path, args.scans, name, wheels, seed)
        for seed, name, wheels, path in product(range(args.repeats), names, ways, args.logs)
        if wheels or not name.startswith("wheels")
    ]
    with Pool(args.jobs, warm) as pool, open(args.out or os.devnull, "w", encoding="utf-8") as out:
        for each in pool.imap(measure, tasks):
            print(*(f"{n:.2f}" if isinstance(n, float) else n for n in each.values()), flush=True)
            print(json.dumps(each), file=out, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
