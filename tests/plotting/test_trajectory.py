"""The trajectory, its map, its reference and its two ends."""

import numpy as np

from labkit.plotting import map_points, plot_trajectory
from labkit.scan import Scan
from labkit.se2 import apply, from_xytheta

POSES = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.5], [3.0, 4.0, 1.0]])
SCANS = [Scan.from_points([[1.0, k], [2.0, k]]) for k in range(3)]


def by_label(ax):
    return {line.get_label(): line for line in ax.lines}


def test_the_line_is_the_trajectory(ax, labels):
    assert plot_trajectory(ax, POSES) is ax
    lines = by_label(ax)
    np.testing.assert_array_equal(lines["estimate"].get_xydata(), POSES[:, :2])
    np.testing.assert_array_equal(lines["start"].get_xydata(), POSES[:1, :2])
    np.testing.assert_array_equal(lines["end"].get_xydata(), POSES[-1:, :2])
    assert labels(ax) == ["estimate", "start", "end"]


def test_map_and_reference_are_drawn_point_for_point_the_map_as_pixels(ax, labels):
    reference = POSES + 0.1
    plot_trajectory(ax, POSES, SCANS, reference)
    np.testing.assert_array_equal(ax.lines[0].get_xydata(), map_points(POSES, SCANS))
    assert ax.lines[0].get_rasterized()
    np.testing.assert_array_equal(by_label(ax)["reference"].get_xydata(), reference[:, :2])
    assert labels(ax) == ["reference", "estimate", "start", "end", "map"]


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
