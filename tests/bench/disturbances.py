"""Cost of a single disturbance of the odometry: each on each log, with wheels and without.

``nice python tests/bench/disturbances.py LOG... [--scans N] --out FILE.json`` disturbs the first N
scans of each log (`odometry_logs` tells how references are found), in two processes. Each ATE is
also given over that of the clean run, and over that of the wheels alone. ``--page`` writes
``book/disturbances.md`` from the results of ``--out``.
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
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np

from labkit import Scan, from_xytheta, to_xytheta
from labkit.evaluation import ate
from labkit.odometry import OdometryParameters, ScanMatchingOdometry, integrate
from labkit.se2 import relative
from labkit.support.arrays import BoolArray, FloatArray
from labkit.support.warm import warm
from odometry_logs import LOST, WRONG, changed, logs_in, wheels_of


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


def missing(drive: Drive, rng: np.random.Generator) -> Drive:
    wheels, count = drive.wheels.copy(), len(drive.wheels)
    wheels[rng.random(count) < 0.1] = np.nan
    wheels[count // 2 : count // 2 + 30] = np.nan
    return replace(drive, wheels=wheels)


def clean(drive: Drive, rng: np.random.Generator) -> Drive:
    del rng
    return drive


DISTURBANCES: dict[str, Change] = {
    "clean": clean,
    "half of the beams": thinned(2),
    "a quarter of the beams": thinned(4),
    "noise of 10 mm more": noise(0.01),
    "noise of 30 mm more": noise(0.03),
    "noise of 60 mm more": noise(0.06),
    "10 % ghosts": ghosts(0.1),
    "30 % ghosts": ghosts(0.3),
    "10 % dropouts": dropouts(0.1),
    "50 % dropouts": dropouts(0.5),
    "a third carried along": thing(1 / 3, moving=False),
    "half carried along": thing(1 / 2, moving=False),
    "a third moving": thing(1 / 3, moving=True),
    "half moving": thing(1 / 2, moving=True),
    "every 2nd scan": every(2),
    "every 3rd scan": every(3),
    "every 5th scan": every(5),
    "gaps of 5 scans": gaps(5),
    "gaps of 15 scans": gaps(15),
    "repeated scans": repeats,
    "empty scans": empty,
    "wheels + 10 %": scaled(1.1),
    "wheels − 20 %": scaled(0.8),
    "wheels jump 30–80°": jumps,
    "wheels slip 0.5–2 m": slips,
    "wheels stand for 30 steps": standing,
    "wheels missing": missing,
}


def drive_of(name: str, count: int | None, first: int = 0) -> Drive:
    """The first scans of a log."""
    log, reference, _ = logs_in([name])[0]
    if reference is None:
        raise SystemExit(f"{name} has no reference")
    truth = np.full((len(log), 3), np.nan)
    truth[reference.scans] = reference.poses
    last = len(log) if count is None else first + count
    return Drive(list(log.scans[first:last]), wheels_of(log)[first : last - 1], truth[first:last])


def flagged(record: Any) -> bool:
    """True if the record itself says that the step may be wrong."""
    return not record.decision.matched or record.ambiguous or record.against_prior


def ate_of(poses: FloatArray, truth: FloatArray) -> float:
    known = np.isfinite(truth[:, 0])
    return float(ate(poses[known], truth[known]).translation.rmse)


def off(poses: FloatArray, truth: FloatArray, limits: tuple[float, float]) -> BoolArray:
    """Which steps are off, shape (K−1,)."""
    T, T_true = from_xytheta(poses), from_xytheta(np.nan_to_num(truth))
    errors = to_xytheta(relative(relative(T_true[:-1], T_true[1:]), relative(T[:-1], T[1:])))
    known = np.isfinite(truth[:-1, 0]) & np.isfinite(truth[1:, 0])
    return known & (
        (np.hypot(errors[:, 0], errors[:, 1]) > limits[0]) | (np.abs(errors[:, 2]) > limits[1])
    )


def measure(task: tuple[str, int | None, int, str, bool, int, dict[str, str]]) -> dict[str, Any]:
    """One run."""
    path, count, first, name, with_wheels, seed, settings = task
    rng = np.random.default_rng(seed)
    drive = DISTURBANCES[name](drive_of(path, count, first), rng)
    odometry = ScanMatchingOdometry(changed(OdometryParameters(), settings))
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
    flags = np.array([flagged(record) for record in records[1:]])
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
        "against": sum(record.against_prior for record in records),
        "prior": sum(record.decision.value == "prior" for record in records),
        "ms": 1e3 * seconds / len(drive.scans),
    }


def main() -> int:
    """Run, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+", metavar="LOG")
    parser.add_argument("--scans", type=int, metavar="N", help="use the first N scans of each log")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", nargs="+", default=list(DISTURBANCES), metavar="WORD")
    parser.add_argument("--wheels", choices=("with", "without", "both"), default="both")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE")
    parser.add_argument("--out", metavar="FILE")
    args = parser.parse_args()
    names = [name for name in DISTURBANCES if any(word in name for word in args.only)]
    ways = {"with": [True], "without": [False], "both": [True, False]}[args.wheels]
    settings = dict(text.split("=") for text in args.set)
    tasks = [
        (path, args.scans, args.first, name, wheels, seed, settings)
        for path, name, wheels, seed in product(args.logs, names, ways, range(args.repeats))
        if wheels or not name.startswith("wheels")
    ]
    results = []
    with Pool(args.jobs, warm) as pool:
        for r in pool.imap(measure, tasks):
            results.append(r)
            print(
                f"{r['log']:12} {r['disturbance']:26} {'wheels' if r['wheels'] else 'alone':7}"
                f"{r['ate']:8.2f}{r['alone']:8.2f} wrong{r['wrong']:4} lost{r['lost']:4} "
                f"flag{r['flagged']:4} hit{r['flagged_wrong']:4} ag{r['against']:4} "
                f"pr{r['prior']:4} {r['ms']:6.1f} ms",
                flush=True,
            )
    if args.out:
        Path(args.out).write_text(json.dumps(results, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
