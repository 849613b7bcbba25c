"""Whether the covariance of a match keeps its word: the mean NEES a degree of freedom, 1 if right.

``python tests/bench/nees.py [--draws N] [--out FILE]`` matches two noisy looks at a room, a corner
and a corridor, at 12 headings, from wheels that are off (0.3 m along the corridor, 3 cm across it
and 0.02 rad), by either metric and with 10 and 30 mm of noise. Without the prior, the error is
weighed by `censi_information`, and the free directions do not count; with it, by what `fuse`
returns. `free` is the share of matches that name a free direction, `worst` the worst heading.
"""

from __future__ import annotations

import argparse
import sys
from itertools import product
from pathlib import Path

import numpy as np

from labkit import IcpParameters, Target, from_xytheta, icp, to_xytheta
from labkit.covariance import censi_information, fuse
from labkit.odometry import OdometryParameters
from labkit.se2 import transform
from labkit.simulation import Lidar, cast, corner, corridor, room
from tables import markdown

PLACES = {
    "room": (room(), np.eye(3)),
    "corner": (corner(), transform(2.0, 2.0, np.radians(-135.0))),
    "corridor": (corridor(), np.eye(3)),
}
METRICS = {"line": OdometryParameters().icp, "point": IcpParameters()}
HEADINGS = 0.1 + np.arange(12) * np.pi / 6.0
MOTION = np.array([0.1, 0.05, np.radians(3.0)])
LOOKS = from_xytheta([np.zeros(3), MOTION])
ALONG, ACROSS, TURN = 0.3, 0.03, 0.02  # standard deviations of the prior [m, m, rad]
HEADER = (
    "place, metric",
    "beams",
    "noise mm",
    "free %",
    "alone",
    "worst",
    "with a prior",
    "worst",
)


def measure(place: str, metric: str, beams: int, noise: float, draws: int) -> list[str]:
    """One row of the table."""
    world, at = PLACES[place]
    rng, lidar = np.random.default_rng(0), Lidar(beam_count=beams, noise_std=noise)
    spread = np.array([ALONG if place == "corridor" else 0.05, ACROSS, TURN])
    alone: list[list[float]] = [[] for _ in HEADINGS]
    fused: list[list[float]] = [[] for _ in HEADINGS]
    free = 0
    for k, heading in enumerate(HEADINGS):
        there, to_scan = at @ transform(0.0, 0.0, heading), transform(0.0, 0.0, -heading)
        P = to_scan @ np.diag(spread**2) @ to_scan.T
        for _ in range(draws):
            looks = [
                cast(world, there @ T, lidar, rng=rng) for T in from_xytheta([0 * MOTION, MOTION])
            ]
            prior = MOTION + to_scan @ rng.normal(0.0, spread)
            result = icp(looks[1], Target(looks[0]), from_xytheta(prior), METRICS[metric])
            error = to_xytheta(result.T_target_source) - MOTION
            information = censi_information(result, noise)
            rank = np.linalg.matrix_rank(information, rtol=1e-9, hermitian=True)
            free += rank < 3
            alone[k].append(error @ information @ error / rank)
            x, C = fuse(result, noise, prior, P)
            fused[k].append((x - MOTION) @ np.linalg.solve(C, x - MOTION) / 3.0)
    cells = [f"{place}, {metric}", f"{beams}", f"{1e3 * noise:.0f}"]
    cells.append(f"{100.0 * free / (draws * len(HEADINGS)):.0f}")
    for values in (alone, fused):
        means = np.mean(values, axis=1)
        cells += [f"{means.mean():.2f}", f"{means.max():.2f}"]
    return cells


def main() -> int:
    """Measure, print each row, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=25, metavar="N", help="at each heading")
    parser.add_argument("--out", metavar="FILE", help="the table in Markdown")
    args = parser.parse_args()
    rows = []
    for each in product(PLACES, METRICS, (180, 541), (0.01, 0.03)):
        rows.append(measure(*each, args.draws))
        print("  ".join(f"{cell:>9}" for cell in rows[-1]), flush=True)
    if args.out:
        Path(args.out).write_text(markdown(HEADER, rows) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
