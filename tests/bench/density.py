"""More points, more knowledge: error and NEES of a match by density, noise, room and metric.

``python tests/bench/density.py [--points N ...] [--draws N] [--out FILE]`` matches two noisy looks
at square rooms, as sweeps and as bare points: shuffled sweeps of at most 1,000 beams, one on the
other. The NEES of three numbers, weighed by `IcpResult.covariance`, is 3 where that is right.
"""

from __future__ import annotations

import argparse
import sys
import time
from itertools import product
from pathlib import Path

import numpy as np

from labkit import ACCURATE, IcpParameters, Scan, icp
from labkit.covariance import censi_information
from labkit.se2 import transform
from labkit.simulation import Lidar, World, cast
from labkit.simulation.world import polyline
from labkit.support.errors import DegenerateAlignmentError
from tables import markdown

METRICS = {"lines": ACCURATE, "points": IcpParameters()}
SWEEP = 1_000  # beams of one of the sweeps that lie on one another
HEADER = ("metric", "kind", "room m", "noise mm", "points", "error mm", "NEES", "converged", "ms")


def square_room(side: float) -> World:
    """A room that the scanner sees from beside its middle."""
    corners = side * np.array([[0.5, 0.575], [-0.5, 0.575], [-0.5, -0.425], [0.5, -0.425]])
    return World(segments=polyline(np.vstack([corners, corners[:1]])))


def look(
    world: World, motion: np.ndarray, points: int, noise: float, kind: str, rng: np.random.Generator
) -> Scan:
    """A sweep of so many beams, or as many bare points."""
    sweeps = 1 if kind == "sweep" else max(1, points // SWEEP)
    lidar = Lidar(beam_count=points // sweeps, noise_std=noise, range_max=100.0)
    scans = [cast(world, transform(*motion), lidar, rng=rng) for _ in range(sweeps)]
    if kind == "sweep":
        return scans[0]
    return Scan.from_points(rng.permutation(np.vstack([scan.points for scan in scans])))


def row(metric: str, kind: str, side: float, noise: float, points: int, draws: int) -> list[str]:
    """One row of the table: medians over the draws, of the NEES the mean."""
    world = square_room(side)
    figures = []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        turn = (0.01 + 0.05 * (seed % 5)) * min(1.0, 4.0 / side)
        motion = np.array([0.05 + 0.1 * (seed % 3), -0.02 - 0.05 * (seed % 4), turn])
        target = look(world, np.zeros(3), points, noise, kind, rng)
        source = look(world, motion, points, noise, kind, rng)
        start = time.process_time()
        result = icp(source, target, None, METRICS[metric])
        seconds = time.process_time() - start
        error = result.xytheta - motion
        try:
            information = censi_information(result)
            nees = (
                error @ information @ error if np.linalg.matrix_rank(information) == 3 else np.nan
            )
        except DegenerateAlignmentError:
            nees = np.nan
        figures.append((1e3 * np.hypot(*error[:2]), nees, result.converged, 1e3 * seconds))
    error_mm, _, _, ms = np.median(figures, axis=0)
    _, nees, converged, _ = np.nanmean(figures, axis=0)
    cells = [metric, kind, f"{side:g}", f"{1e3 * noise:g}", f"{points:,}", f"{error_mm:.2f}"]
    return [*cells, f"{nees:.1f}", f"{100.0 * converged:.0f} %", f"{ms:.1f}"]


def main() -> int:
    """Print the table, row by row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--points", type=int, nargs="*", default=[180, 1_000, 5_000, 20_000, 100_000]
    )
    parser.add_argument("--noise", type=float, nargs="*", default=[0.003, 0.01, 0.03])
    parser.add_argument("--rooms", type=float, nargs="*", default=[4.0, 10.0, 30.0])
    parser.add_argument("--kinds", nargs="*", default=["sweep", "bare"])
    parser.add_argument("--metrics", nargs="*", default=list(METRICS))
    parser.add_argument("--draws", type=int, default=12)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    icp(np.eye(3, 2), np.eye(3, 2), None, ACCURATE)  # compiles
    icp(np.eye(3, 2), np.eye(3, 2))
    rows = []
    for case in product(args.metrics, args.kinds, args.rooms, args.noise, args.points):
        rows.append(row(*case, args.draws))
        print(*rows[-1], sep="  ", flush=True)
    if args.out:
        args.out.write_text(markdown(HEADER, rows) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
