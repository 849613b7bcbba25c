"""Nearest neighbours: four ways to search, held against all distances."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.distance import cdist

from labkit import products
from labkit.arrays import homogeneous
from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.neighbors import NearestNeighbors, nearest_by_brute_force
from labkit.scan import Scan
from labkit.se2 import apply, transform
from labkit.simulation import Lidar, cast, room

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


@pytest.mark.parametrize("method", ["matrix", "sweep"])
def test_one_point_far_off_spoils_no_other(method):
    """All distances are taken from amid the points, for a product rounds by their squares."""
    rng = np.random.default_rng(0)
    target = rng.uniform(-5.0, 5.0, (300, 2))
    points = rng.uniform(-5.0, 5.0, (100, 2))
    target[150] = 1e9
    index, _ = NearestNeighbors(target, method).query(points)
    np.testing.assert_array_equal(index, nearest_by_brute_force(points, target))


@pytest.mark.parametrize("method", ["matrix", "sweep"])
@given(st.one_of(lattice, clouds), st.one_of(lattice, clouds))
def test_products_find_points_that_are_as_near(method, points, target):
    """Not always the same ones: they round differently, by some 1e-16 of the coordinates."""
    _, by_product = NearestNeighbors(target, method=method).query(points)
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


@pytest.mark.parametrize("method", ["tree", "matrix", "sweep", "brute"])
@given(st.one_of(lattice, clouds), st.one_of(lattice, clouds), steps)
def test_following_points_finds_what_asking_anew_finds(method, points, target, steps):
    """Through steps long, short and none at all, ties and duplicates included."""
    search = NearestNeighbors(target, method)
    answers, before = [], None
    for step in steps:
        points = apply(transform(*step), points)
        columns = homogeneous(points - search.center.T)
        before = search.nearest_to_columns(columns, before)
        answers.append((before, search.nearest_to_columns(columns).copy()))
    for followed, asked in answers:  # no answer is overwritten by a later one
        np.testing.assert_array_equal(followed, asked)


@pytest.mark.parametrize(
    ("points", "in_order", "method"),
    [
        (450, True, "matrix"),
        (451, True, "sweep"),
        (10_000, True, "sweep"),
        (10_001, True, "tree"),
        (700, False, "matrix"),
        (701, False, "tree"),
    ],
)
def test_size_and_order_choose_the_method(points, in_order, method):
    target = Scan(
        points=np.random.default_rng(0).normal(size=(points, 2)),
        beams=np.arange(points) if in_order else None,
    )
    assert NearestNeighbors(target, "auto").method == method


@pytest.mark.parametrize("shift", [0.0, 0.01, 1.0])
@pytest.mark.parametrize("ordered", [True, False])
def test_a_sweep_is_searched_as_brute_force_would(shift, ordered):
    """With partners from before or without, good ones or bad ones, in any order and number."""
    rng = np.random.default_rng(2)
    lidar = Lidar(beam_count=1000, field_of_view=4.7)
    target, source = (cast(room(), transform(x, 0.0, x), lidar, rng=rng).points for x in (0.0, 0.1))
    source = source + shift
    if not ordered:
        target, source = rng.permutation(target), rng.permutation(source)
    search = NearestNeighbors(target, "sweep")
    expected = nearest_by_brute_force(source, search.target)
    columns = homogeneous(source - search.center.T)
    any_of_them = rng.integers(0, len(target), len(source))
    for before in (None, expected, expected[::-1], expected[::7], expected[:3], any_of_them):
        np.testing.assert_array_equal(search.nearest_to_columns(columns, before), expected)
    np.testing.assert_array_equal(search.query(source)[0], expected)


def test_a_sweep_leaves_out_what_is_far_away(monkeypatch):
    """A tenth of all distances is looked at, where the scans overlap."""
    rng = np.random.default_rng(3)
    lidar = Lidar(beam_count=2000)
    target, source = (cast(room(), np.eye(3), lidar, rng=rng).points for _ in range(2))
    search, looked = NearestNeighbors(target, "sweep"), []

    class Counted(np.ndarray):
        def __matmul__(self, other):
            looked.append(self.shape[0] * other.shape[1])
            return np.asarray(self) @ np.asarray(other)

    columns = homogeneous(source - search.center.T)
    search.nearest_to_columns(columns.view(Counted))
    assert 0 < sum(looked) < 0.1 * len(source) * len(target)


@pytest.mark.parametrize("cached", [1, 7 * 50, 1 << 20])
def test_queries_of_changing_size_share_one_search(cached, monkeypatch):
    """In blocks of one row, of seven, and all at once."""
    monkeypatch.setattr(products, "_CACHED", cached)
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
    message = "`method` must be one of auto, tree, brute, matrix, sweep, got 'kd'"
    with pytest.raises(InvalidParameterError, match=message):
        NearestNeighbors([[0, 0]], "kd")
