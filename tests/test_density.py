"""More points, more knowledge: the error falls with density, and lies where the covariance says.

`tests/bench/density.py` prints the whole table; a corner of it holds the law here.
"""

import numpy as np
import pytest

from labkit import ACCURATE, IcpParameters, Scan, icp
from labkit.se2 import transform
from labkit.simulation import Lidar, cast, room

MOTIONS = [(0.05 + 0.1 * (k % 3), -0.02 - 0.05 * (k % 4), 0.01 + 0.05 * (k % 5)) for k in range(8)]


def look(motion, count, noise, kind, rng):
    """A sweep of the room, or as many bare points: shuffled sweeps of at most 1,000 beams."""
    sweeps = 1 if kind == "sweep" else max(1, count // 1_000)
    lidar = Lidar(beam_count=count // sweeps, noise_std=noise)
    scans = [cast(room(), transform(*motion), lidar, rng=rng) for _ in range(sweeps)]
    if kind == "sweep":
        return scans[0]
    return Scan.from_points(rng.permutation(np.vstack([scan.points for scan in scans])))


def errors_and_nees(count, noise, kind, parameters):
    """The distances [m] by which eight matches are off, and their NEES."""
    distances, nees = [], []
    for seed, motion in enumerate(MOTIONS):
        rng = np.random.default_rng(seed)
        target = look((0.0, 0.0, 0.0), count, noise, kind, rng)
        source = look(motion, count, noise, kind, rng)
        result = icp(source, target, None, parameters)
        error = result.xytheta - np.array(motion)
        distances.append(np.hypot(error[0], error[1]))
        nees.append(error @ np.linalg.solve(result.covariance(noise), error))
    return np.array(distances), np.array(nees)


@pytest.mark.parametrize(
    ("noise", "parameters"),
    [(0.003, ACCURATE), (0.01, ACCURATE), (0.03, ACCURATE), (0.01, IcpParameters())],
    ids=["lines-3mm", "lines-10mm", "lines-30mm", "points-10mm"],
)
@pytest.mark.parametrize("kind", ["sweep", "bare"])
def test_more_points_never_know_less(noise, kind, parameters):
    few, _ = errors_and_nees(500, noise, kind, parameters)
    more, _ = errors_and_nees(20_000, noise, kind, parameters)

    assert np.median(more) < np.median(few)


@pytest.mark.parametrize("kind", ["sweep", "bare"])
@pytest.mark.parametrize("noise", [0.003, 0.01, 0.03])
@pytest.mark.parametrize("count", [180, 1_000, 20_000])
def test_the_motion_lies_where_the_covariance_says(count, noise, kind):
    """The mean NEES of three numbers is 3, with a standard deviation of 0.9 for eight matches.

    Where neighbours lie one noise apart (5,000 beams with 3 mm of noise here) it is up to 20.
    """
    _, nees = errors_and_nees(count, noise, kind, ACCURATE)

    assert 1.0 < np.mean(nees) < 9.0
