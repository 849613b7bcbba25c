"""Worth of the limits of a step, and of other values of each: leave one log out.

``python tests/bench/checks.py FOLDER killian --out FILE`` takes the logs of folders
(`odometry_logs` tells how) that have a reference, and tries a few values of each limit on all of
them. For each log, the value is chosen on the others: the one with the fewest lost steps there,
then the fewest wrong ones; of values that are alike, the present one. Each row holds, at that
value and on the log left out,

- recall and false alarms of `estimate_step`, scan to scan, for guesses that are off as wheels are
  and by 0.3 m and 10°. Recall is the share of the wrong first matches that do not end in a wrong
  step that is believed; false alarms are the right first matches that do not end in a right step
  that is believed. (Wrong is more than 0.2 m or 5° off along the directions that the pairs see:
  along a free one a match is no measurement, and no mistake.)
- lost and wrong steps of whole runs against the map, without wheels and with them.

The rows before them, with no log left out, hold the same at each value, over all logs.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

import labkit.odometry.search as one_search
import labkit.odometry.step as one_step
from labkit import Scan, Target, apply, from_xytheta, icp, invert, to_xytheta
from labkit.correspondences import MIN_PAIRS
from labkit.logs import Log
from labkit.odometry import (
    OdometryParameters,
    estimate_odometry,
    estimate_step,
    increments_between,
)
from labkit.result import IcpResult
from labkit.se2 import relative
from labkit.support.arrays import FloatArray, IntArray
from labkit.support.warm import warm
from odometry_logs import LOST, WRONG, Reference, changed, logs_in, steps_off, wheels_of
from tables import markdown

GUESSES = ("wheels", "0.3 m, 10°")
FAULT = 0.3, math.radians(10.0)
# The present value comes first; those in capitals are constants of the step and its search.
VALUES: dict[str, tuple[float, ...]] = {
    "max_translation": (2.0, 1.5),
    "max_rotation": (math.radians(90.0), math.radians(120.0)),
    "max_prior_translation": (0.75, 0.4, 10.0),
    "max_prior_rotation": (math.radians(30.0), math.radians(15.0), math.pi),
    "min_inlier_ratio": (0.2, 0.0, 0.3),
    "max_rmse": (0.2, 0.05),
    "SUPPORTED": (0.5, 0.4, 0.6),
    "SURE": (0.8, 0.6),
    "ALIKE": (0.05, 0.0),
    "SAME": (0.01, 0.0),
    "SURPRISE": (0.1, 0.0),
    "THROUGH": (0.5, 0.0),
    "STARTS": (8, 4),
    "PROMISING": (200, 60),
}
HEADER = (
    "limit",
    "left out",
    "value",
    *(f"{guess}: recall %, false %" for guess in GUESSES),
    "lost, wrong % alone",
    "with wheels",
)
STILL = np.zeros(3)
Run = tuple[Log, Reference]


@dataclass(frozen=True, eq=False)
class Pair:
    """Two scans, the motion between them, what is guessed of it, and whether ICP's end is wrong."""

    source: Scan
    target: Target
    motion: FloatArray
    guess: FloatArray
    wrong: bool


@contextmanager
def set_to(name: str, value: float) -> Iterator[OdometryParameters]:
    """The parameters with the named limit at a value, and the modules with that constant."""
    modules = [each for each in (one_step, one_search) if hasattr(each, name)]
    before = [getattr(each, name) for each in modules]
    for each in modules:
        setattr(each, name, value)
    try:
        yield changed(OdometryParameters(), {name: repr(value)})
    finally:
        for each, old in zip(modules, before, strict=True):
            setattr(each, name, old)


def error_seen(result: IcpResult, motion: FloatArray) -> tuple[float, float]:
    """How far a match is off [m] and [rad], without the directions that its pairs leave free."""
    T = result.T_target_source
    E = T @ invert(from_xytheta(motion))  # a motion in the target's frame
    here, turn = T[:2, 2], math.atan2(E[1, 0], E[0, 0])
    information = result.observability
    if information is None or not information.free.size:
        return math.dist(here, motion[:2]), abs(turn)
    center, free = information.center, information.free
    d = np.array([*(apply(E, center[None])[0] - center), information.length * turn])
    d -= free @ (free.T @ d)
    turn = d[2] / information.length
    arm = here - center
    return math.hypot(d[0] - turn * arm[1], d[1] + turn * arm[0]), abs(turn)


def is_wrong(shift: float, turn: float) -> bool:
    """Whether an error [m] and [rad] exceeds either limit."""
    return bool(shift > WRONG[0] or turn > WRONG[1])


def pairs_of(log: Log, reference: Reference, guess: str, stride: int) -> Iterator[Pair]:
    """Every so many-th pair of scans that follow one another."""
    rng, matcher = np.random.default_rng(1), OdometryParameters().icp
    motions, wheels = increments_between(reference.poses), wheels_of(log)
    for k in range(0, len(motions), stride):
        i, j = reference.scans[k : k + 2]
        if j - i != 1 or min(len(log.scans[i]), len(log.scans[j])) < MIN_PAIRS:
            continue
        prior = wheels[i]
        if guess != "wheels":
            bearing, turn = rng.uniform(0.0, math.tau), rng.choice([-FAULT[1], FAULT[1]])
            off = [FAULT[0] * math.cos(bearing), FAULT[0] * math.sin(bearing), turn]
            prior = to_xytheta(from_xytheta(motions[k]) @ from_xytheta(off))
        target = Target(log.scans[i])
        result = icp(log.scans[j], target, from_xytheta(prior), matcher)
        wrong = result.termination.failed or is_wrong(*error_seen(result, motions[k]))
        yield Pair(log.scans[j], target, motions[k], prior, wrong)


def recall_and_false(pairs: list[Pair], parameters: OdometryParameters) -> IntArray:
    """Of the pairs: wrong first matches, those caught; right ones, those not kept: shape (4,)."""
    counts = np.zeros(4, np.intp)
    for pair in pairs:
        record = estimate_step(pair.source, pair.target, pair.guess, STILL, parameters)
        x, y, turn = to_xytheta(relative(*from_xytheta([pair.motion, record.increment])))
        step_wrong = is_wrong(math.hypot(x, y), abs(turn)) and not record.degenerate
        if pair.wrong:
            counts[:2] += 1, not (record.decision.matched and step_wrong)
        else:
            counts[2:] += 1, step_wrong or not record.decision.matched
    return counts


def whole_run(log: Log, reference: Reference, priors: Any, told: OdometryParameters) -> FloatArray:
    """Lost and wrong steps [%] of a run, shape (2,)."""
    poses = estimate_odometry(log.scans, priors, told).poses
    return 100.0 * np.array([steps_off(poses, reference, by).mean() for by in (LOST, WRONG)])


def measured(
    runs: list[Run], pairs: dict[Any, list[Pair]], name: str, value: float, present: Any = None
) -> Any:
    """Counts of `recall_and_false`, (logs, guesses, 4), and shares of `whole_run`, (logs, 2, 2)."""
    alone_as_present = name.startswith("max_prior") and present is not None
    counts, shares = [], []
    with set_to(name, value) as told:
        for k, (log, reference) in enumerate(tqdm(runs, name, leave=False, disable=None)):
            counts.append([recall_and_false(pairs[log.name, guess], told) for guess in GUESSES])
            with_wheels = whole_run(log, reference, wheels_of(log), told)
            alone = present[1][k, 0] if alone_as_present else whole_run(log, reference, None, told)
            shares.append([alone, with_wheels])
    return np.array(counts), np.array(shares)


def row(name: str, log: str, value: float, counts: IntArray, shares: FloatArray) -> list[str]:
    """One row of the table."""
    cells = [name, log, f"{value:.3g}"]
    for wrong, caught, right, lost in counts:
        recall = f"{100.0 * caught / wrong:.0f}" if wrong else "–"
        cells.append(f"{recall} ({wrong}), {100.0 * lost / max(right, 1):.1f}")
    cells += [f"{lost:.2f}, {wrong:.2f}" for lost, wrong in shares]
    print("  ".join(f"{cell:>14}" for cell in cells), flush=True)
    return cells


def left_out(
    runs: list[Run], pairs: dict[Any, list[Pair]], present: Any, name: str
) -> list[list[str]]:
    """Rows for each value, and for each log at the value that the other logs choose."""
    values = VALUES[name]
    found = [present, *(measured(runs, pairs, name, value, present) for value in values[1:])]
    counts, shares = (np.array(each) for each in zip(*found, strict=True))
    rows = [
        row(name, "none", *each)
        for each in zip(values, counts.sum(axis=1), shares.mean(axis=1), strict=True)
    ]
    for k, (log, _) in enumerate(runs):
        others = np.delete(shares, k, axis=1).mean(axis=(1, 2)).round(3)  # lost and wrong
        best = min(range(len(values)), key=lambda v: (*others[v], v))
        rows.append(row(name, log.name, values[best], counts[best, k], shares[best, k]))
    return rows


def main() -> int:
    """Match the pairs, run the logs and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+", metavar="LOG|FOLDER")
    parser.add_argument("--scans", type=int, metavar="N", help="use the first N scans of each log")
    parser.add_argument("--stride", type=int, default=1, metavar="N", help="every N-th pair")
    parser.add_argument("--limits", nargs="*", choices=VALUES, default=list(VALUES))
    parser.add_argument("--out", metavar="FILE", help="the table in Markdown")
    args = parser.parse_args()
    warm()
    runs = []
    for log, whole, _ in logs_in(args.logs):
        if whole is not None:
            count = args.scans or len(log)
            used = whole.scans < count
            reference = Reference(scans=whole.scans[used], poses=whole.poses[used])
            runs.append((log.head(count), reference))
    pairs = {
        (log.name, guess): list(pairs_of(log, reference, guess, args.stride))
        for log, reference in runs
        for guess in GUESSES
    }
    present = measured(runs, pairs, "max_rmse", VALUES["max_rmse"][0])
    rows = [each for name in args.limits for each in left_out(runs, pairs, present, name)]
    if args.out:
        Path(args.out).write_text(markdown(HEADER, rows) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
