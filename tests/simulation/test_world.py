"""Segments, shapes and things that move."""

import math

import numpy as np
import pytest

from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.simulation import MovingObject, World
from labkit.simulation.world import circle, polyline


def test_polyline_joins_each_vertex_to_the_next():
    vertices = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]
    np.testing.assert_array_equal(polyline(vertices), [vertices[:2], vertices[1:]])
    closed = polyline(vertices, closed=True)
    np.testing.assert_array_equal(closed[-1], [vertices[2], vertices[0]])
    assert len(closed) == 3


def test_circle_is_closed_and_inscribed():
    segments = circle([2.0, -1.0], 0.5, sides=12)
    np.testing.assert_array_equal(segments[:, 1], np.roll(segments[:, 0], -1, axis=0))
    np.testing.assert_allclose(np.hypot(*(segments[:, 0] - [2.0, -1.0]).T), 0.5)


def test_objects_move_and_walls_stay():
    wall = polyline([[0.0, 0.0], [1.0, 0.0]])
    world = World(segments=wall, moving=(MovingObject(segments=wall, velocity=[1.0, -2.0]),))
    np.testing.assert_array_equal(world.at(0.0), np.concatenate([wall, wall]))
    np.testing.assert_array_equal(
        world.at(0.5), np.concatenate([wall, wall + np.array([0.5, -1.0])])
    )


@pytest.mark.parametrize(
    ("segments", "message"),
    [
        ([[0, 0], [1, 0]], r"`segments` must have shape \(M, 2, 2\), got \(2, 2\)"),
        ([[[0, 0], [1, math.nan]]], r"`segments` must be finite, got .*nan.* at index 0"),
    ],
)
def test_bad_segments(segments, message):
    with pytest.raises(InvalidPointsError, match=message):
        World(segments=segments)


def test_bad_numbers():
    with pytest.raises(InvalidPointsError, match="`velocity` must be finite"):
        MovingObject(segments=np.zeros((1, 2, 2)), velocity=[1.0, math.inf])
    with pytest.raises(InvalidParameterError, match="`stamp` must be a finite time in s, got"):
        World(segments=np.zeros((1, 2, 2))).at(math.nan)
    with pytest.raises(InvalidParameterError, match="`sides` must be a whole number of at least 3"):
        circle([0.0, 0.0], 1.0, sides=2)
