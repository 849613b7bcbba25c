"""More points, more knowledge: the error falls with density, and lies where the covariance says.

`tests/bench/density.py` prints the whole table; a corner of it holds the law here.
"""

import contextlib

import numpy as np
import pytest

from labkit import ACCURATE, IcpParameters, Scan, Target, icp
from labkit.covariance import censi_information
from labkit.normals import estimate_normals
from labkit.se2 import transform
from labkit.simulation import Lidar, World, cast, doorways, room
from labkit.simulation.world import circle, polyline
from labkit.support.errors import DegenerateAlignmentError

PILLARS = [circle(place, 0.3, 96) for place in ((1.5, 1.0), (-1.5, 0.8), (0.5, -1.2), (-0.9, -1.0))]
CLOSET = polyline(np.array([[0.6, 0.6], [-0.5, 0.6], [-0.5, -0.5], [0.6, -0.5], [0.6, 0.6]]))
PLACES = {
    "room": room(),
    "pillars": World(segments=np.vstack([room().segments, *PILLARS])),
    "closet": World(segments=CLOSET),
}
MOTIONS = [(0.05 + 0.1 * (k % 3), -0.02 - 0.05 * (k % 4), 0.01 + 0.05 * (k % 5)) for k in range(8)]


def look(motion, count, noise, kind, rng, place="room"):
    """A sweep of the place, or as many points of sweeps that lie on one another.

    Those have at most 1,000 beams, or 180 in the kind "few"; in the kind "given", the points are a
    target with the normals of each sweep.
    """
    beams = {"sweep": count, "few": 180}.get(kind, min(count, 1_000))
    lidar = Lidar(beam_count=beams, noise_std=noise)
    scans = [cast(PLACES[place], transform(*motion), lidar, rng=rng) for _ in range(count // beams)]
    if kind == "sweep":
        return scans[0]
    points = np.vstack([scan.points for scan in scans])
    if kind == "given":
        return Target(points, np.vstack([estimate_normals(scan) for scan in scans]))
    return Scan.from_points(rng.permutation(points))


def errors_and_nees(count, noise, kind, parameters, place="room", told=None):
    """The distances [m] by which eight matches are off, and their NEES.

    Their covariance is told the noise, or another `range_std` [m].
    """
    range_std = noise if told is None else told
    source_kind = "bare" if kind == "given" else kind
    distances, nees = [], []
    for seed, motion in enumerate(MOTIONS):
        rng = np.random.default_rng(seed)
        target = look((0.0, 0.0, 0.0), count, noise, kind, rng, place)
        source = look(motion, count, noise, source_kind, rng, place)
        result = icp(source, target, None, parameters)
        error = result.xytheta - np.array(motion)
        distances.append(np.hypot(error[0], error[1]))
        nees.append(error @ np.linalg.solve(result.covariance(range_std), error))
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
@pytest.mark.parametrize("noise", [0.003, 0.01, 0.05])
@pytest.mark.parametrize("count", [180, 1_000, 5_000, 20_000])
def test_the_motion_lies_where_the_covariance_says(count, noise, kind):
    """The mean NEES of three numbers is 3, with a standard deviation of 0.9 for eight matches.

    It is less where the loop ends before its minimum by more than the noise asks for.
    """
    _, nees = errors_and_nees(count, noise, kind, ACCURATE)

    assert 0.3 < np.mean(nees) < 9.0


@pytest.mark.parametrize(
    ("count", "noise", "kind", "parameters", "place"),
    [
        (1_800, 0.003, "few", ACCURATE, "room"),
        (18_000, 0.01, "few", IcpParameters(), "room"),
        (5_000, 0.003, "given", ACCURATE, "room"),
        (20_000, 0.02, "given", ACCURATE, "room"),
        (20_000, 0.01, "sweep", ACCURATE, "pillars"),
        (5_000, 0.05, "sweep", IcpParameters(), "room"),
    ],
    ids=["few beams", "few beams, points", "given", "given, loud", "pillars", "loud, points"],
)
def test_a_match_is_no_surer_than_it_is_right(count, noise, kind, parameters, place):
    _, nees = errors_and_nees(count, noise, kind, parameters, place)

    assert np.mean(nees) < 9.0


@pytest.mark.parametrize("count", [1_000, 5_000])
@pytest.mark.parametrize("kind", ["sweep", "bare"])
def test_a_closet_with_loud_ranges_is_matched_by_its_walls(count, kind):
    """Noise of 5 cm, walls of 1.1 m: points in such a cloud have partners wherever they lie.

    The covariance is told 1 cm.
    """
    distances, nees = errors_and_nees(count, 0.05, kind, ACCURATE, "closet", told=0.01)

    assert np.median(distances) < 0.03
    assert np.mean(nees) < 27.0


@pytest.mark.parametrize("count", [180, 1_000, 5_000])
@pytest.mark.parametrize("noise", [0.003, 0.01, 0.05])
@pytest.mark.parametrize("kind", ["sweep", "bare"])
def test_a_target_shows_the_noise_of_its_ranges(count, noise, kind):
    target = Target(look((0.0, 0.0, 0.0), count, noise, kind, np.random.default_rng(0)))

    assert 0.75 < target.noise / noise < 1.25


@pytest.mark.parametrize("parameters", [ACCURATE, IcpParameters()], ids=["lines", "points"])
def test_surfaces_too_short_for_their_noise_promise_nothing(parameters):
    """Doors with 5 cm of noise: a match errs by at most three standard deviations, or has none."""
    lidar = Lidar(beam_count=541, noise_std=0.05)
    motion = np.array([0.03, -0.02, 0.01])
    nees = []

    for seed in range(12):
        rng = np.random.default_rng(seed)
        place = transform(0.0, 0.1, 0.5 * seed)
        poses = place, place @ transform(*motion)
        target, source = (cast(doorways(), pose, lidar, rng=rng) for pose in poses)
        result = icp(source, target, None, parameters)
        information = np.zeros((3, 3))  # where a covariance is refused
        with contextlib.suppress(DegenerateAlignmentError):
            information = censi_information(result, 0.05)
        error = result.xytheta - motion
        nees.append(error @ information @ error)

    assert 0.0 < np.max(nees) < 27.0
