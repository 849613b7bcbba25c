"""Places and what moves in them: closed where they should be, and as observable as they claim."""

import math

import numpy as np

from labkit.se2 import apply, transform
from labkit.simulation import Lidar, cast, corridor, crowd, room, two_rooms

WITHOUT_NOISE = Lidar(noise_std=0.0)
AROUND = Lidar(beam_count=720, field_of_view=2.0 * math.pi, noise_std=0.0)
WEST, EAST = transform(-1.5, 0.0, 0.0), transform(0.5, 0.0, 0.0)  # of the doorway in `two_rooms`


def ranges(world, x=0.0, y=0.0, theta=0.0):
    return cast(world, transform(x, y, theta), AROUND, rng=0).ranges


def in_world(T):
    """Points that a scanner sees at pose T in the two rooms, in the world frame."""
    return apply(T, cast(two_rooms(), T, WITHOUT_NOISE, rng=0).points)


def test_rooms_are_closed():
    assert np.isfinite(ranges(room(), 3.5, -2.5)).all()
    assert np.isfinite(ranges(two_rooms(), 2.0, -1.0, 0.1)).all()


def test_a_corridor_looks_alike_along_it():
    np.testing.assert_allclose(ranges(corridor()), ranges(corridor(), x=3.0), rtol=1e-12)


def test_people_stand_in_the_ring_and_walk_at_one_speed():
    people = crowd(50, rng=0, speed=1.5).moving

    assert len(people) == 50
    np.testing.assert_allclose([np.hypot(*person.velocity) for person in people], 1.5)
    distance = np.array([np.hypot(*person.segments[:, 0].T) for person in people])
    assert distance.min() >= 1.0
    assert distance.max() <= 3.0 + 1e-12


def test_people_hide_walls():
    empty, crowded = ranges(room()), ranges(crowd(rng=3))

    np.testing.assert_array_equal(ranges(crowd(0, rng=0)), empty)
    assert (crowded <= empty + 1e-12).all()
    assert np.mean(crowded < empty - 0.1) > 0.2


def test_two_rooms_overlap_in_part():
    west, east = in_world(WEST), in_world(EAST)

    distance_to_east = np.hypot(*(east[:, None] - west).T).min(axis=1)
    assert 0.1 < np.mean(distance_to_east < 0.1) < 0.67


def test_each_of_the_two_rooms_fills_most_of_its_scan():
    assert np.mean(in_world(WEST)[:, 0] < 0.01) > 0.6
    assert np.mean(in_world(EAST)[:, 0] > -0.01) > 0.6
