"""What the checks of a step are worth, and which limits they need: leave one log out.

``python tests/bench/checks.py FOLDER --out FILE`` takes the logs of a folder (`odometry_logs`
tells how) that have a reference, and tries a few values of each limit on all of them. For each
log, the value is chosen on the others, the one with the fewest lost steps there, then the fewest
wrong ones; of values that are alike, the present one. A row says what the log left out makes of
this value:

- recall and false alarms of the first match, scan to scan, for a guess that is off as wheels are
  and by 0.3 m and 10° (a match is wrong that is off by more than 0.2 m or 5° along the directions
  that its pairs see: along a free one it is no measurement, and no mistake);
- lost and wrong steps of whole runs against the map, without wheels and with them.

Before them, with no log left out, stand lost and wrong steps at each value, the mean of all logs.
The last table has the same of the limits as they are, and the whole step's recall: the share of
wrong first matches that do not end in a wrong step that is believed.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

import labkit.odometry.search
import labkit.odometry.step as one_step
from labkit import Target, apply, from_xytheta, icp, invert, to_xytheta
from labkit.arrays import BoolArray, FloatArray
from labkit.logs import Log
from labkit.odometry import (
    OdometryParameters,
    SanityLimits,
    estimate_odometry,
    estimate_step,
    increments_between,
)
from labkit.odometry.sanity import complaints, conflicts
from labkit.result import IcpResult
from labkit.se2 import relative
from labkit.warm import warm
from odometry_logs import LOST, WRONG, Reference, changed, logs_in, steps_off, wheels_of
from tables import markdown

GUESSES = ("wheels", "0.3/10")
FAULT = 0.3, math.radians(10.0)
# The present value comes first; those in capitals are constants of the step and its search.
VALUES: dict[str, tuple[float, ...]] = {
    "max_prior_translation": (0.75, 0.4, 1.5),
    "max_prior_rotation": (math.radians(30.0), math.radians(15.0), math.radians(60.0)),
    "min_inlier_ratio": (0.2, 0.0, 0.3),
    "max_rmse": (0.2, 0.05),
    "SUPPORTED": (0.5, 0.4, 0.6),
    "SURE": (0.8, 0.6),
    "ALIKE": (0.05, 0.0),
    "SURPRISE": (0.1, 0.0),
    "THROUGH": (0.5, 0.0),
    "STARTS": (8, 4),
}
HEADER = ("limit", "left out", "value", *GUESSES, "lost, wrong % alone", "with wheels")
STILL = np.zeros(3)
Run = tuple[Log, Reference]


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


def first_matches(log: Log, reference: Reference, kind: str) -> Iterator[Any]:
    """Of each pair: increment, prior, inlier ratio, RMSE, wrong or not, and if the step is."""
    parameters, rng = OdometryParameters(), np.random.default_rng(1)
    motions, wheels = increments_between(reference.poses), wheels_of(log)
    for k in tqdm(range(len(motions)), log.name, leave=False, disable=None):
        i, j = reference.scans[k : k + 2]
        bearing, turn = rng.uniform(0.0, math.tau), rng.choice([-FAULT[1], FAULT[1]])
        off = [FAULT[0] * math.cos(bearing), FAULT[0] * math.sin(bearing), turn]
        if j - i != 1 or min(len(log.scans[i]), len(log.scans[j])) < 3:
            continue
        prior = wheels[i]
        if kind == "0.3/10":
            prior = to_xytheta(from_xytheta(motions[k]) @ from_xytheta(off))
        target = Target(log.scans[i])
        result = icp(log.scans[j], target, from_xytheta(prior), parameters.icp)
        record = estimate_step(log.scans[j], target, prior, STILL, parameters)
        x, y, turn = to_xytheta(relative(*from_xytheta([motions[k], record.increment])))
        step_wrong = is_wrong(math.hypot(x, y), abs(turn)) and not record.degenerate
        believed = record.decision.matched and step_wrong
        if result.termination.failed:
            yield STILL, prior, math.nan, math.nan, True, believed
            continue
        pairs = result.correspondences
        rmse = math.sqrt(np.mean(pairs.residuals[pairs.kept] ** 2))
        wrong = is_wrong(*error_seen(result, motions[k]))
        yield to_xytheta(result.T_target_source), prior, result.fitness, rmse, wrong, believed


def alarms(matches: list[Any], limits: SanityLimits) -> BoolArray:
    """Which first matches fail a check."""
    return np.array(
        [
            bool(complaints(increment, ratio, rmse, limits) + conflicts(increment, prior, limits))
            for increment, prior, ratio, rmse, *_ in matches
        ]
    )


def rates(alarm: BoolArray, wrong: BoolArray) -> str:
    """Recall and false alarms in percent, and how many were wrong."""
    recall = f"{100.0 * alarm[wrong].mean():.0f}" if wrong.any() else "–"
    return f"{recall} / {100.0 * alarm[~wrong].mean():.1f} ({wrong.sum()})"


def whole_runs(runs: list[Run], name: str, value: float) -> FloatArray:
    """Lost and wrong steps [%] with the named limit at that value, (logs, ways, 2)."""
    parameters = changed(OdometryParameters(), {name: repr(value)})
    modules = [each for each in (one_step, labkit.odometry.search) if hasattr(each, name)]
    before = [getattr(each, name) for each in modules]
    for each in modules:
        setattr(each, name, value)
    shares = []
    for log, reference in runs:
        for priors in (None, wheels_of(log)):
            poses = estimate_odometry(log.scans, priors, parameters).poses
            shares.append([steps_off(poses, reference, by).mean() for by in (LOST, WRONG)])
    for each, old in zip(modules, before, strict=True):
        setattr(each, name, old)
    return 100.0 * np.reshape(shares, (len(runs), 2, 2))


def left_out(
    runs: list[Run], matches: dict[Any, list[Any]], present: FloatArray, name: str
) -> list[list[str]]:
    """A row for each log: the value of a limit by the other logs, and what it does on this one."""
    values = VALUES[name]
    shares = [present]
    for value in tqdm(values[1:], name, leave=False, disable=None):
        shares.append(whole_runs(runs, name, value))
    rows = []
    for value, share in zip(values, shares, strict=True):
        means = (f"{lost:.2f}, {wrong:.2f}" for lost, wrong in share.mean(axis=0))
        rows.append([name, "none", f"{value:.3g}", *["–"] * len(GUESSES), *means])
    for k, (log, _) in enumerate(runs):
        others = np.delete(shares, k, axis=1).mean(axis=(1, 2)).round(3)  # lost and wrong
        best = min(range(len(values)), key=lambda v: (*others[v], v))
        limits = changed(SanityLimits(), {name: repr(values[best])})
        row = [name, log.name, f"{values[best]:.3g}"]
        for guess in GUESSES:
            found = matches[log.name, guess]
            row.append(rates(alarms(found, limits), np.array([each[4] for each in found])))
        rows.append([*row, *(f"{lost:.1f}, {wrong:.1f}" for lost, wrong in shares[best][k])])
    for row in rows:
        print("  ".join(f"{cell:>14}" for cell in row), flush=True)
    return rows


def whole_steps(matches: dict[Any, list[Any]]) -> list[list[str]]:
    """A row for each log: recall and false alarms of the checks, and the recall of the step."""
    rows = []
    for name in dict.fromkeys(name for name, _ in matches):
        row = [name]
        for guess in GUESSES:
            wrong, believed = np.array([each[4:] for each in matches[name, guess]]).T
            alarm = alarms(matches[name, guess], SanityLimits())
            caught = 100.0 * (~believed[wrong]).mean() if wrong.any() else math.nan
            row += [rates(alarm, wrong), f"{caught:.0f}"]
        rows.append(row)
    return rows


def main() -> int:
    """Match the pairs, run the logs and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+", metavar="LOG|FOLDER")
    parser.add_argument("--scans", type=int, metavar="N", help="use the first N scans of each log")
    parser.add_argument("--limits", nargs="*", choices=VALUES, default=list(VALUES))
    parser.add_argument("--out", metavar="FILE", help="the tables in Markdown")
    args = parser.parse_args()
    warm()
    runs = []
    for log, whole, _ in logs_in(args.logs):
        if whole is not None:
            count = args.scans or len(log)
            used = whole.scans < count
            reference = Reference(scans=whole.scans[used], poses=whole.poses[used])
            runs.append((log.head(count), reference))
    matches = {
        (log.name, guess): list(first_matches(log, reference, guess))
        for log, reference in runs
        for guess in GUESSES
    }
    header = ("log", *(text for guess in GUESSES for text in (guess, "whole step")))
    tables = [markdown(header, whole_steps(matches))]
    print(tables[0])
    present = whole_runs(runs, "max_rmse", VALUES["max_rmse"][0])
    rows = [row for name in args.limits for row in left_out(runs, matches, present, name)]
    tables.insert(0, markdown(HEADER, rows))
    if args.out:
        Path(args.out).write_text("\n\n".join(tables) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
