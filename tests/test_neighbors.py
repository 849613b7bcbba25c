"""Nearest neighbours: the grid held against all distances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from labkit.neighbors import (
    NearestNeighbors,
    Search,
    nearest,
    nearest_by_brute_force,
    neighbors_of,
)

sizes, seeds = st.tuples(st.integers(1, 40), st.just(2)), st.integers(0, 2**32 - 1)
# On a coarse lattice ties and duplicates are the rule.
lattice = arrays(float, sizes, elements=st.integers(-3, 3).map(lambda k: 0.5 * k))
clouds = arrays(float, sizes, elements=st.floats(-1e3, 1e3))


def wall(seed, count):
    """A wall and a few returns far off, as a scanner sees them: most cells are empty."""
    far = np.random.default_rng(seed).normal(0.0, 80.0, (3, 2))
    return np.vstack([np.column_stack([np.linspace(-5.0, 5.0, count), np.full(count, 2.0)]), far])


scenes = st.one_of(lattice, clouds, st.builds(wall, seeds, st.integers(1, 300)))


def squared_distances(points, target):
    """All squared distances, (N, M), by the sums that the grid computes."""
    dx, dy = (points[:, None] - target).transpose(2, 0, 1)
    return dx * dx + dy * dy


@given(scenes, scenes)
def test_grid_and_brute_force_agree_bit_for_bit(points, target):
    index, distance = NearestNeighbors(target).query(points)
    np.testing.assert_array_equal(index, nearest_by_brute_force(points, target))
    np.testing.assert_array_equal(distance, np.sqrt(squared_distances(points, target).min(axis=1)))


@given(scenes, scenes, st.sampled_from([0.1, 0.5, 3.0, 1e4]), seeds)
def test_what_a_search_remembers_changes_no_answer(points, target, reach, seed):
    """It ends at its reach, and keeps a partner only where no other point can be nearer."""
    rng = np.random.default_rng(seed)
    count = len(points)
    candidates = rng.integers(len(target), size=(count, 2))
    grid = NearestNeighbors(target).grid
    search = Search(grid, candidates, np.zeros((count, 2)), np.zeros(count))

    for step in (0.0, 0.5, 0.1, 0.01, 0.001, 0.0):
        points = points + step * rng.normal(size=points.shape)
        index, distance = nearest(points, search, reach)

        squares = squared_distances(points, target)
        is_near = squares.min(axis=1) <= reach**2
        expected_index = np.where(is_near, squares.argmin(axis=1), -1)
        expected_distance = np.where(is_near, np.sqrt(squares.min(axis=1)), np.inf)
        np.testing.assert_array_equal(index, expected_index)
        np.testing.assert_array_equal(distance, expected_distance)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.45])
def test_no_cell_holds_most_points_whatever_outliers_there_are(share):
    """Else each search looks at all of them."""
    rng = np.random.default_rng(0)
    points = np.vstack([wall(0, 700), rng.normal(0.0, 1e5, (int(700 * share / (1.0 - share)), 2))])

    grid = NearestNeighbors(rng.permutation(points)).grid

    assert np.diff(grid.start).max() < 0.25 * len(points)


def test_points_that_coincide_are_one_entry():
    points = np.repeat(wall(0, 30), 50, axis=0)

    grid = NearestNeighbors(points).grid

    np.testing.assert_array_equal(np.sort(grid.rows), np.arange(0, len(points), 50))


@given(scenes, st.sampled_from([0.1, 0.5, 1e4]), st.floats(0.0, 1e3))
def test_the_nearest_few_are_found_in_order(target, reach, radius):
    grid = NearestNeighbors(target).grid
    rows = np.empty(7, np.intp)
    squares = np.empty(7)

    for x, y in target[:10] + 0.01:
        count = neighbors_of(x, y, grid, reach, radius, rows, squares)

        all_squares = squared_distances(np.array([[x, y]]), target)[0]
        places = np.unique(target, axis=0, return_index=True)[1]  # the first row at each
        order = places[np.lexsort([places, all_squares[places]])]
        expected = [k for k in order if all_squares[k] <= reach**2][:7]
        np.testing.assert_array_equal(rows[:count], expected)
        np.testing.assert_array_equal(squares[:count], all_squares[expected])
