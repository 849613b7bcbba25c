"""What cannot be simulated is refused, with the value that was received."""

import math

import numpy as np
import pytest

from labkit.simulation import (
    Lidar,
    MovingObject,
    WheelNoise,
    World,
    crowd,
    lesson_world,
    room,
    scan_along,
    two_rooms,
)
from labkit.simulation.world import circle
from labkit.support.errors import InvalidParameterError, InvalidPointsError

NAN, POSE, WALL = math.nan, np.zeros((1, 3)), np.zeros((1, 2, 2))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: World(segments=WALL[0]), r"`segments` must have shape \(M, 2, 2\), got \(2, 2\)"),
        (lambda: World(segments=WALL * NAN), "`segments` must be finite, got .*nan.* at index 0"),
        (lambda: MovingObject(segments=WALL, velocity=[1, NAN]), "`velocity` must be 2 finite num"),
        (lambda: scan_along(room(), POSE, Lidar(), rng=0, stamps=[0, 1]), r"\(1,\), .* got \(2,\)"),
    ],
)
def test_points_and_poses_that_cannot_be_meant(call, message):
    with pytest.raises(InvalidPointsError, match=message):
        call()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Lidar(beam_count=1), "`beam_count` must be a whole number of at least 2, got 1"),
        (lambda: Lidar(field_of_view=0.0), r"`field_of_view` must be in \(0, 6.28319\] rad"),
        (lambda: Lidar(range_max=NAN), "`range_max` must exceed `range_min`, got nan and 0.1 m"),
        (lambda: Lidar(noise_std=-0.1), r"`noise_std` must be in \[0, 10\] m, got -0.1"),
        (lambda: Lidar(dropout_ratio=1.1), r"`dropout_ratio` must be in \[0, 1\], got 1.1"),
        (lambda: WheelNoise(drift=NAN), r"`drift` must be in \[0, 10\], got nan"),
        (lambda: World(segments=WALL).at(NAN), "`stamp` must be a finite time in s, got"),
        (lambda: circle([0, 0], 1.0, sides=2), "`sides` must be a whole number of at least 3"),
        (lambda: room(width=0.0), r"`width` must be in \(0, 10000\] m, got 0.0"),
        (lambda: crowd(-1, rng=0), "`count` must be a whole number of at least 0, got -1"),
        (lambda: crowd(rng=0, speed=-1.0), r"`speed` must be in \[0, 100\] m/s, got -1.0"),
        (lambda: two_rooms(doorway=6.0), r"`doorway` must be in \(0, depth = 6\) m, got 6.0"),
        (lambda: lesson_world(3, rng=0), "`count` must be a whole number of at least 4"),
    ],
)
def test_parameters_that_cannot_be_meant(call, message):
    with pytest.raises(InvalidParameterError, match=message):
        call()
