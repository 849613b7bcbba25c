"""Places and what moves in them: closed where they should be, and as observable as they claim."""

import math

import numpy as np

from labkit.se2 import apply, transform
from labkit.simulation import Lidar, cast, corridor, crowd, room, two_rooms

QUIET = Lidar(noise_std=0.0)
AROUND = Lidar(beam_count=720, field_of_view=2.0 * math.pi, noise_std=0.0)


def ranges(world, x=0.0, y=0.0, theta=0.0, lidar=AROUND):
    return cast(world, transform(x, y, theta), lidar, rng=0).ranges


def test_a_room_is_closed_and_a_corridor_looks_alike_along_it():
    assert np.isfinite(ranges(room(), 3.5, -2.5)).all()
    np.testing.assert_allclose(ranges(corridor()), ranges(corridor(), x=3.0), rtol=1e-12)


def test_people_stand_clear_of_the_scanner_and_hide_walls():
    world = crowd(50, rng=0, speed=1.5)
    assert len(world.moving) == 50
    np.testing.assert_allclose([np.hypot(*person.velocity) for person in world.moving], 1.5)
    distance = np.array([np.hypot(*person.segments[:, 0].T) for person in world.moving])
    assert (distance.min() >= 1.0, distance.max() <= 3.0 + 1e-12) == (True, True)
    empty, crowded = ranges(room()), ranges(crowd(rng=3))
    assert (crowded <= empty + 1e-12).all()
    np.testing.assert_array_equal(ranges(crowd(0, rng=0)), empty)
    assert np.mean(crowded < empty - 0.1) > 0.2


def test_two_rooms_overlap_in_part():
    """Each pose sees its own room for the most part, and both see some of it."""
    poses = transform(-1.5, 0.0, 0.0), transform(0.5, 0.0, 0.0)
    west, east = (apply(T, cast(two_rooms(), T, QUIET, rng=0).points) for T in poses)
    gap = np.hypot(*(east[:, None] - west).T).min(axis=0)
    assert 0.1 < np.mean(gap < 0.1) < 0.67
    assert np.mean(west[:, 0] < 0.01) > 0.6
    assert np.mean(east[:, 0] > -0.01) > 0.6
    assert np.isfinite(ranges(two_rooms(), 2.0, -1.0, 0.1)).all()
