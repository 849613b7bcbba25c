"""What the checks of a step are worth, and which limits they need: leave one log out.

``python tests/bench/checks.py FOLDER killian`` takes every pair of successive scans of the logs
in a folder (`odometry_logs` tells how) that have a reference, matches it scan to scan from
guesses that are off as wheels are, by 0.3 m and 10°, by 0.5 m and 20°, and from none, and prints:

- for each quantity, the limit chosen on all logs but one, the most recall of wrong matches at
  5 % of false alarms, and what it does on the log that was left out;
- the odometry's own checks on each log: recall and false alarms of the first match;
- the whole step: the share of wrong first matches that do not end in a wrong step that is
  believed, and of the right ones that are not believed.

A match is wrong that is off by more than 0.2 m or 5° along the directions that its pairs see:
along a free direction it is no measurement, and no mistake.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import math
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
from tqdm import tqdm

from labkit import Target, apply, from_xytheta, invert, to_xytheta
from labkit.arrays import BoolArray, FloatArray
from labkit.logs import Log
from labkit.odometry import Decision, OdometryParameters, estimate_step, increments_between
from labkit.odometry.step import _Step
from labkit.result import IcpResult
from labkit.se2 import relative
from odometry_logs import Reference, logs_in, wheels_of

WRONG = 0.2, math.radians(5.0)
FALSE_ALARMS = 0.05
GUESSES = ("wheels", "0.3/10", "0.5/20", "none")
OFF = {"0.3/10": (0.3, math.radians(10.0)), "0.5/20": (0.5, math.radians(20.0))}
# Larger means worse for each; for those with a minus, smaller does.
QUANTITIES = ("-inlier_ratio", "rmse", "-agreement", "seen_through", "prior_shift", "prior_turn")
STILL = np.zeros(3)
Row = dict[str, Any]


def guess_of(motion: FloatArray, wheels: FloatArray, kind: str, rng: Any) -> FloatArray | None:
    """The prior of a pair; None where there is none."""
    if kind in ("none", "wheels"):
        return wheels if kind == "wheels" else None
    shift, turn = OFF[kind]
    bearing = rng.uniform(0.0, math.tau)
    off = [shift * math.cos(bearing), shift * math.sin(bearing), rng.choice([-turn, turn])]
    return to_xytheta(from_xytheta(motion) @ from_xytheta(off))


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
    return shift > WRONG[0] or turn > WRONG[1]


def lengths(T: FloatArray) -> tuple[float, float]:
    """How far a transform moves [m] and turns [rad]."""
    return math.hypot(T[0, 2], T[1, 2]), abs(math.atan2(T[1, 0], T[0, 0]))


def rows(log: Log, reference: Reference, stride: int) -> Iterator[Row]:
    """One row a match: what was recorded of it, and whether it is wrong."""
    parameters, rng = OdometryParameters(), np.random.default_rng(1)
    motions, wheels = increments_between(reference.poses), wheels_of(log)
    for k in tqdm(range(0, len(motions), stride), log.name, leave=False, disable=None):
        i, j = reference.scans[k : k + 2]
        if j - i != 1 or min(len(log.scans[i]), len(log.scans[j])) < 3:
            continue
        source, target = log.scans[j], Target(log.scans[i])
        for kind in GUESSES:
            prior = guess_of(motions[k], wheels[i], kind, rng)
            guess = STILL if prior is None else prior
            expected = from_xytheta(guess[None])
            step = _Step(source, target, np.eye(3), prior, expected, parameters)
            match = step.match(expected[0], Decision.ICP)
            record = estimate_step(source, target, prior, STILL, parameters)
            off = relative(from_xytheta(motions[k]), from_xytheta(record.increment))
            shift, turn = lengths(relative(expected[0], match.T_target_source))
            failed = match.result.termination.failed
            yield {
                "log": log.name,
                "guess": kind,
                "wrong": failed or is_wrong(*error_seen(match.result, motions[k])),
                "alarm": bool(match.complaints),
                "believed": record.decision.matched and not record.ambiguous,
                "step_wrong": is_wrong(*lengths(off)) and not record.degenerate,
                "-inlier_ratio": math.inf if failed else -match.result.fitness,
                "rmse": math.inf if failed else match.record.rmse,
                "-agreement": -match.record.agreement,
                "seen_through": math.inf if failed else np.nan_to_num(match.record.seen_through),
                "prior_shift": shift if prior is not None and not failed else 0.0,
                "prior_turn": turn if prior is not None and not failed else 0.0,
            }


def column(found: list[Row], name: str) -> Any:
    """One quantity of all rows."""
    return np.array([row[name] for row in found])


def best_limit(values: FloatArray, wrong: BoolArray) -> float:
    """The limit with the most recall at `FALSE_ALARMS`: an alarm beyond it."""
    return float(np.quantile(values[~wrong], 1.0 - FALSE_ALARMS, method="higher"))


def rates(alarm: BoolArray, wrong: BoolArray) -> str:
    """Recall, false alarms, and how many were wrong."""
    recall = 100.0 * alarm[wrong].mean() if wrong.any() else math.nan
    return f"{recall:5.0f} /{100.0 * alarm[~wrong].mean():5.1f} % ({wrong.sum():3})"


def print_limits(found: list[Row]) -> None:
    """Each quantity: its limits by the other logs, and what they do on the log left out."""
    names = list(dict.fromkeys(column(found, "log")))
    print(f"{'quantity':14} {'limit':>13}" + "".join(f"{kind:>21}" for kind in GUESSES))
    for quantity in QUANTITIES:
        limits, alarm = [], np.zeros(len(found), dtype=bool)
        values, wrong = column(found, quantity), column(found, "wrong")
        for name in names:
            left_out = column(found, "log") == name
            limits.append(best_limit(values[~left_out], wrong[~left_out]))
            alarm[left_out] = values[left_out] > limits[-1]
        words = [f"{quantity:14} {min(limits):6.3f}..{max(limits):6.3f}"]
        for kind in GUESSES:
            chosen = column(found, "guess") == kind
            words.append(rates(alarm[chosen], wrong[chosen]))
        print(" ".join(words))


def print_steps(found: list[Row]) -> None:
    """The checks of the first match, and the whole step, log by log."""
    for title in ("first match", "whole step"):
        print(f"\n{title}: recall / false alarms (wrong first matches)")
        for name in dict.fromkeys(column(found, "log")):
            words = [f"{name:14}"]
            for kind in GUESSES:
                part = [row for row in found if (row["log"], row["guess"]) == (name, kind)]
                wrong, alarm = column(part, "wrong"), column(part, "alarm")
                if title == "whole step":
                    refused = ~column(part, "believed")
                    caught = refused | ~column(part, "step_wrong")
                    alarm = np.where(wrong, caught, refused)
                words.append(rates(alarm, wrong))
            print(*words)


def main() -> int:
    """Match the pairs and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+", metavar="LOG|FOLDER")
    parser.add_argument("--stride", type=int, default=1, help="take every so many-th pair of a log")
    args = parser.parse_args()
    found = []
    for log, reference, _ in logs_in(args.logs):
        if reference is None:
            print(f"{log.name} has no reference", file=sys.stderr)
        else:
            found += rows(log, reference, args.stride)
    print_limits(found)
    print_steps(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
