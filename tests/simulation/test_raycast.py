"""Ray casting against one segment at a time, and under rigid motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labkit.se2 import apply, from_xytheta, transform
from labkit.simulation.raycast import first_hits
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


@given(seeds, poses)
@settings(max_examples=30, deadline=None)
def test_every_hit_lies_on_a_segment(seed, pose):
    segments, T = scene(seed), from_xytheta(pose)
    r = first_hits(segments, T, ANGLES)
    hit = np.isfinite(r)
    ends = r[hit, None] * np.column_stack([np.cos(ANGLES[hit]), np.sin(ANGLES[hit])])
    p = apply(T, ends)[:, None, :]
    a, b = segments[:, 0], segments[:, 1]
    length = np.hypot(*(b - a).T)
    detour = np.hypot(*(p - a).T) + np.hypot(*(p - b).T) - length[:, None]
    assert (detour.min(axis=0) < 1e-9).all()


@given(seeds, poses, poses)
@settings(max_examples=30, deadline=None)
def test_moving_world_and_scanner_together_changes_nothing(seed, pose, motion):
    segments = np.concatenate([scene(seed), 30.0 * circle([0.0, 0.0], 1.0)])
    T, A = from_xytheta(pose), from_xytheta(motion)
    here = first_hits(segments, T, ANGLES)
    there = first_hits(apply(A, segments), A @ T, ANGLES)
    # A beam that just grazes an end may change its mind; none other may.
    assert np.count_nonzero(~np.isclose(here, there, rtol=1e-7)) <= 1


@given(poses)
def test_a_closed_outline_lets_no_beam_out(pose):
    """Not even a beam that aims at a corner exactly."""
    square = polyline([[-4, -4], [4, -4], [4, 4], [-4, 4]], closed=True)
    x, y, theta = pose
    corners = [math.atan2(cy - y, cx - x) - theta for cx in (-4, 4) for cy in (-4, 4)]
    ranges = first_hits(square, from_xytheta(pose), np.concatenate([ANGLES, corners]))
    assert np.isfinite(ranges).all()
    assert ranges.min() >= 4.0 - max(abs(x), abs(y)) - 1e-12


def test_a_wall_straight_ahead_is_at_d_over_cosine():
    angles = np.linspace(-1.2, 1.2, 49)
    wall = np.array([[[3.0, -100.0], [3.0, 100.0]]])
    np.testing.assert_allclose(first_hits(wall, np.eye(3), angles), 3.0 / np.cos(angles))


def test_the_nearer_wall_hides_the_farther():
    near, far = ([[x, -1.0], [x, 1.0]] for x in (2.0, 5.0))
    assert first_hits(np.array([far, near]), np.eye(3), np.zeros(1)).tolist() == [2.0]


def test_what_lies_behind_is_not_seen():
    wall = np.array([[[-2.0, -1.0], [-2.0, 1.0]]])
    assert first_hits(wall, np.eye(3), np.zeros(1)).tolist() == [math.inf]
    assert first_hits(wall, transform(0, 0, math.pi), np.zeros(1)).tolist() == [2.0]


def test_edge_on_and_empty_worlds_return_nothing():
    edge_on = np.array([[[1.0, 0.0], [2.0, 0.0]]])
    assert first_hits(edge_on, np.eye(3), np.zeros(1)).tolist() == [math.inf]
    assert first_hits(np.empty((0, 2, 2)), np.eye(3), np.zeros(2)).tolist() == [math.inf] * 2
