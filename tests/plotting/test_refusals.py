"""What cannot be drawn is refused, with the value that was received, and nothing is drawn."""

import numpy as np
import pytest

from labkit import LabkitError
from labkit.plotting import book_figure, map_points, plot_covariance, plot_trajectory
from labkit.scan import Scan

POSES = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.5]])
SCAN = Scan.from_points([[0.0, 1.0], [2.0, 1.0]])


@pytest.mark.parametrize(
    ("plot", "arguments", "message"),
    [
        (plot_trajectory, (POSES, [SCAN]), "must be one to one, got 1 scans and 2 poses"),
        (plot_trajectory, (POSES, None, [[0, 0, np.inf]]), "`reference` must be finite"),
        (plot_covariance, ([0, 0], np.eye(3)), "shape .2, 2., got .* take a block"),
        (plot_covariance, ([0, 0], np.diag([1, np.nan])), "`covariance` must be finite"),
        (plot_covariance, ([0, 0], [[1.0, 0.5], [0.0, 1.0]]), "symmetric and positive"),
        (plot_covariance, ([0, 0], [[1.0, 2.0], [2.0, 1.0]]), "symmetric and positive"),
        (
            plot_covariance,
            ([0, 0, 0], np.eye(2)),
            r"`mean` must have shape \(2,\), got \(3,\); give x, y",
        ),
        (
            lambda _, *given: map_points(*given),
            (POSES[:0], []),
            r"1 or more poses, .* got shape \(0, 3\)",
        ),
        (lambda _, height: book_figure(height), (51.0,), r"`height` must be in \(0, 50\] in, got"),
    ],
)
def test_what_cannot_be_drawn(ax, plot, arguments, message):
    with pytest.raises(LabkitError, match=message):
        plot(ax, *arguments)
    assert not ax.has_data()
