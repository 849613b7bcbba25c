"""A prepared target: the same points, searched and given normals once."""

import copy
import math
import pickle

import numpy as np
import pytest

from labkit import Scan, Target
from labkit.normals import estimate_normals
from labkit.simulation import Lidar, cast, room
from labkit.support.errors import InvalidPointsError
from labkit.target import as_target, target_on_lines


def test_a_target_is_prepared_once():
    target = Target([[0.0, 0.0], [1.0, 0.0]])
    assert as_target(target) is target
    assert target.normals is target.normals
    index, distance = target.search.query([[0.9, 0.0]])
    assert (index[0], distance[0]) == (1, pytest.approx(0.1))


def test_the_beam_order_reaches_the_normals(in_the_room):
    scan = in_the_room.target
    np.testing.assert_array_equal(Target(scan).normals, estimate_normals(scan))
    bare = Target(scan.points)
    np.testing.assert_array_equal(bare.normals, estimate_normals(Scan.from_points(scan.points)))
    assert not np.array_equal(bare.normals, Target(scan).normals, equal_nan=True)


def test_a_target_keeps_its_points_when_the_callers_array_is_filled_anew(in_the_room):
    """Before its normals were asked for, too: a driver hands in one buffer again and again."""
    buffer = in_the_room.target.points.copy()
    target, normals = Target(buffer), Target(buffer.copy()).normals
    buffer[:] = 0.0
    np.testing.assert_array_equal(target.normals, normals)


def test_some_points_of_a_dense_target_stay_on_their_lines():
    """Alone they might be sparse, or lie on other lines."""
    wall = np.column_stack([np.linspace(-1.0, 1.0, 4_000), np.full(4_000, 2.0)])
    noise = np.random.default_rng(0).normal(0.0, 0.01, wall.shape)
    target = Target(wall + noise)
    is_kept = np.arange(4_000) % 100 == 0

    part = target.select(is_kept)

    assert part.dense
    assert part.line_width == target.line_width
    np.testing.assert_array_equal(part.points, target.points[is_kept])
    np.testing.assert_array_equal(part.normals, target.normals[is_kept])


@pytest.mark.parametrize("rows", [3, None, [[0, 1], [1, 0]], [0, 9], [True]])
def test_rows_that_are_none_of_the_target_are_refused(rows):
    with pytest.raises(InvalidPointsError, match="`kept` must be a mask of 4 points"):
        Target(np.eye(4, 2)).select(rows)


def test_points_lie_on_the_same_lines_whoever_gives_their_normals():
    scan = cast(room(), np.eye(3), Lidar(beam_count=5_000, noise_std=0.01), rng=0)
    own = Target(scan)

    given = Target(scan, own.normals)

    assert given.dense
    np.testing.assert_array_equal(given.points, own.points)


def test_given_normals_are_used_as_they_are():
    """A wall along x that is said to face along y with one point on no surface."""
    given = np.array([[0.0, -1.0], [math.nan, math.nan], [0.0, -1.0]])
    target = Target([[0.0, 1.0], [1.0, 1.0], [2.0, 1.0]], normals=given)
    np.testing.assert_array_equal(target.normals, given)


@pytest.mark.parametrize("again", [copy.copy, lambda part: pickle.loads(pickle.dumps(part))])
def test_a_part_of_a_dense_target_keeps_its_lines_wherever_it_goes(again):
    target = Target(cast(room(), np.eye(3), Lidar(beam_count=8_000, noise_std=0.01), rng=0))
    part = target.select(np.arange(8_000) % 40 == 0)

    made_again = again(part)

    assert target.dense
    np.testing.assert_array_equal(made_again.points, part.points)
    np.testing.assert_array_equal(made_again.normals, part.normals)


def test_points_on_lines_stay_however_dense_they_are():
    """A map of many scans must not be smoothed as if it were one."""
    dense = Target(cast(room(), np.eye(3), Lidar(beam_count=8_000, noise_std=0.01), rng=0))

    as_map = target_on_lines(dense.scan.points, dense.normals)

    assert dense.dense
    assert not as_map.dense
    np.testing.assert_array_equal(as_map.points, dense.scan.points)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(as_map)).points, dense.scan.points)
