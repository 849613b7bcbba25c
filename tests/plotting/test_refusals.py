"""What cannot be drawn is refused, with the value that was received, and nothing is drawn."""

import numpy as np
import pytest

from labkit import LabkitError
from labkit.plotting import (
    book_figure,
    plot_convergence,
    plot_correspondences,
    plot_covariance,
    plot_observability,
    plot_quality,
    plot_scans,
    plot_trajectory,
)
from labkit.scan import Scan

POINTS = np.array([[0.0, 1.0], [2.0, 1.0]])
POSES = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.5]])
SCAN = Scan.from_points(POINTS)


@pytest.mark.parametrize(
    ("plot", "arguments", "message"),
    [
        (plot_trajectory, (POSES, [SCAN]), "must be one to one, got 1 scans and 2 poses"),
        (plot_trajectory, ([SCAN, SCAN], POSES), "`poses` must hold numbers, got .Scan"),
        (plot_trajectory, (POSES, POSES), "`scans` must be of the class list or tuple, got array"),
        (plot_trajectory, (POSES, [SCAN, POINTS]), r"`scans\[1\]` must be of the class Scan, got"),
        (plot_trajectory, (POSES, None, [[0, 0, np.inf]]), "`reference` must be finite"),
        (plot_covariance, ([0, 0], np.eye(3)), "shape .2, 2., got .* take a block"),
        (plot_covariance, ([0, 0], np.diag([1, np.nan])), "`covariance` must be finite"),
        (plot_covariance, ([0, 0], [[1.0, 0.5], [0.0, 1.0]]), "symmetric and positive"),
        (plot_covariance, ([0, 0], [[1.0, 2.0], [2.0, 1.0]]), "symmetric and positive"),
        (plot_covariance, ([0, 0, 0], np.eye(2)), r"`mean` must have shape \(2,\), got \(3,\); gi"),
        (plot_correspondences, (POINTS, POINTS), "`pairs` must be of the class Correspondences"),
        (plot_observability, (POINTS, POINTS), "`information` must be of the class Information"),
        (plot_convergence, (POINTS, None), "`result` must be of the class IcpResult, got array"),
    ],
)
def test_what_cannot_be_drawn(ax, plot, arguments, message):
    with pytest.raises(LabkitError, match=message):
        plot(ax, *arguments)
    assert not ax.has_data()


@pytest.mark.parametrize(
    ("plot", "arguments"),
    [
        (plot_trajectory, (POSES,)),
        (plot_covariance, ([0, 0], np.eye(2))),
        (plot_scans, (POINTS, POINTS)),
    ],
)
def test_a_figure_is_no_axes(plot, arguments):
    with pytest.raises(LabkitError, match="`ax` must be of the class Axes, got <BookFigure"):
        plot(book_figure(), *arguments)


def test_axes_are_no_figure(ax):
    with pytest.raises(LabkitError, match="`figure` must be of the class Figure or SubFigure"):
        plot_quality(ax, [], limits=None)


def test_a_figure_has_a_height_in_inches():
    with pytest.raises(LabkitError, match=r"`height` must be in \(0, 50\] in, got 51.0"):
        book_figure(51.0)
