"""Which motions a scan does not see: corridors yes, rooms no."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit import IcpParameters, Scan, icp
from labkit.degeneracy import (
    follow_surfaces,
    free_motions,
    observability,
    return_to_surfaces,
    spread_ratio,
)
from labkit.line_alignment import line_information
from labkit.odometry import OdometryParameters
from labkit.se2 import apply, rotation, transform
from labkit.simulation import Lidar, cast, corridor, room

BY_LINE = IcpParameters(metric="point_to_line")
METRICS = pytest.mark.parametrize(
    "metric", [BY_LINE, IcpParameters(), OdometryParameters().icp], ids=["line", "point", "odo"]
)
ANGLES = pytest.mark.parametrize("angle", [-math.pi, -1.0, 0.5 * math.pi])
angles = st.floats(-math.pi, math.pi)
MOTION = transform(0.1, 0.05, math.radians(3.0))


def match_two_scans(world, seed, metric=BY_LINE):
    """The result of a match between two noisy scans of a world."""
    rng = np.random.default_rng(seed)
    target = cast(world, np.eye(3), Lidar(), rng=rng)
    source = cast(world, MOTION, Lidar(), rng=rng)
    return icp(source, target, None, metric)


@pytest.mark.slow
def test_corridors_are_flagged_and_rooms_are_not():
    """50 draws of noise of each: the flag is the data's, not one seed's luck."""
    flags = {
        world: [match_two_scans(world(), seed).observability.degenerate for seed in range(50)]
        for world in (corridor, room)
    }

    assert all(flags[corridor])
    assert not any(flags[room])


def match_shifted_wall(angle, metric):
    """The direction of a wall, and the match of the wall with itself, shifted along it."""
    along, away = rotation(angle).T
    wall = np.linspace(-2.0, 2.0, 81)[:, None] * along + 1.5 * away
    return along, icp(wall[10:-10] + 0.3 * along, wall, None, metric)


@METRICS
@ANGLES
def test_a_wall_shifted_along_itself_is_reported_as_unobservable(metric, angle):
    """Not as no motion: the result names the direction, whatever the estimate is."""
    along, result = match_shifted_wall(angle, metric)

    (free,) = result.observability.free.T

    assert result.converged
    np.testing.assert_allclose(abs(free @ [*along, 0.0]), 1.0, atol=1e-6)


@METRICS
@ANGLES
def test_a_free_shift_is_named_by_its_direction(metric, angle):
    along, result = match_shifted_wall(angle, metric)

    (words,) = result.unobservable
    x, y = map(float, re.fullmatch(r"shift along \((.+), (.+)\)", words).groups())

    np.testing.assert_allclose(abs(along @ [x, y]), 1.0, atol=0.01)
    assert "-0.00" not in words
    assert result.message == f"{result.termination.value}; unobservable: {words}"


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), angles, angles)
def test_a_free_turn_is_about_the_point_that_stays(x, y, start, frame):
    """An arc of a circle, whose centroid is not its centre, anywhere."""
    arc = rotation(start + np.linspace(0.0, 4.0, 80))[:, :, 0]
    A = transform(x, y, frame)
    information = line_information(apply(A, 2.0 * arc), arc @ A[:2, :2].T)

    (words,) = free_motions(information)

    center = re.fullmatch(r"turn about \((.+), (.+)\)", words).groups()
    np.testing.assert_allclose([float(number) for number in center], [x, y], atol=0.02)


def test_a_failed_match_and_a_scene_without_surfaces_say_nothing():
    failed = icp([[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]])
    grid = 3.0 * np.stack(np.meshgrid(np.arange(5.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    for result in (failed, icp(grid, grid)):
        assert result.observability is None
        assert result.unobservable == ()
        assert result.message == result.termination.value


@METRICS
def test_observability_is_the_information_of_the_kept_pairs(metric):
    result = match_two_scans(room(), 4, metric)
    pairs = result.correspondences
    normals = result.target.normals[pairs.target_index]
    used = pairs.kept & np.isfinite(normals[:, 0])
    moved = apply(result.T_target_source, result.source.points)

    information = observability(pairs, result.target)

    assert used.sum() > 100
    expected = line_information(moved[used], normals[used], pairs.weights[used])
    np.testing.assert_allclose(information.values, expected.values, rtol=1e-9)
    np.testing.assert_allclose(result.observability.values, expected.values, rtol=1e-9)


@METRICS
def test_only_pairs_with_both_normals_count_where_the_source_has_its_own(metric):
    result = match_two_scans(room(), 4, metric)
    pairs = result.correspondences
    normals = result.target.normals[pairs.target_index]
    source_normals = normals @ rotation(0.1).T  # as if measured a second time
    source_normals[::3] = np.nan

    information = observability(pairs, result.target, source_normals)

    used = pairs.kept & np.isfinite(normals[:, 0]) & np.isfinite(source_normals[:, 0])
    expected = line_information(
        pairs.source[used], normals[used], pairs.weights[used], source_normals[used]
    )
    np.testing.assert_allclose(information.values, expected.values, rtol=1e-9)


GRID = np.stack(np.meshgrid(np.linspace(-4, 4, 9), np.linspace(-1, 1, 5)), axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("theta", [-3.0, 0.0, 1.1])
@pytest.mark.parametrize("speed", [1e-6, 1.0, -20.0])
def test_spread_by_hand_turns_with_scan_and_motion_and_ignores_speed_and_place(theta, speed):
    """Uniform grids of half width 4 and 1; their spreads go as √(n² − 1) times the step."""
    A = transform(5.0, -3.0, theta)
    along, across = speed * A[:2, :2].T
    expected = 0.5 * math.sqrt(5**2 - 1) / math.sqrt(9**2 - 1)
    assert spread_ratio(apply(A, GRID), along) == pytest.approx(expected)
    assert spread_ratio(apply(A, GRID), across) == pytest.approx(1.0 / expected)


@pytest.mark.parametrize(
    ("points", "motion"),
    [
        (GRID, [0.0, 0.0]),
        (GRID, [math.nan, math.nan]),
        (np.array([[1.0, -1.0], [1.0, 1.0]]), [1.0, 0.0]),
        (Scan.from_ranges([math.inf], [0.0]), [1.0, 0.0]),
    ],
)
def test_no_motion_or_no_spread_along_it_is_no_number(points, motion):
    assert math.isnan(spread_ratio(points, motion))


def test_where_a_scan_turns_away_from_its_surfaces_a_free_direction_is_kept(monkeypatch):
    """Few pairs may turn it on and on, to the one side and to the other."""

    def turn_away(points, grid, loop_normals, normals, motion, seen, parameters):
        return motion + np.array([0.0, 0.0, math.copysign(4.0, motion[0])])

    monkeypatch.setattr("labkit.degeneracy.return_to_surfaces", turn_away)
    result = match_two_scans(room(), 0)
    match = result.source, result.target, np.eye(3), BY_LINE
    along = np.array([1.0, 0.0, 0.0])

    np.testing.assert_array_equal(follow_surfaces(*match, np.eye(3), along), along)


def test_a_scan_that_slid_out_of_reach_stays_where_it_is():
    """No pair is left to solve for."""
    result = match_two_scans(room(), 0)
    normals = result.target.normals
    searched = result.source.points, result.target.search.grid, normals, normals
    far = np.array([100.0, 0.0, 0.0])

    np.testing.assert_array_equal(return_to_surfaces(*searched, far, np.eye(3), BY_LINE), far)
