"""What surrounds the loop in one match, part by part: two new scans, a new target, the result.

``python tests/bench/around.py [--matches K]`` matches two scans of the simulated room again and
again, each time from their ranges on, with the odometry's matcher, and prints microseconds of each
part. It takes the lower quartile, which a busy machine disturbs least.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy loads

import argparse
import sys
import time

import numpy as np

from labkit import ACCURATE, Scan, Target, icp, transform
from labkit.icp import run
from labkit.result import IcpResult
from labkit.simulation import Lidar, cast, room
from labkit.support.arrays import FloatArray

BEAMS = (180, 360)
MOTION = transform(0.1, 0.05, 0.05)
PARTS = ("newer scan", "older scan", "target", "grid", "normals", "the loop", "result")


def match_in_parts(newer: Scan, older: Scan) -> list[float]:
    """Times [s] before the first part of a match and after each of `PARTS`."""
    times = [time.perf_counter()]
    source = Scan.from_ranges(newer.ranges, newer.angles)
    times.append(time.perf_counter())
    scan = Scan.from_ranges(older.ranges, older.angles)
    times.append(time.perf_counter())
    target = Target(scan)
    times.append(time.perf_counter())
    grid = target.search.grid
    times.append(time.perf_counter())
    normals = target.normals
    times.append(time.perf_counter())
    poses, coarse_poses, termination = run(source.points, grid, normals, np.eye(3), ACCURATE)
    times.append(time.perf_counter())
    IcpResult(
        poses=poses,
        coarse_poses=coarse_poses,
        termination=termination,
        source=source,
        target=target,
        parameters=ACCURATE,
    )
    times.append(time.perf_counter())
    return times


def match_whole(newer: Scan, older: Scan) -> float:
    """Time [s] of the same in one call of `icp`."""
    began = time.perf_counter()
    target = Target(Scan.from_ranges(older.ranges, older.angles))
    icp(Scan.from_ranges(newer.ranges, newer.angles), target, None, ACCURATE)
    return time.perf_counter() - began


def measure(beams: int, matches: int) -> FloatArray:
    """Microseconds of each of `PARTS`, of their sum, of what surrounds the loop, and of a match."""
    lidar = Lidar(beam_count=beams)
    older = cast(room(), np.eye(3), lidar, rng=0)
    newer = cast(room(), MOTION, lidar, rng=1)
    match_whole(newer, older)  # compiles
    parts = np.diff([match_in_parts(newer, older) for _ in range(matches)], axis=1)
    whole = [match_whole(newer, older) for _ in range(matches)]
    around = parts.sum(axis=1) - parts[:, PARTS.index("the loop")]
    columns = np.column_stack([parts, parts.sum(axis=1), around, whole])
    return np.asarray(1e6 * np.percentile(columns, 25.0, axis=0))


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--matches", type=int, default=3_000, metavar="K")
    args = parser.parse_args()
    columns = [measure(beams, args.matches) for beams in BEAMS]
    print(f"{'[µs]':20}" + "".join(f"{beams:>6} beams" for beams in BEAMS))
    names = (*PARTS, "sum", "sum without loop", "one call of icp")
    for name, *values in zip(names, *columns, strict=True):
        print(f"{name:20}" + "".join(f"{value:12.1f}" for value in values))
    return 0


if __name__ == "__main__":
    sys.exit(main())
