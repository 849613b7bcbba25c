"""The scanner: its rays against one segment at a time, its beams, its noise, and time."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labkit.se2 import from_xytheta
from labkit.simulation import Lidar, MovingObject, World, cast, scan_along
from labkit.simulation.lidar import first_hits
from labkit.simulation.world import circle, polyline

ANGLES = np.linspace(-math.pi, math.pi, 180, endpoint=False)
RING = World(segments=circle([0.0, 0.0], 5.0, sides=90))
THREE_BEAMS = Lidar(beam_count=3, field_of_view=0.01, range_max=3.0, noise_std=0.0)
poses = st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-math.pi, math.pi))
seeds = st.integers(0, 2**32 - 1)


def distance_by_solving(origin, direction, a, b):
    """Distance along a ray to one segment, by a 2×2 solve; infinity where it does not meet it."""
    r, s = np.linalg.solve(np.column_stack([direction, a - b]), a - origin)
    return r if r >= 0.0 and 0.0 <= s <= 1.0 else math.inf


@given(seeds, poses)
@settings(max_examples=15, deadline=None)
def test_the_nearest_segment_is_the_one_that_is_hit(seed, pose):
    segments = np.random.default_rng(seed).uniform(-10.0, 10.0, size=(30, 2, 2))
    angles = ANGLES[::5] + 0.0123

    ranges = first_hits(segments, from_xytheta(pose), angles)

    for distance, angle in zip(ranges, pose[2] + angles, strict=True):
        direction = np.array([math.cos(angle), math.sin(angle)])
        expected = min(distance_by_solving(pose[:2], direction, a, b) for a, b in segments)
        assert distance == pytest.approx(expected, rel=1e-8, abs=1e-9)


@given(poses)
def test_a_closed_outline_lets_no_beam_out(pose):
    """Not even a beam that aims at a corner exactly."""
    square = polyline([[-4, -4], [4, -4], [4, 4], [-4, 4]], closed=True)
    x, y, theta = pose
    corners = [math.atan2(cy - y, cx - x) - theta for cx in (-4, 4) for cy in (-4, 4)]

    ranges = first_hits(square, from_xytheta(pose), np.concatenate([ANGLES, corners]))

    assert np.isfinite(ranges).all()
    assert ranges.min() >= 4.0 - max(abs(x), abs(y)) - 1e-12


@pytest.mark.parametrize("segments", [[[[1.0, 0.0], [2.0, 0.0]]], np.empty((0, 2, 2))])
def test_a_segment_edge_on_and_an_empty_world_return_nothing(segments):
    assert first_hits(np.array(segments), np.eye(3), np.zeros(2)).tolist() == [math.inf] * 2


def test_the_default_beams_are_the_lesson_s():
    angles = Lidar().angles

    assert len(angles) == 541
    np.testing.assert_allclose(np.degrees(np.diff(angles)), 0.5)
    assert angles[0] == -angles[-1] == -math.radians(135.0)


def test_a_full_circle_has_no_beam_twice():
    angles = Lidar(beam_count=4, field_of_view=2.0 * math.pi).angles
    np.testing.assert_allclose(np.degrees(angles), [-180.0, -90.0, 0.0, 90.0])


def test_noise_has_the_stated_spread_and_is_centred():
    lidar = Lidar(beam_count=20_000, noise_std=0.03)

    exact = first_hits(RING.segments, np.eye(3), lidar.angles)
    noise = cast(RING, np.eye(3), lidar, rng=1).ranges - exact

    assert noise.std() == pytest.approx(0.03, rel=0.02)  # its own spread is 0.5 %
    assert abs(noise.mean()) < 4.0 * 0.03 / math.sqrt(20_000)


@pytest.mark.parametrize("ratio", [0.0, 0.2, 1.0])
def test_dropouts_have_the_stated_share(ratio):
    scan = cast(RING, np.eye(3), Lidar(beam_count=5_000, dropout_ratio=ratio), rng=1)
    assert 1.0 - len(scan) / 5_000 == pytest.approx(ratio, abs=0.025 * (0.0 < ratio < 1.0))


def wall(distance):
    return polyline([[distance, -1.0], [distance, 1.0]])


@pytest.mark.parametrize(("distance", "count"), [(0.05, 0), (0.2, 3), (2.9, 3), (3.1, 0)])
def test_only_what_lies_between_the_ranges_returns(distance, count):
    world = World(segments=wall(distance))
    assert len(cast(world, np.eye(3), THREE_BEAMS, rng=0)) == count


def test_what_is_too_near_hides_what_is_behind():
    world = World(segments=np.concatenate([wall(0.05), wall(2.0)]))
    assert len(cast(world, np.eye(3), THREE_BEAMS, rng=0)) == 0


@pytest.fixture(scope="module")
def approaching():
    """A world of one wall, 5 m ahead, that comes nearer at 2 m/s."""
    moving = MovingObject(segments=wall(5.0), velocity=[-2.0, 0.0])
    return World(segments=np.empty((0, 2, 2)), moving=(moving,))


@pytest.mark.parametrize(
    ("stamps", "times", "distances"),
    [
        (None, [0.0, 0.1, 0.2], [5.0, 4.8, 4.6]),
        ([0.5, 1.0, 2.0], [0.5, 1.0, 2.0], [4.0, 3.0, 1.0]),
    ],
)
def test_an_object_comes_nearer_with_the_stamps(approaching, stamps, times, distances):
    lidar = Lidar(beam_count=3, field_of_view=0.01, noise_std=0.0)

    scans = scan_along(approaching, np.zeros((3, 3)), lidar, rng=0, stamps=stamps)

    np.testing.assert_allclose([scan.stamp for scan in scans], times)
    np.testing.assert_allclose([scan.ranges[1] for scan in scans], distances)
