"""Nearest neighbours: the tree held against all distances."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.distance import cdist

from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.neighbors import NearestNeighbors, nearest_by_brute_force

# On a coarse lattice ties and duplicates are the rule.
lattice = arrays(
    float,
    st.tuples(st.integers(1, 40), st.just(2)),
    elements=st.integers(-3, 3).map(lambda k: 0.5 * k),
)
clouds = arrays(float, st.tuples(st.integers(1, 40), st.just(2)), elements=st.floats(-1e3, 1e3))


@given(st.one_of(lattice, clouds), st.one_of(lattice, clouds))
def test_tree_and_brute_force_agree_bit_for_bit(points, target):
    by_tree = NearestNeighbors(target, method="tree").query(points)
    by_force = NearestNeighbors(target, method="brute").query(points)
    np.testing.assert_array_equal(by_tree[0], by_force[0])
    assert by_tree[1].tobytes() == by_force[1].tobytes()


@given(lattice, lattice)
def test_of_equally_near_points_the_first_is_taken(points, target):
    index, distance = NearestNeighbors(target).query(points)
    table = cdist(points, target, "sqeuclidean")  # exact on the lattice
    np.testing.assert_array_equal(index, table.argmin(axis=1))
    np.testing.assert_array_equal(distance, np.sqrt(table.min(axis=1)))


@given(st.integers(0, 2**32 - 1), st.integers(1, 20))
def test_a_tree_of_points_that_are_there_many_times(seed, times):
    """Ties among fewer points than the tree is asked for, among as many, and among more."""
    rng = np.random.default_rng(seed)
    once = rng.normal(size=(30, 2))
    target = rng.permutation(np.tile(once, (times, 1)))
    points = once[:9] + rng.normal(0.0, 0.3, (9, 2)) * rng.integers(0, 2, (9, 1))
    index, _ = NearestNeighbors(target, "tree").query(points)
    np.testing.assert_array_equal(index, nearest_by_brute_force(points, target))


@pytest.mark.parametrize("method", ["tree", "brute"])
def test_distances_are_metres(method):
    index, distance = NearestNeighbors([[0.0, 0.0], [9.0, 9.0]], method).query([[3.0, 4.0]])
    assert (index[0], distance[0]) == (0, 5.0)


def test_brute_force_works_through_its_blocks():
    """2^20 distances at once: 600 × 3000 take two blocks."""
    rng = np.random.default_rng(0)
    points, target = rng.normal(size=(600, 2)), rng.normal(size=(3000, 2))
    expected = cdist(points, target).argmin(axis=1)
    np.testing.assert_array_equal(nearest_by_brute_force(points, target), expected)


@pytest.mark.parametrize(
    ("target", "points", "message"),
    [
        (np.empty((0, 2)), [[0, 0]], "`target` is empty"),
        ([[0, math.inf]], [[0, 0]], r"`target` must be finite, got \[0\.0, inf\] at index 0"),
        ([[0, 0]], [[math.nan, 0]], r"`points` must be finite, got \[nan, 0\.0\] at index 0"),
        ([[0, 0]], [0, 0], r"`points` must have shape \(N, 2\), got \(2,\)"),
    ],
)
def test_bad_points(target, points, message):
    with pytest.raises(InvalidPointsError, match=message):
        NearestNeighbors(target).query(points)


def test_unknown_method():
    message = "`method` must be one of tree, brute, got 'kd'"
    with pytest.raises(InvalidParameterError, match=message):
        NearestNeighbors([[0, 0]], "kd")
