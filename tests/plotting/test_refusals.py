"""What cannot be drawn is refused, with the value that was received, and nothing is drawn."""

import numpy as np
import pytest

from labkit.plotting import book_figure, map_points, plot_covariance, plot_trajectory
from labkit.scan import Scan
from labkit.support.errors import InvalidParameterError, InvalidPointsError

POINTS = np.array([[0.0, 1.0], [2.0, 1.0], [2.0, 3.0]])
POSES = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.5], [3.0, 4.0, 1.0]])
SCANS = [Scan.from_points(POINTS)] * 3


@pytest.mark.parametrize(
    ("plot", "arguments", "message"),
    [
        (plot_trajectory, (POSES, SCANS[:2]), "must be one to one, got 2 scans and 3 poses"),
        (plot_trajectory, (POSES, None, [[0, 0, np.inf]]), "`reference` must be finite"),
        (plot_covariance, (POINTS[0], np.eye(3)), "shape .2, 2., got .* take a block"),
        (plot_covariance, (POINTS[0], np.diag([1, np.nan])), "must be finite and of shape"),
        (plot_covariance, (POINTS[0], [[1.0, 0.5], [0.0, 1.0]]), "symmetric and positive"),
        (plot_covariance, (POINTS[0], [[1.0, 2.0], [2.0, 1.0]]), "symmetric and positive"),
        (plot_covariance, (POSES[0], np.eye(2)), r"`mean` must be 2 finite numbers \(x, y\)"),
    ],
)
def test_what_cannot_be_drawn(ax, plot, arguments, message):
    with pytest.raises(InvalidPointsError, match=message):
        plot(ax, *arguments)
    assert not ax.has_data()


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        (POSES[:0], "`poses` needs at least 1 pose, got 0"),
        (POSES * np.nan, r"`poses` must be finite, got \[nan, nan, nan\] at index 0"),
    ],
)
def test_what_makes_no_map(poses, message):
    with pytest.raises(InvalidPointsError, match=message):
        map_points(poses, SCANS[: len(poses)])


@pytest.mark.parametrize("height", [0.0, 51.0])
def test_a_figure_needs_a_height(height):
    with pytest.raises(InvalidParameterError, match=r"`height` must be in \(0, 50\] in, got"):
        book_figure(height)
