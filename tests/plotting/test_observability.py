"""The arrows follow the free direction, and the legend names it."""

import numpy as np
import pytest
from matplotlib.quiver import Quiver

from labkit.line_alignment import line_information
from labkit.plotting import plot_observability
from labkit.se2 import rotation

X = np.linspace(-5.0, 5.0, 101)
WALL = np.column_stack([X, np.full_like(X, 2.0)])
UP = np.tile([0.0, 1.0], (len(X), 1))
TURN = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
RIM = np.column_stack([np.cos(TURN), np.sin(TURN)])


def arrows(ax):
    (quiver,) = (each for each in ax.collections if isinstance(each, Quiver))
    return quiver.get_offsets(), np.column_stack([quiver.U, quiver.V])


@pytest.mark.parametrize("angle", [0.5, 2.0])
def test_a_wall_is_free_along_itself(ax, labels, angle):
    R = rotation(angle)
    plot_observability(ax, WALL @ R.T, line_information(WALL @ R.T, UP @ R.T))
    at, motion = arrows(ax)
    assert 10 < len(at) < len(WALL)
    np.testing.assert_allclose(motion @ R[:, 1], 0.0, atol=1e-9)
    assert np.abs(motion @ R[:, 0]).min() > 0.5
    assert labels(ax)[1:] == ["free: a shift"]
    for low, high in (ax.get_xlim(), ax.get_ylim()):
        assert high - low > 2.0  # a thin wall gets a picture, too


def test_a_round_room_is_free_to_turn(ax, labels):
    center = np.array([4.0, -1.0])
    plot_observability(ax, center + 3.0 * RIM, line_information(center + 3.0 * RIM, -RIM))
    at, motion = arrows(ax)
    np.testing.assert_allclose(((at - center) * motion).sum(axis=1), 0.0, atol=1e-9)
    assert labels(ax)[1:] == ["free: a turn"]


def test_a_room_has_no_free_direction(ax, labels):
    points = np.vstack([WALL, [1.0, -2.0] * WALL, WALL[:, ::-1], [-2.0, 1.0] * WALL[:, ::-1]])
    normals = np.vstack([UP, -UP, UP[:, ::-1], -UP[:, ::-1]])
    plot_observability(ax, points, line_information(points, normals))
    assert labels(ax)[1].startswith("fixed, known least: ")
