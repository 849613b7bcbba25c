"""The trajectory, its map, its reference and its two ends."""

import numpy as np
import pytest

from labkit.plotting import map_points, plot_trajectory
from labkit.scan import Scan
from labkit.se2 import apply, from_xytheta

POSES = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.5], [3.0, 4.0, 1.0]])
SCANS = [Scan.from_points([[1.0, k], [2.0, k]]) for k in range(3)]


@pytest.mark.parametrize("others", [(), (SCANS, POSES + 0.1)])
def test_the_line_is_the_trajectory_and_the_map_is_pixels(ax, labels, others):
    assert plot_trajectory(ax, POSES, *others) is ax
    lines = {line.get_label(): line for line in ax.lines}
    np.testing.assert_array_equal(lines["estimate"].get_xydata(), POSES[:, :2])
    np.testing.assert_array_equal(lines["start"].get_xydata(), POSES[:1, :2])
    np.testing.assert_array_equal(lines["end"].get_xydata(), POSES[-1:, :2])
    found = labels(ax)
    if others:
        np.testing.assert_array_equal(ax.lines[0].get_xydata(), map_points(POSES, SCANS))
        assert ax.lines[0].get_rasterized()
        np.testing.assert_array_equal(lines["reference"].get_xydata(), POSES[:, :2] + 0.1)
        assert (found.pop(0), found.pop()) == ("reference", "map")
    assert found == ["estimate", "start", "end"]


EMPTY = Scan.from_ranges([np.inf], [0.0])


def test_the_map_is_each_scan_at_its_pose():
    scans = [SCANS[0], EMPTY, SCANS[2]]
    expected = [apply(from_xytheta(POSES[k]), scans[k].points) for k in (0, 2)]
    np.testing.assert_allclose(map_points(POSES, scans), np.vstack(expected), atol=1e-12)


def test_far_points_are_left_out():
    scan = Scan.from_points([[1.0, 0.0], [0.0, 3.0], [9.0, 0.0]])
    assert map_points([[100.0, 0.0, 0.0]], [scan], range_max=3.0).tolist() == [
        [101.0, 0.0],
        [100.0, 3.0],
    ]


def test_a_far_return_does_not_stretch_the_picture_and_all_paths_are_in_it(ax):
    room = np.random.default_rng(0).uniform(-3.0, 3.0, (2000, 2))
    scan = Scan.from_points(np.vstack([room, [[500.0, -400.0]]]))
    plot_trajectory(ax, [[0.0, 0.0, 0.0]], [scan], wheels=[[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    assert 9.0 < ax.get_xlim()[1] < 11.0
    assert -5.0 < ax.get_ylim()[0] < -2.9


@pytest.mark.parametrize(("length", "corners"), [(0.0, 0), (0.1, 1), (2.0, 0)])
def test_a_path_that_its_marks_would_hide_is_enlarged(ax, length, corners):
    scan = Scan.from_points([[-3.0, -3.0], [3.0, 3.0]])
    plot_trajectory(ax, [[0.0, 0.0, 0.0], [length, 0.0, 0.0]], [scan, scan])
    assert len(ax.child_axes) == corners
