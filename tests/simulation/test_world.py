"""Segments, shapes and things that move."""

import math

import numpy as np
import pytest

from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.simulation import MovingObject, World
from labkit.simulation.world import circle, polyline


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
    with pytest.raises(InvalidPointsError, match="`velocity` must be 2 finite numbers"):
        MovingObject(segments=np.zeros((1, 2, 2)), velocity=[1.0, math.inf])
    with pytest.raises(InvalidParameterError, match="`stamp` must be a finite time in s, got"):
        World(segments=np.zeros((1, 2, 2))).at(math.nan)
    with pytest.raises(InvalidParameterError, match="`sides` must be a whole number of at least 3"):
        circle([0.0, 0.0], 1.0, sides=2)
