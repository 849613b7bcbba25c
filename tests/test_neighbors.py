"""Nearest neighbours: three ways to search, held against all distances."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.distance import cdist

from labkit import neighbors
from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.neighbors import Follower, NearestNeighbors, nearest_by_brute_force
from labkit.se2 import apply, transform

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


@given(st.one_of(lattice, clouds), st.one_of(lattice, clouds))
def test_the_matrix_product_finds_points_that_are_as_near(points, target):
    """Not always the same ones: it rounds differently, by some 1e-16 of the coordinates."""
    _, by_product = NearestNeighbors(target, method="matrix").query(points)
    _, by_force = NearestNeighbors(target, method="brute").query(points)
    extent = max(np.abs(points).max(), np.abs(target).max())
    np.testing.assert_allclose(by_product**2, by_force**2, rtol=1e-12, atol=1e-14 * extent**2)


def test_the_matrix_product_agrees_on_real_scans(killian):
    """Measured ranges are rounded to centimetres, so ties happen: the distances agree."""
    for k in range(0, 3000, 100):
        newer, older = killian.scans[k + 1].points, killian.scans[k].points
        _, distance = NearestNeighbors(older, method="matrix").query(newer)
        _, least = NearestNeighbors(older, method="tree").query(newer)
        np.testing.assert_allclose(distance, least, rtol=1e-11, atol=1e-12)


steps = st.lists(
    st.tuples(*[st.sampled_from([0.0, 1e-9, 1e-3, 0.25, 0.5, 2.0])] * 3), min_size=1, max_size=6
)


@pytest.mark.parametrize("method", ["tree", "matrix"])
@given(st.one_of(lattice, clouds), st.one_of(lattice, clouds), steps)
def test_following_points_finds_what_asking_anew_finds(method, points, target, steps):
    """Through steps long, short and none at all, ties and duplicates included."""
    search = NearestNeighbors(target, method)
    follower = Follower(search)
    answers = []
    for step in steps:
        points = apply(transform(*step), points)
        answers.append((follower.nearest(points), search.nearest(points).copy()))
    for followed, asked in answers:  # no answer is overwritten by a later one
        np.testing.assert_array_equal(followed, asked)


def test_points_that_hardly_move_are_not_asked_about_again(monkeypatch):
    rng = np.random.default_rng(0)
    points, search = rng.uniform(-5.0, 5.0, (500, 2)), NearestNeighbors(rng.normal(size=(600, 2)))
    follower, asked, find = Follower(search), [], neighbors._nearest_by_tree

    def counted(some, *more):
        asked.append(len(some))
        return find(some, *more)

    monkeypatch.setattr(neighbors, "_nearest_by_tree", counted)
    for shift, most in ((0.0, 500), (1e-3, 50), (2e-3, 50), (5.0, 500)):
        asked.clear()
        index = follower.nearest(points + shift)
        assert sum(asked) <= most
        np.testing.assert_array_equal(index, nearest_by_brute_force(points + shift, search.target))
    assert sum(asked) > 400


@pytest.mark.parametrize(("points", "method"), [(450, "matrix"), (451, "tree")])
def test_the_size_chooses_the_method(points, method):
    target = np.random.default_rng(0).normal(size=(points, 2))
    assert NearestNeighbors(target, "auto").method == method


@pytest.mark.parametrize("cached", [1, 7 * 50, 1 << 20])
def test_queries_of_changing_size_share_one_search(cached, monkeypatch):
    """In blocks of one row, of seven, and all at once."""
    monkeypatch.setattr(neighbors, "_CACHED", cached)
    rng = np.random.default_rng(1)
    search = NearestNeighbors(rng.normal(size=(50, 2)), "matrix")
    for count in (7, 7, 30, 1, 30):
        points = rng.normal(size=(count, 2))
        expected = nearest_by_brute_force(points, search.target)
        np.testing.assert_array_equal(search.query(points)[0], expected)


@pytest.mark.parametrize("method", ["auto", "tree", "brute", "matrix"])
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
    with pytest.raises(
        InvalidParameterError, match="`method` must be one of auto, tree, brute, matrix, got 'kd'"
    ):
        NearestNeighbors([[0, 0]], "kd")
