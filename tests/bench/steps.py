"""What a step of the odometry costs, and whether its memory stays, on a drive of any length.

``python tests/bench/steps.py [--steps K] [--beams N] [--wheels-only]`` drives a robot in rounds
through the simulated room and hands its scans to `LessonOdometry` and `MapOdometry` one by one,
with wheels and without. Without wheels a search is part of every step of the latter. It prints the
median processor time of a step (there is one thread, so that other programs hardly count), and the
memory early in the drive and at its end.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import math
import sys
import time
from itertools import cycle, islice, product

import numpy as np
from tqdm import tqdm

from labkit.odometry import LessonOdometry, MapOdometry
from labkit.scan import Scan
from labkit.simulation import Lidar, WheelNoise, room, scan_along, wheel_increments
from labkit.support.arrays import FloatArray

ROUND = 120  # steps: 0.1 m and 3° each
ESTIMATORS = {"scan": LessonOdometry, "map": MapOdometry}
WAYS = tuple(product(ESTIMATORS, (True, False)))
SETTLED = 500  # steps after which the memory should grow no more


def drive(beams: int) -> tuple[list[Scan], FloatArray]:
    """The scans of one round and what the wheels say of its steps, the last one to its start."""
    turn = np.linspace(0.0, 2.0 * math.pi, ROUND + 1)
    poses = np.column_stack([2.4 * np.cos(turn), 1.4 * np.sin(turn), turn + 0.5 * math.pi])
    lidar = Lidar(beam_count=beams, field_of_view=2.0 * math.pi)
    return scan_along(room(), poses[:-1], lidar, rng=0), wheel_increments(
        poses, WheelNoise(), rng=0
    )


def memory() -> float:
    """What this process holds now [MB]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def measure(against: str, wheels: bool, steps: int, beams: int) -> str:
    """One line of the table."""
    scans, increments = drive(beams)
    priors = np.roll(increments, 1, axis=0) if wheels else [None] * ROUND
    odometry = ESTIMATORS[against]()
    times, early = [], math.nan
    pairs = islice(cycle(zip(scans, priors, strict=True)), steps)
    for k, (scan, prior) in enumerate(tqdm(pairs, against, steps, leave=False, disable=None)):
        began = time.process_time()
        odometry.update(scan, prior)
        times.append(1e3 * (time.process_time() - began))
        early = memory() if k == SETTLED else early
    by = "wheels" if wheels else "search"
    return f"{against:6}{by:8}{np.median(times):8.2f}{early:12.0f}{memory():8.0f}"


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=2_000, metavar="K")
    parser.add_argument("--beams", type=int, default=360, metavar="N")
    parser.add_argument("--wheels-only", action="store_true", help="leave out those with a search")
    args = parser.parse_args()
    print(f"{args.steps:,} steps, {args.beams} beams: median time of a step [ms], memory [MB]")
    print(f"{'':14}{'a step':>8}{f'at {SETTLED}':>12}{'end':>8}")
    for against, wheels in WAYS:
        if args.wheels_only and not wheels:
            continue
        print(measure(against, wheels, args.steps, args.beams), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
