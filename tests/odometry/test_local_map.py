"""The map: which scans make it up, where they lie in it, and what it is good for."""

import math

import numpy as np
import pytest

from labkit import Scan, Target
from labkit.errors import InvalidParameterError
from labkit.odometry import MapParameters, OdometryParameters, estimate_odometry, integrate
from labkit.odometry.local_map import LocalMap, first_of_each_cell
from labkit.se2 import apply, from_xytheta, invert
from labkit.simulation import Lidar, WheelNoise, room, scan_along, wheel_increments

STEP = np.array([0.2, 0.05, math.radians(7.0)])
TRUTH = integrate([STEP] * 9, start=[-0.5, -0.3, 0.2])
SCANS = scan_along(room(), TRUTH, Lidar(noise_std=0.0), rng=0)
EVERY_SCAN = MapParameters(key_scans=4, key_distance=0.0, map_cell=0.0)
EMPTY = Scan.from_ranges([math.inf], [0.0])


def driven(parameters, scans=SCANS, *, matched=True):
    seen = LocalMap(parameters)
    for k, scan in enumerate(scans):
        seen.add(scan, STEP if k else np.zeros(3), matched=matched)
    return seen


def test_the_map_holds_the_last_key_scans_where_they_were_taken():
    """With the true motions, every point lies where its scan saw it from the newest one."""
    seen = driven(EVERY_SCAN)
    T_world = from_xytheta(TRUTH)
    T_newest = [invert(T_world[-1]) @ T_world[k] for k in range(6, 10)]
    expected = [apply(T, SCANS[k].points) for T, k in zip(T_newest, range(6, 10), strict=True)]
    np.testing.assert_allclose(seen.target.points, np.vstack(expected), atol=1e-12)
    np.testing.assert_array_equal(seen.T_target_last, np.eye(3))


def test_each_point_keeps_the_normal_that_its_own_scan_gave():
    turns = [from_xytheta(-(9 - k) * STEP * [0.0, 0.0, 1.0])[:2, :2] for k in range(6, 10)]
    own = [Target(SCANS[k]).normals @ R.T for R, k in zip(turns, range(6, 10), strict=True)]
    np.testing.assert_allclose(driven(EVERY_SCAN).target.normals, np.vstack(own), atol=1e-12)


@pytest.mark.parametrize(
    ("parameters", "keys"),
    [
        (MapParameters(map_cell=0.0, key_distance=0.0), [0, 1, 2, 3, 4]),
        (MapParameters(map_cell=0.0, key_distance=0.3, key_rotation=9.0), [0, 2, 4]),
        (MapParameters(map_cell=0.0, key_distance=9.0, key_rotation=9.0), [0]),
        (MapParameters(map_cell=0.0, key_distance=9.0, key_rotation=math.radians(10)), [0, 2, 4]),
    ],
)
def test_a_key_scan_is_far_from_the_last_one(parameters, keys):
    seen = driven(parameters, SCANS[:5])
    assert len(seen.target.points) == sum(len(SCANS[k]) for k in keys)
    since = np.array([STEP] * (4 - keys[-1])).reshape(-1, 3)
    np.testing.assert_allclose(seen.T_target_last, from_xytheta(integrate(since)[-1]), atol=1e-12)


def test_a_scan_that_was_not_matched_is_a_key_scan():
    parameters = MapParameters(key_distance=9.0, key_rotation=9.0)
    one, two = (len(driven(parameters, SCANS[:n], matched=False).target.points) for n in (1, 2))
    assert two > one == len(driven(parameters, SCANS[:2]).target.points)


def test_a_scan_without_points_moves_the_robot_and_leaves_the_map():
    seen = driven(EVERY_SCAN, [*SCANS[:3], EMPTY])
    assert len(seen.target.points) == sum(len(scan) for scan in SCANS[:3])
    np.testing.assert_allclose(seen.T_target_last, from_xytheta(STEP), atol=1e-12)
    assert driven(EVERY_SCAN, [EMPTY]).target is None


def test_one_point_a_cell():
    points = np.array([[0.01, 0.01], [0.04, 0.04], [-0.01, 0.01], [0.06, 0.01]])
    np.testing.assert_array_equal(first_of_each_cell(points, 0.05), [True, False, True, True])
    np.testing.assert_array_equal(first_of_each_cell(points, 0.0), [True] * 4)
    assert first_of_each_cell(np.empty((0, 2)), 0.05).shape == (0,)


def test_a_map_drifts_less_than_scans():
    """Round the room on wheels that are 10 % off, as over the logs."""
    lidar, circle = Lidar(beam_count=181), integrate([[0.1, 0.0, 0.1]] * 60, start=[0.0, -1.0, 0.0])
    scans = scan_along(room(), circle, lidar, rng=1)
    wheels = wheel_increments(circle, WheelNoise(along=0.1, turn=0.1), rng=1)
    errors = {
        against: np.abs(
            estimate_odometry(
                scans, wheels, OdometryParameters(against=against), start=circle[0]
            ).poses
            - circle
        )[-1, :2].max()
        for against in ("scan", "map")
    }
    assert errors["map"] < 0.5 * errors["scan"]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("key_scans", 0),
        ("key_distance", -0.1),
        ("key_rotation", math.nan),
        ("map_cell", -1.0),
    ],
)
def test_bad_map_parameters(name, value):
    with pytest.raises(InvalidParameterError, match=f"`{name}` must be"):
        MapParameters(**{name: value})
