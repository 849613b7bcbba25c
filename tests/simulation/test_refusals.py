"""A number out of its range, and a world that cannot stand, are refused by name and value."""

import math
from functools import partial

import numpy as np
import pytest

from labkit import LabkitError
from labkit.simulation import (
    Lidar,
    MovingObject,
    WheelNoise,
    World,
    cast,
    crowd,
    doorways,
    room,
    scan_along,
    two_rooms,
    wheel_increments,
)
from labkit.simulation.world import circle

WALL = np.zeros((1, 2, 2))
POSES = np.zeros((2, 3))
NUMBERS = {
    Lidar: "beam_count field_of_view range_min range_max noise_std dropout_ratio",
    WheelNoise: "along across turn drift",
    World(segments=WALL).at: "stamp",
    MovingObject(segments=WALL, velocity=[0, 0]).at: "stamp",
    partial(circle, [0, 0], sides=5): "radius",
    partial(circle, [0, 0], 1.0): "sides",
    room: "width depth",
    doorways: "period opening",
    two_rooms: "doorway width depth",
    partial(crowd, rng=0): "count speed",
}


@pytest.mark.parametrize("value", [math.nan, -1e13, -math.inf, "3", None, True])
@pytest.mark.parametrize(
    ("make", "name"), [(make, name) for make, names in NUMBERS.items() for name in names.split()]
)
def test_a_number_out_of_its_range_is_refused_by_its_name(make, name, value):
    with pytest.raises(LabkitError, match=f"`{name}` must be .*, got {value!r}"):
        make(**{name: value})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (partial(World, segments=WALL[0]), r"`segments` must have shape \(M, 2, 2\), got \(2, 2\)"),
        (partial(World, segments=WALL * math.nan), "`segments` must be finite, .*nan.* index 0"),
        (partial(World, segments=WALL + 1e13), r"`segments` must lie within 1e\+12 m, got"),
        (partial(World, segments=WALL, moving=[WALL]), r"`moving\[0\]` .* class MovingObject, got"),
        (partial(MovingObject, segments=WALL, velocity=[1, math.inf]), "`velocity` must be fin"),
        (partial(MovingObject, segments=WALL, velocity=[1, 1e10]), "`velocity` .*m/s, got 1000"),
        (partial(two_rooms, doorway=6.0), r"`depth` must be in \(6, inf\] m, got 6.0"),
    ],
)
def test_a_world_that_cannot_stand_is_refused(call, message):
    with pytest.raises(LabkitError, match=message):
        call()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"increment": [1.0, 0.0, 90.0]}, r"`increment` must be in .* rad, got .*90"),
        ({"increment": [1e300, 0.0, 0.0]}, r"`increment` must lie within 1e\+12 m, got"),
        ({"sweep_time": 1e9}, r"`sweep_time` must be in \[0, 541\] s, got"),
        ({"sweep_time": -1.0}, r"`sweep_time` must be in \[0, 541\] s, got -1"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused(change, message):
    with pytest.raises(LabkitError, match=message):
        cast(room(), np.eye(3), Lidar(), rng=0, **change)


def test_skewed_is_true_or_false():
    with pytest.raises(LabkitError, match="`skewed` must be of the class bool, got"):
        scan_along(room(), POSES, Lidar(), rng=0, skewed=POSES)


@pytest.mark.parametrize("rng", [0.5, -1, "seed", None, True, [1, 2]])
def test_what_is_neither_a_generator_nor_a_seed_is_refused(rng):
    with pytest.raises(LabkitError, match=r"`rng` must be .*, got "):
        wheel_increments(POSES, WheelNoise(), rng=rng)


def test_lengths_are_real_numbers_of_any_type():
    np.testing.assert_array_equal(
        two_rooms(width=np.uint8(3)).segments, two_rooms(width=3.0).segments
    )
