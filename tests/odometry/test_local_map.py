"""The map: which scans make it up, where they lie in it, and what it is good for."""

import math

import numpy as np
import pytest

from labkit import Scan, Target
from labkit.odometry import LessonOdometry, MapOdometry, estimate_odometry, integrate
from labkit.odometry.local_map import LocalMap
from labkit.se2 import apply, from_xytheta, invert
from labkit.simulation import Lidar, WheelNoise, room, scan_along, wheel_increments

STEP = np.array([0.2, 0.05, math.radians(7.0)])
TRUTH = integrate([STEP] * 9, start=[-0.5, -0.3, 0.2])
SCANS = scan_along(room(), TRUTH, Lidar(noise_std=0.0), rng=0)


@pytest.fixture
def limits(monkeypatch):
    """The map's own numbers, given by name; without thinning, unless `MAP_CELL` is among them."""

    def change(**values):
        for name, value in ({"MAP_CELL": 1e-9} | values).items():
            monkeypatch.setattr(f"labkit.odometry.local_map.{name}", value)

    return change


def driven(scans=SCANS, *, matched=True):
    seen = LocalMap()
    for k, scan in enumerate(scans):
        seen = seen.follow(STEP * (k > 0)).add(Target(scan), matched=matched)
    return seen


def test_the_map_holds_the_last_key_scans_where_they_were_taken(limits):
    """With the true motions, every point lies where its scan saw it from the newest one."""
    limits(KEY_SCANS=4, KEY_MOTION=(0.0, 9.0))
    seen = driven(SCANS[:4])
    T_world = from_xytheta(TRUTH)
    T_newest = [invert(T_world[3]) @ T_world[k] for k in range(4)]
    expected = [apply(T, SCANS[k].points) for k, T in enumerate(T_newest)]
    np.testing.assert_allclose(seen.target.points, np.vstack(expected), atol=1e-12)
    np.testing.assert_array_equal(seen.T_target_last, np.eye(3))
    own = [Target(SCANS[k]).normals @ T[:2, :2].T for k, T in enumerate(T_newest)]
    np.testing.assert_allclose(seen.target.normals, np.vstack(own), atol=1e-12)


@pytest.mark.parametrize(
    ("distance", "rotation", "keys"),
    [
        (0.0, 9.0, [0, 1, 2, 3, 4]),
        (0.3, 9.0, [0, 2, 4]),
        (9.0, 9.0, [0]),
        (9.0, math.radians(10), [0, 2, 4]),
    ],
)
def test_a_key_scan_is_far_from_the_last_one(limits, distance, rotation, keys):
    limits(KEY_MOTION=(distance, rotation))
    seen = driven(SCANS[:5])
    assert len(seen.target.points) == sum(len(SCANS[k]) for k in keys)
    since = np.array([STEP] * (4 - keys[-1])).reshape(-1, 3)
    np.testing.assert_allclose(seen.T_target_last, from_xytheta(integrate(since)[-1]), atol=1e-12)


def test_a_scan_that_was_not_matched_is_a_key_scan(limits):
    limits(KEY_MOTION=(9.0, 9.0))
    one, two = (len(driven(SCANS[:n], matched=False).target.points) for n in (1, 2))
    assert two > one == len(driven(SCANS[:2]).target.points)


def test_a_key_scan_keeps_the_first_point_of_each_cell():
    points = np.array([[0.01, 0.01], [0.04, 0.04], [-0.01, 0.01], [0.06, 0.01]])
    kept = driven([Scan.from_points(points)]).target.points
    np.testing.assert_array_equal(kept, points[[0, 2, 3]])


def test_a_map_drifts_less_than_scans():
    """Round the room on wheels that are 10 % off, as over the logs."""
    lidar, circle = Lidar(beam_count=181), integrate([[0.1, 0.0, 0.1]] * 60, start=[0.0, -1.0, 0.0])
    scans = scan_along(room(), circle, lidar, rng=1)
    wheels = wheel_increments(circle, WheelNoise(along=0.1, turn=0.1), rng=1)
    errors = {}
    for estimator in (LessonOdometry, MapOdometry):
        run = estimate_odometry(scans, wheels, estimator=estimator, start=circle[0])
        errors[estimator] = np.abs(run.poses - circle)[-1, :2].max()
    assert errors[MapOdometry] < 0.5 * errors[LessonOdometry]
