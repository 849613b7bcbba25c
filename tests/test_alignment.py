"""Alignment of given pairs: the closed form, the SVD, and what neither can answer."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.alignment import align, align_svd
from labkit.se2 import apply, to_xytheta, transform
from labkit.support.errors import DegenerateAlignmentError

PI = math.pi
SOLVERS = pytest.mark.parametrize("solve", [align, align_svd])
CIRCLE = [-PI, math.nextafter(-PI, 0), -1e-9, 0.0, 1e-9, PI, *np.linspace(-PI, PI, 25)]

seeds = st.integers(0, 2**32 - 1)
angles = st.floats(-PI, PI)
coordinates = st.floats(-20.0, 20.0)
transforms = st.builds(transform, coordinates, coordinates, angles)


def problem(seed, theta=0.7, noise=0.3, count=None):
    """Noisy pairs around a rotation by `theta`, with uneven weights."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 40)) if count is None else count
    source = rng.normal(0.0, 2.0, (count, 2)) + rng.uniform(-5.0, 5.0, 2)
    target = apply(transform(*rng.uniform(-5.0, 5.0, 2), theta), source)
    return source, target + rng.normal(0.0, noise, (count, 2)), rng.uniform(0.05, 2.0, count)


def cost(T, source, target, weights):
    return weights @ ((apply(T, source) - target) ** 2).sum(axis=1)


def test_closed_form_and_svd_agree_around_the_circle():
    for theta in CIRCLE:
        for seed in range(5):
            pairs = problem(seed, theta)
            np.testing.assert_allclose(align(*pairs), align_svd(*pairs), atol=1e-12)


@given(seeds, angles, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
def test_no_other_transform_costs_less(seed, theta, x, y, turn):
    pairs = problem(seed, theta)
    best = align(*pairs)
    least = cost(best, *pairs)
    for size in (1.0, 1e-2, 1e-4):
        other = transform(size * x, size * y, size * turn) @ best
        assert cost(other, *pairs) >= least * (1.0 - 1e-12)


@SOLVERS
def test_a_mirrored_scene_yields_a_rotation_all_the_same(solve):
    """Points stretched along x keep a best rotation when they are mirrored."""
    source = np.random.default_rng(7).normal(0.0, [3.0, 0.5], (50, 2))
    for theta in np.linspace(-PI, PI, 9):
        mirrored = source * [1.0, -1.0] @ transform(0.0, 0.0, theta)[:2, :2].T
        T = solve(source, mirrored)
        assert np.linalg.det(T[:2, :2]) == pytest.approx(1.0, abs=1e-14)
        np.testing.assert_allclose(T, align(source, mirrored), atol=1e-12)


@SOLVERS
def test_far_from_the_origin(solve):
    far = 1e6
    source, _, weights = problem(9, count=30)
    target = apply(transform(0.3, -0.2, 0.4), source)
    shift = transform(far, -far, 0.0)
    T = solve(apply(shift, source), apply(shift, target), weights)
    residual = apply(T, apply(shift, source)) - apply(shift, target)
    assert np.abs(residual).max() < 1e-14 * far
    assert to_xytheta(T)[2] == pytest.approx(0.4, abs=1e-15 * far)


@SOLVERS
@pytest.mark.parametrize(("scale", "factor"), [(1e-6, 1e9), (1e3, 1e-9)])
def test_neither_scale_nor_the_size_of_the_weights_is_judged(solve, scale, factor):
    source, target, weights = problem(10)
    expected = to_xytheta(solve(source, target, weights)) * [scale, scale, 1.0]
    T = solve(scale * source, scale * target, factor * weights)
    np.testing.assert_allclose(to_xytheta(T), expected, rtol=1e-11)


@SOLVERS
@given(seed=seeds)
def test_a_pair_without_weight_says_nothing_wherever_it_lies(solve, seed):
    source, target, weights = problem(seed)
    more = np.insert(source, 1, [1e9, 9.0], axis=0), np.insert(target, 1, [-1e9, 0.0], axis=0)
    T = solve(*more, np.insert(weights, 1, 0.0))
    np.testing.assert_array_equal(T, solve(source, target, weights))


LINE = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [4.0, 1.0]])
SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
SPOTS = [np.tile(place, (4, 1)) for place in [(0.0, 0.0), (0.1, 0.9), (1e6, -0.3)]]


@SOLVERS
@pytest.mark.parametrize(
    ("source", "target", "weights", "reason"),
    [
        (LINE[:1], LINE[:1], None, "points of 1 pairs coincide"),
        (LINE, LINE, [0, 0, 3, 0], "points of 4 pairs coincide"),
        (LINE, LINE, [0, 0, 0, 0], "all 4 weights are zero; relax"),
        (SQUARE, SQUARE * [1, -1], None, "every rotation fits these 4 pairs .* mirror"),
        (SQUARE + 9, SQUARE * [1, -1], None, "every rotation fits"),
        *(
            (spot, LINE, [0.5, 0.6, 0.8, 1.0], "weighted source points") for spot in SPOTS
        ),  # their mean may round
        *((LINE, spot, None, "weighted target points") for spot in SPOTS),
    ],
)
def test_pairs_that_leave_the_rotation_open(solve, source, target, weights, reason):
    with pytest.raises(DegenerateAlignmentError, match=reason):
        solve(source, target, weights)
