"""The point-to-line step: what a surface fixes is solved for, the rest stays at rest."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.line_alignment import (
    MIN_INFORMATION,
    align_to_lines,
    least_information,
    line_information,
    solve_constrained,
)
from labkit.se2 import apply, invert, rotation, to_xytheta, transform
from labkit.support.errors import DegenerateAlignmentError

seeds = st.integers(0, 2**32 - 1)
angles = st.floats(-math.pi, math.pi)


def surface(seed, count=40):
    """Points with unit normals in every direction, and uneven weights."""
    rng = np.random.default_rng(seed)
    direction = rng.uniform(-math.pi, math.pi, count)
    normals = np.column_stack([np.cos(direction), np.sin(direction)])
    return rng.uniform(-4.0, 4.0, (count, 2)), normals, rng.uniform(0.2, 2.0, count)


def wall(direction=0.0, count=21):
    """A straight wall through (2, 1), seen along `direction`."""
    away, along = rotation(direction).T
    points = [2.0, 1.0] + np.linspace(-1.0, 1.0, count)[:, None] * along
    return points, np.broadcast_to(-away, (count, 2)), np.ones(count)


@given(seeds, st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1))
def test_gauss_newton_converges_quadratically(seed, x, y, turn):
    target, normals, weights = surface(seed)
    T = transform(0.1 * x, 0.1 * y, 0.05 * turn)
    source = apply(invert(T), target)

    T_1 = align_to_lines(source, target, normals, weights)
    T_2 = align_to_lines(apply(T_1, source), target, normals, weights) @ T_1
    T_3 = align_to_lines(apply(T_2, source), target, normals, weights) @ T_2

    error_0, error_1 = np.abs(np.eye(3) - T).max(), np.abs(T_1 - T).max()
    assert error_1 <= 3.0 * error_0**2 + 1e-12
    np.testing.assert_allclose(T_3, T, atol=1e-10)


def test_far_from_the_origin_only_the_digits_of_the_place_are_lost():
    """Sums are taken about the pairs' own centre: 1,000 km away, a step is good to 1e-7."""
    target, normals, weights = surface(3)
    source = apply(transform(0.03, -0.02, 0.01), target)
    A = transform(1e6, -1e6, 0.5)
    n = normals @ A[:2, :2].T
    there = align_to_lines(apply(A, source), apply(A, target), n, weights)
    here = align_to_lines(source, target, normals, weights)
    assert abs(to_xytheta(there)[2] - to_xytheta(here)[2]) < 1e-9
    center = np.average(source, axis=0, weights=weights)[None]
    expected = apply(A, apply(here, center))
    np.testing.assert_allclose(apply(there, apply(A, center)), expected, atol=1e-7, rtol=0.0)


@pytest.mark.parametrize("direction", [-2.0, 0.0, math.pi])
def test_a_single_wall_fixes_depth_and_turn_and_leaves_the_slide_at_rest(direction):
    target, normals, weights = wall(direction)
    along = rotation(direction)[:, 1]
    source = target + 0.05 * normals + 0.02 * along  # too near by 5 cm

    for share in (0.0, 0.2):  # residuals along the wall say how the beams fell
        step = align_to_lines(source, target, np.array(normals), weights, share)
        np.testing.assert_allclose(step, transform(*(-0.05 * normals[0]), 0.0), atol=1e-13)


@pytest.mark.parametrize("direction", [-2.0, 0.0, math.pi])
def test_a_single_wall_leaves_the_shift_along_it_free(direction):
    points, normals, weights = wall(direction)
    along = rotation(direction)[:, 1]

    (free,) = line_information(points, normals, weights).free.T

    np.testing.assert_allclose(np.abs(free @ [*along, 0.0]), 1.0, atol=1e-12)


def scene(seed):
    """The same, and points beside them; one pair in seven has no weight."""
    target, normals, weights = surface(seed, 60)
    weights[::7] = 0.0
    noise = np.random.default_rng(seed).normal(0.0, 1e-3, target.shape)
    return target + noise, target, normals, weights


@given(seeds, st.floats(0.0, 1.0))
def test_a_share_minimises_the_sum_of_both_costs(seed, share):
    """Against `lstsq` on the rows of both metrics, each with the root of its share."""
    source, target, normals, weights = scene(seed)
    tangents = normals @ rotation(0.5 * math.pi).T
    center = weights @ source / weights.sum()
    arm, offset = source - center, source - target
    left_sides, right_sides = [], []
    for direction, part in ((normals, 1.0), (tangents, share)):
        root = np.sqrt(part * weights)
        lever = direction[:, 1] * arm[:, 0] - direction[:, 0] * arm[:, 1]
        left_sides.append(root[:, None] * np.column_stack([direction, lever]))
        right_sides.append(-root * (direction * offset).sum(axis=1))
    rows, values = np.vstack(left_sides), np.concatenate(right_sides)
    (dx, dy, turn), *_ = np.linalg.lstsq(rows, values, rcond=None)

    step = align_to_lines(source, target, normals, weights, share)

    assert to_xytheta(step)[2] == pytest.approx(turn, abs=1e-12)
    np.testing.assert_allclose(apply(step, center[None])[0] - center, [dx, dy], atol=1e-12)


def test_a_share_lifts_the_least_information_with_it():
    """τ adds itself to every eigenvalue, and a calm step needs a quarter of the rest."""
    expected = {0.0: 0.02, 0.02: 0.98 * 0.02 + 0.02, 0.03: 0.97 * 0.005 + 0.03, 1.0: 1.0}
    for share, least in expected.items():
        assert least_information(share) == pytest.approx(least, rel=1e-11)
        assert least_information(share) < least


def test_a_direction_that_reaches_the_minimum_is_solved_for():
    x = solve_constrained(np.diag([1.0, 2.0, 4.0]), np.array([1.0, 3.0, 2.0]), 2.0)
    np.testing.assert_allclose(x, [0.0, -1.5, -0.5], atol=1e-15)


@given(seeds, st.floats(-5, 5), st.floats(-5, 5), angles)
def test_information_is_a_matter_of_shape_alone(seed, x, y, theta):
    points, normals, weights = surface(seed)
    expected = line_information(points, normals, weights)
    A = transform(x, y, theta)
    for scale in (1e-3, 1.0, 50.0):
        moved = line_information(scale * apply(A, points), normals @ A[:2, :2].T, 7.0 * weights)
        np.testing.assert_allclose(moved.values, expected.values, atol=1e-11)
        assert moved.length == pytest.approx(scale * expected.length)
    assert (np.diff(expected.values) >= 0.0).all()
    assert expected.degenerate == (expected.values[0] < MIN_INFORMATION)


@given(seeds)
def test_information_from_normals_that_were_measured_twice(seed):
    """Against a sum over the points; a normal that was turned around counts as it was."""
    points, normals, weights = surface(seed)
    rng = np.random.default_rng(seed)
    measured = normals @ rotation(rng.normal(0.0, 0.2)).T
    once = line_information(points, normals, weights)
    arms = (points - weights @ points / weights.sum()) / once.length
    A = np.zeros((3, 3))
    for (x, y), n, m, weight in zip(arms, normals, measured, weights, strict=True):
        row, row_again = (np.array([u, v, v * x - u * y]) for u, v in (n, m))
        A += weight * (np.outer(row, row_again) + np.outer(row_again, row)) / 2.0
    around = measured * rng.choice([-1.0, 1.0], len(measured))[:, None]
    for again in (measured, around):
        twice = line_information(points, normals, weights, again)
        np.testing.assert_allclose(twice.values, np.linalg.eigvalsh(A / weights.sum()), atol=1e-12)
    same = line_information(points, normals, weights, -normals)
    np.testing.assert_allclose(same.values, once.values, atol=1e-12)


@pytest.mark.parametrize("count", [1, 7])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.1, 0.9), (1e6, -0.3)])
def test_coinciding_points_are_refused_wherever_they_lie(place, count):
    """Their mean may round: the rest is no lever arm to turn about."""
    points, normals = np.tile(place, (count, 1)), np.tile([0.0, 1.0], (count, 1))
    with pytest.raises(DegenerateAlignmentError, match=f"{count} surface points"):
        line_information(points, normals, np.ones(count))
    with pytest.raises(DegenerateAlignmentError, match=f"{count} surface points"):
        align_to_lines(points, points + 0.1, normals, np.linspace(0.5, 1.0, count))
    with pytest.raises(DegenerateAlignmentError, match="in one place or are none"):
        line_information(np.arange(2.0 * count).reshape(count, 2), normals, np.zeros(count))
