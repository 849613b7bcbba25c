"""What a whole log costs beside its matches alone, and what the difference is made of.

``python tests/bench/whole_log.py`` matches every pair of Killian Court by itself, then runs
the odometry from scan to scan without a search, in one thread and in one for each core;
loading and plotting are left out. With all cores shared and nothing lost, the run would take

    pairs × median time of a match ÷ cores

The lab's aim is 1.5 times that.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from tqdm import tqdm

from data import GATE, Pair
from labkit import from_xytheta, read_log
from labkit.cli.odometry import SIMULATED_WHEELS
from labkit.correspondences import MIN_PAIRS
from labkit.odometry import OdometryParameters, available_cores, estimate_odometry
from labkit.simulation import wheel_increments
from matchers.lab import point_to_line
from tables import whole_log_text

ROUNDS = 5
SCAN_TO_SCAN = OdometryParameters(against="scan", search=False)


def whole_log(cores: int, rounds: int) -> dict[str, Any]:
    """Median times [s] over rounds of all matches, the run alone and the run shared.

    The three take turns, so that they meet the same machine.
    """
    log = read_log("killian")
    assert log.reference is not None
    priors = wheel_increments(log.reference, SIMULATED_WHEELS, rng=0)
    pairs = [
        Pair(source=newer, target=older, T_init=T_init, T_reference=np.eye(3))
        for older, newer, T_init in zip(
            log.scans[:-1], log.scans[1:], from_xytheta(priors), strict=True
        )
        if min(len(older), len(newer)) >= MIN_PAIRS
    ]
    matches, alone, sums = [], [], []
    for _ in tqdm(range(rounds), "whole log", leave=False, disable=None):
        seconds = [_timed(_match, pair.fresh())[0] for pair in pairs]
        matches.append(float(np.median(seconds)))
        sums.append(sum(seconds))
        alone.append(_timed(estimate_odometry, log.scans, priors, SCAN_TO_SCAN)[0])
    return {
        "log": log.name,
        "pairs": len(priors),
        "cores": cores,
        "rounds": rounds,
        "match_ms": 1e3 * float(np.median(matches)),
        "matches_s": float(np.median(sums)),
        "alone_s": float(np.median(alone)),
    }


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=ROUNDS, metavar="R")
    parser.add_argument("--jobs", type=int, default=available_cores(), metavar="N")
    args = parser.parse_args()
    result = whole_log(args.jobs, args.rounds)
    print(whole_log_text(result))
    return 0


def _match(pair: Pair) -> None:
    point_to_line(pair.source, pair.target, pair.T_init, GATE)


def _timed(function: Callable[..., Any], *args: Any, **kwargs: Any) -> tuple[float, Any]:
    began = time.perf_counter()
    result = function(*args, **kwargs)
    return time.perf_counter() - began, result


if __name__ == "__main__":
    sys.exit(main())
