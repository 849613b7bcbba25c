"""Wheels as a robot's owner has them: poses of the robot, or a table with titles."""

import numpy as np
import pytest

from labkit import Scan
from labkit.odometry import estimate_odometry, increments_between, integrate
from labkit.scan import scanner_poses
from labkit.simulation import Lidar, room, scan_along
from labkit.support.errors import InvalidParameterError


def test_wheels_of_the_robot_and_the_place_of_the_scanner_are_those_of_the_scanner():
    path = np.column_stack([0.1 * np.arange(6), np.zeros(6), 0.2 * np.arange(6)])
    offset = (0.3, -0.1, 0.5)
    scans = scan_along(room(), scanner_poses(path, offset), Lidar(), rng=0)
    of_robot = estimate_odometry(scans, path, laser_offset=offset)
    of_scanner = estimate_odometry(scans, scanner_poses(path, offset))
    np.testing.assert_allclose(of_robot.poses, of_scanner.poses, atol=1e-9)
    with pytest.raises(InvalidParameterError, match="`laser_offset` moves `priors`, and there are"):
        estimate_odometry(scans, laser_offset=offset)


def test_a_table_of_poses_is_read_by_the_titles_of_its_columns():
    pandas = pytest.importorskip("pandas")
    poses = np.array([[1.0, 2.0, 0.1], [3.0, 4.0, 0.2]])
    table = pandas.DataFrame(poses[:, [2, 1, 0]], columns=["theta", "y", "x"])
    np.testing.assert_allclose(integrate(increments_between(table), poses[0]), poses)
    points = pandas.DataFrame({"y": [2.0], "x": [1.0]})
    assert Scan.from_points(points).points.tolist() == [[1.0, 2.0]]
