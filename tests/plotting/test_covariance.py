"""The ellipse holds 95 % of the mass."""

import numpy as np
import pytest

from labkit.plotting import plot_covariance
from labkit.se2 import rotation

MEAN = np.array([1.0, -2.0])


@pytest.mark.parametrize("angle", [0.4, -1.0])
def test_95_percent_lie_inside(ax, angle):
    covariance = rotation(angle) @ np.diag([9.0, 0.25]) @ rotation(angle).T
    draws = np.random.default_rng(2).multivariate_normal(MEAN, covariance, 20_000)

    assert plot_covariance(ax, MEAN, covariance) is ax

    (ellipse,) = ax.patches
    on_unit_circle = ellipse.get_patch_transform().inverted().transform(draws)
    assert np.mean(np.hypot(*on_unit_circle.T) <= 1.0) == pytest.approx(0.95, abs=0.007)


def test_the_ellipse_of_one_direction_is_a_line(ax):
    plot_covariance(ax, MEAN, [[1.0, 0.0], [0.0, 0.0]])
    assert ax.patches[0].height == 0.0
