"""The trajectory, its map, its reference and its two ends."""

import numpy as np
import pytest

from labkit.plotting import map_points, plot_trajectory
from labkit.scan import Scan
from labkit.se2 import apply, from_xytheta

POSES = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.5], [3.0, 4.0, 1.0]])
SCANS = [Scan.from_points([[1.0, k], [2.0, k]]) for k in range(3)]


def lines_by_label(ax):
    return {line.get_label(): line for line in ax.lines}


def test_a_trajectory_is_a_line_with_two_ends(ax, labels):
    assert plot_trajectory(ax, POSES) is ax

    lines = lines_by_label(ax)
    np.testing.assert_array_equal(lines["estimate"].get_xydata(), POSES[:, :2])
    np.testing.assert_array_equal(lines["start"].get_xydata(), POSES[:1, :2])
    np.testing.assert_array_equal(lines["end"].get_xydata(), POSES[-1:, :2])
    assert labels(ax) == ["estimate", "start", "end"]


def test_a_map_is_pixels_and_a_reference_a_line(ax, labels):
    plot_trajectory(ax, POSES, SCANS, POSES + 0.1)

    pixels = ax.lines[0]
    np.testing.assert_array_equal(pixels.get_xydata(), map_points(POSES, SCANS))
    assert pixels.get_rasterized()
    reference = lines_by_label(ax)["reference"]
    np.testing.assert_array_equal(reference.get_xydata(), POSES[:, :2] + 0.1)
    assert labels(ax) == ["reference", "estimate", "start", "end", "map"]


@pytest.mark.parametrize(
    ("poses", "title"),
    [
        (POSES, "Trajectory: 3 poses, 7.0 m"),
        (POSES[:1], "Trajectory: 1 pose, 0.0 m"),
        (500.0 * POSES, "Trajectory: 3 poses, 3.50 km"),
    ],
)
def test_the_title_tells_the_length(ax, poses, title):
    plot_trajectory(ax, poses)
    assert ax.get_title() == title


def test_the_map_is_each_scan_at_its_pose():
    without_points = Scan.from_ranges([np.inf], [0.0])
    scans = [SCANS[0], without_points, SCANS[2]]

    points = map_points(POSES, scans)

    expected = [apply(from_xytheta(POSES[k]), scans[k].points) for k in (0, 2)]
    np.testing.assert_allclose(points, np.vstack(expected), atol=1e-12)


def test_far_points_are_left_out():
    scan = Scan.from_points([[1.0, 0.0], [0.0, 3.0], [9.0, 0.0]])
    points = map_points([[100.0, 0.0, 0.0]], [scan], range_max=3.0)
    assert points.tolist() == [[101.0, 0.0], [100.0, 3.0]]


def test_a_far_return_does_not_stretch_the_picture(ax):
    room = np.random.default_rng(0).uniform(-3.0, 3.0, (2000, 2))
    scan = Scan.from_points(np.vstack([room, [[500.0, -400.0]]]))

    plot_trajectory(ax, POSES[:1], [scan])

    assert 2.9 < ax.get_xlim()[1] < 4.0
    assert -4.0 < ax.get_ylim()[0] < -2.9


def test_all_paths_are_in_the_picture(ax):
    plot_trajectory(ax, POSES, SCANS, reference=POSES - [7.0, 0.0, 0.0], wheels=POSES + 9.0)

    assert -9.0 < ax.get_xlim()[0] < -7.0
    assert 12.0 < ax.get_xlim()[1] < 14.0
    assert 13.0 < ax.get_ylim()[1] < 15.0


@pytest.mark.parametrize(("length", "insets"), [(0.0, 0), (0.1, 1), (2.0, 0)])
def test_a_path_that_its_marks_would_hide_is_enlarged(ax, length, insets):
    scan = Scan.from_points([[-3.0, -3.0], [3.0, 3.0]])
    plot_trajectory(ax, [[0.0, 0.0, 0.0], [length, 0.0, 0.0]], [scan, scan])
    assert len(ax.child_axes) == insets


def test_the_enlarged_path_hides_no_wall(ax):
    walls = np.random.default_rng(0).uniform(-3.0, 3.0, (2000, 2))
    plot_trajectory(ax, [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], [Scan.from_points(walls)] * 2)

    (inset,) = ax.child_axes
    ax.figure.canvas.draw()
    bottom = inset.get_window_extent().y0
    assert (ax.transData.transform(walls)[:, 1] < bottom).mean() > 0.999


def test_a_long_run_is_drawn_by_every_nth_scan(ax, monkeypatch):
    monkeypatch.setattr("labkit.plotting.trajectory.MOST_POINTS", 3)
    scans = [Scan.from_points([[float(k), 0.0]]) for k in range(7)]

    plot_trajectory(ax, np.zeros((7, 3)), scans)

    (pixels,) = (line for line in ax.get_lines() if line.get_marker() == ",")
    assert pixels.get_xdata().tolist() == [0.0, 3.0, 6.0]
