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
    """Tails and vectors of the arrows, shapes (N, 2)."""
    (quiver,) = (artist for artist in ax.collections if isinstance(artist, Quiver))
    return quiver.get_offsets(), np.column_stack([quiver.U, quiver.V])


@pytest.mark.parametrize("angle", [0.5, 2.0])
def test_a_wall_is_free_along_itself(ax, labels, angle):
    R = rotation(angle)
    wall, normals = WALL @ R.T, UP @ R.T

    plot_observability(ax, wall, line_information(wall, normals))

    tails, vectors = arrows(ax)
    assert 10 < len(tails) < len(wall)
    np.testing.assert_allclose(vectors @ R[:, 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.abs(vectors @ R[:, 0]), 0.1 * np.ptp(wall, axis=0).max())
    assert labels(ax)[1:] == ["free: a shift"]


@pytest.mark.parametrize("limits", ["get_xlim", "get_ylim"])
def test_a_single_wall_gets_a_picture_with_some_width(ax, limits):
    plot_observability(ax, WALL, line_information(WALL, UP))
    low, high = getattr(ax, limits)()
    assert high - low >= 2.0 * 0.15 * 10.0


def test_a_round_room_is_free_to_turn(ax, labels):
    center = np.array([4.0, -1.0])
    points = center + 3.0 * RIM

    plot_observability(ax, points, line_information(points, -RIM))

    tails, vectors = arrows(ax)
    np.testing.assert_allclose(((tails - center) * vectors).sum(axis=1), 0.0, atol=1e-9)
    assert labels(ax)[1:] == ["free: a turn"]


def test_a_room_has_no_free_direction(ax, labels):
    points = np.vstack([WALL, [1.0, -2.0] * WALL, WALL[:, ::-1], [-2.0, 1.0] * WALL[:, ::-1]])
    normals = np.vstack([UP, -UP, UP[:, ::-1], -UP[:, ::-1]])

    plot_observability(ax, points, line_information(points, normals))

    assert labels(ax)[1].startswith("fixed, known least: ")
