"""Walls that the map remembers: which ones, where they lie, and what they are good for."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit import Scan, Target, from_xytheta
from labkit.odometry import estimate_odometry, integrate
from labkit.odometry.constants import MAX_RANGE, REPEAT_DISTANCE
from labkit.odometry.local_map import LocalMap
from labkit.odometry.walls import NO_WALLS, mask_near
from labkit.se2 import apply, invert, relative, to_xytheta
from labkit.simulation import Lidar, WheelNoise, World, room, scan_along, wheel_increments
from labkit.simulation.world import polyline

TRUTH = integrate([[0.2, 0.05, math.radians(7.0)]] * 9, start=[-0.5, -0.3, 0.2])
SCANS = scan_along(room(), TRUTH, Lidar(noise_std=0.0), rng=0)


@pytest.fixture
def key_scans(monkeypatch):
    """So many key scans, each of the scans one of them, are all that the map holds."""

    def change(count):
        monkeypatch.setattr("labkit.odometry.local_map.KEY_SCANS", count)
        monkeypatch.setattr("labkit.odometry.local_map.KEY_MOTION", (0.0, 9.0))

    return change


def maps(order, scans=SCANS):
    """The map after each of the scans, taken in this order at their true poses."""
    T = from_xytheta(TRUTH)[order]
    motions = [np.zeros(3), *to_xytheta(relative(T[:-1], T[1:]))]
    seen = LocalMap()
    for k, motion in zip(order, motions, strict=True):
        seen = seen.follow(motion).add(Target(scans[k]), matched=True)
        yield seen


def test_what_was_seen_twice_on_a_line_is_remembered_where_it_was(key_scans):
    """A board that stands in the first scan alone is forgotten with it; so is a lone return."""
    key_scans(2)
    board = np.column_stack([np.full(21, 1.0), np.linspace(-0.3, 0.3, 21)])
    once = np.vstack([board, [[-1.0, 0.0]]])
    first = Scan.from_points(np.vstack([once, SCANS[0].points]))
    *_, seen = maps(range(10), [first, *SCANS[1:]])
    remembered = seen.target.points[: -sum(seen.sizes)]
    assert len(remembered) > 100
    assert np.isfinite(seen.target.normals[: len(remembered)]).all()
    T_world_newest = from_xytheta(TRUTH[-1])
    sweeps = scan_along(room(), TRUTH, Lidar(beam_count=3600, noise_std=0.0), rng=0)
    T_newest = invert(T_world_newest) @ from_xytheta(TRUTH)
    walls = np.vstack([apply(T, sweep.points) for T, sweep in zip(T_newest, sweeps, strict=True)])
    assert Target(walls).search.query(remembered)[1].max() < 0.02
    _, distances = Target(apply(T_newest[0], once)).search.query(seen.target.points)
    assert distances.min() > 2.0 * REPEAT_DISTANCE


def test_a_robot_that_comes_back_adds_nothing_to_what_is_remembered(key_scans):
    key_scans(2)
    there, back = [*range(len(SCANS))], [*range(len(SCANS) - 2, -1, -1)]
    lap = [*there, *back]
    remembered = [
        sum(map(len, seen.walls.tiles.values())) for seen in maps([*lap, *lap[1:], *lap[1:]])
    ]
    assert remembered[3] > 100
    assert remembered[-1] < 1.02 * remembered[2 * len(lap) - 1]


def test_a_robot_that_comes_back_is_put_where_it_was(monkeypatch):
    """Two laps of a passage round a block, longer than the way of all key scans, seen to 3 m."""
    monkeypatch.setattr("labkit.odometry.local_map.KEY_SCANS", 20)
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    outside, block = (polyline(side * square, closed=True) for side in (4.0, 2.2))
    niches = [[[x, 4.0], [x + 0.2, 3.7]] for x in (-3.0, -1.0, 0.5, 2.0)]
    world = World(segments=np.concatenate([outside, block, niches, np.flip(niches, axis=-1)]))
    straight, turn = [[0.2, 0.0, 0.0]] * 31, [[0.0, 0.0, math.pi / 20.0]] * 10
    path = integrate(2 * 4 * [*straight, *turn], start=[-3.1, -3.1, 0.0])
    scans = scan_along(world, path, Lidar(beam_count=181, range_max=3.0), rng=1)
    wheels = wheel_increments(path, WheelNoise(turn=0.1), rng=1)
    errors = []
    for near in (REPEAT_DISTANCE, 0.0):  # by the second one nothing is seen twice
        monkeypatch.setattr("labkit.odometry.walls.REPEAT_DISTANCE", near)
        run = estimate_odometry(scans, wheels, start=path[0])
        errors.append(np.hypot(*(run.poses - path)[-1, :2]))
    assert errors[0] < 0.03 < 0.1 < errors[1]


ROWS = st.lists(
    st.tuples(*[st.floats(-60.0, 60.0), st.floats(-60.0, 60.0)]).map(lambda p: (*p, 1.0, 0.0)),
    min_size=1,
    max_size=40,
).map(np.array)


@given(ROWS, ROWS, st.tuples(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0)))
def test_walls_around_are_the_first_of_each_square_wherever_the_robot_is(first, second, place):
    walls = NO_WALLS.add(first).add(second)
    assert NO_WALLS.add(first).tiles.keys() <= walls.tiles.keys()
    kept = {}
    for row in [*first, *second]:
        kept.setdefault(tuple(np.floor(row[:2] / REPEAT_DISTANCE)), tuple(row))
    tile = np.floor(np.array(place) / MAX_RANGE)
    expected = [
        row
        for row in kept.values()
        if np.abs(np.floor(np.array(row[:2]) / MAX_RANGE) - tile).max() <= 1.0
    ]
    around = walls.around(from_xytheta([*place, 1.0]))
    assert sorted(map(tuple, around.tolist())) == sorted(expected)


@given(ROWS, ROWS, st.integers(0, 40), st.integers(0, 40))
def test_near_is_what_all_distances_tell(rows, targets, first, end):
    rows, targets = 0.02 * rows, 0.02 * targets
    near = mask_near(rows, Target(targets[:, :2]), first, end)
    meant = targets[first:end, :2]
    distances = np.hypot(*(rows[:, None, :2] - meant).transpose(2, 0, 1))
    np.testing.assert_array_equal(near, (distances < REPEAT_DISTANCE).any(axis=1))
