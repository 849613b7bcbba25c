"""What cannot be simulated is refused."""

import math
from functools import partial

import numpy as np
import pytest

from labkit.simulation import (
    Lidar,
    MovingObject,
    WheelNoise,
    World,
    crowd,
    doorways,
    room,
    two_rooms,
)
from labkit.simulation.world import circle
from labkit.support.errors import InvalidParameterError, InvalidPointsError

WALL = np.zeros((1, 2, 2))
NUMBERS = {
    Lidar: "beam_count field_of_view range_min range_max noise_std dropout_ratio",
    WheelNoise: "along across turn drift",
    World(segments=WALL).at: "stamp",
    partial(circle, [0, 0], 1.0): "sides",
    room: "width depth",
    doorways: "period opening",
    two_rooms: "doorway width depth",
    partial(crowd, rng=0): "count speed",
}


@pytest.mark.parametrize("make", NUMBERS)
def test_a_number_out_of_its_range_is_refused_by_its_name(make):
    """The law: of every parameter, what is no number, and what is far too small or too large."""
    for name in NUMBERS[make].split():
        for value in (math.nan, -1e13, -math.inf, "3", None, True):
            with pytest.raises(InvalidParameterError, match=f"`{name}` must be .*, got {value!r}"):
                make(**{name: value})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (partial(World, segments=WALL[0]), r"`segments` must have shape \(M, 2, 2\), got \(2, 2\)"),
        (
            partial(World, segments=WALL * math.nan),
            "`segments` must be finite, got .*nan.* index 0",
        ),
        (partial(MovingObject, segments=WALL, velocity=[1, math.inf]), "`velocity` must be fin"),
        (partial(two_rooms, doorway=6.0), r"`depth` must be in \(6, inf\] m, got 6.0"),
    ],
)
def test_walls_that_cannot_stand_are_refused(call, message):
    with pytest.raises((InvalidPointsError, InvalidParameterError), match=message):
        call()
