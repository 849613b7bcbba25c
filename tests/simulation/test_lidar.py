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
poses = st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-math.pi, math.pi))
seeds = st.integers(0, 2**32 - 1)


def scene(seed, count=30):
    return np.random.default_rng(seed).uniform(-10.0, 10.0, size=(count, 2, 2))


def solve(origin, direction, a, b):
    """Where a ray meets one segment, by a 2×2 solve; infinity where it does not."""
    r, s = np.linalg.solve(np.column_stack([direction, a - b]), a - origin)
    return r if r >= 0.0 and 0.0 <= s <= 1.0 else math.inf


@given(seeds, poses)
@settings(max_examples=15, deadline=None)
def test_the_nearest_segment_is_the_one_that_is_hit(seed, pose):
    segments, angles = scene(seed), ANGLES[::5] + 0.0123
    ranges = first_hits(segments, from_xytheta(pose), angles)
    origin = np.array(pose[:2])
    for r, angle in zip(ranges, pose[2] + angles, strict=True):
        direction = np.array([math.cos(angle), math.sin(angle)])
        brute = min(solve(origin, direction, a, b) for a, b in segments)
        assert r == pytest.approx(brute, rel=1e-8, abs=1e-9)


@given(poses)
def test_a_closed_outline_lets_no_beam_out(pose):
    """Not even a beam that aims at a corner exactly."""
    square = polyline([[-4, -4], [4, -4], [4, 4], [-4, 4]], closed=True)
    x, y, theta = pose
    corners = [math.atan2(cy - y, cx - x) - theta for cx in (-4, 4) for cy in (-4, 4)]
    ranges = first_hits(square, from_xytheta(pose), np.concatenate([ANGLES, corners]))
    assert np.isfinite(ranges).all()
    assert ranges.min() >= 4.0 - max(abs(x), abs(y)) - 1e-12


def test_edge_on_and_empty_worlds_return_nothing():
    edge_on = np.array([[[1.0, 0.0], [2.0, 0.0]]])
    assert first_hits(edge_on, np.eye(3), np.zeros(1)).tolist() == [math.inf]
    assert first_hits(np.empty((0, 2, 2)), np.eye(3), np.zeros(2)).tolist() == [math.inf] * 2


RING = World(segments=circle([0.0, 0.0], 5.0, sides=90))


def test_beams_span_the_field_of_view():
    angles = Lidar().angles
    assert len(angles) == 541
    np.testing.assert_allclose(np.degrees(np.diff(angles)), 0.5)
    assert angles[0] == -angles[-1] == -math.radians(135.0)
    around = Lidar(beam_count=4, field_of_view=2.0 * math.pi).angles  # no beam is there twice
    np.testing.assert_allclose(np.degrees(around), [-180.0, -90.0, 0.0, 90.0])


def test_noise_and_dropouts_have_the_stated_spread_and_share():
    lidar = Lidar(beam_count=20_000, noise_std=0.03, dropout_ratio=0.2)
    scan = cast(RING, np.eye(3), lidar, rng=1)
    assert len(scan) / 20_000 == pytest.approx(0.8, abs=0.012)
    exact = first_hits(RING.segments, np.eye(3), lidar.angles)
    residual = (scan.ranges - exact)[scan.beams]
    assert residual.std() == pytest.approx(0.03, rel=0.02)  # its own spread is 0.6 %
    assert abs(residual.mean()) < 4.0 * 0.03 / math.sqrt(len(scan))
    assert len(cast(RING, np.eye(3), Lidar(dropout_ratio=1.0), rng=0)) == 0


@pytest.mark.parametrize(
    ("distance", "seen"), [(0.05, False), (0.2, True), (2.9, True), (3.1, False)]
)
def test_only_the_band_returns(distance, seen):
    behind = [[20.0, 1.0], [20.0, -1.0]]  # hidden, where the first wall is too near as well
    wall = World(segments=polyline([[distance, -1.0], [distance, 1.0], *behind]))
    lidar = Lidar(beam_count=3, field_of_view=0.01, range_max=3.0, noise_std=0.0)
    assert (len(cast(wall, np.eye(3), lidar, rng=0)) == 3) is seen


def test_an_object_comes_nearer_with_the_stamps():
    wall = MovingObject(segments=polyline([[5.0, -1.0], [5.0, 1.0]]), velocity=[-2.0, 0.0])
    world = World(segments=np.empty((0, 2, 2)), moving=(wall,))
    lidar = Lidar(beam_count=3, field_of_view=0.01, noise_std=0.0)
    default = scan_along(world, np.zeros((3, 3)), lidar, rng=0)
    np.testing.assert_allclose([scan.ranges[1] for scan in default], [5.0, 4.8, 4.6])
    np.testing.assert_allclose([scan.stamp for scan in default], [0.0, 0.1, 0.2])
    stamped = scan_along(world, np.zeros((2, 3)), lidar, rng=0, stamps=[0.5, 2.0])
    np.testing.assert_allclose([scan.ranges[1] for scan in stamped], [4.0, 1.0])
