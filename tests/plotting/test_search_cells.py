"""The cells tile the plane, hold the points, and those shaded hold the nearest one."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.patches import Circle, Rectangle

from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.neighbors import nearest_by_brute_force
from labkit.plotting import plot_search_cells
from labkit.plotting.search_cells import search_cells

POINTS = np.random.default_rng(1).uniform([-3.0, 0.0], [5.0, 2.0], (64, 2))


@pytest.mark.parametrize("depth", [0, 1, 4, 6])
def test_cells_share_the_points_evenly_and_tile_their_box(depth):
    boxes = list(search_cells(POINTS, depth))
    assert len(boxes) == 2**depth
    inside = np.array([((low <= POINTS) & (high > POINTS)).all(axis=1) for low, high in boxes])
    assert (inside.sum(axis=0) == 1).all()
    assert (inside.sum(axis=1) == 64 // 2**depth).all()
    (whole,) = search_cells(POINTS, 0)
    area = sum(np.prod(high - low) for low, high in boxes)
    assert area == pytest.approx(np.prod(whole[1] - whole[0]))


def test_a_cell_of_one_point_is_not_cut():
    assert len(list(search_cells(POINTS[:5], 20))) == 5
    assert len(list(search_cells(np.ones((3, 2)), 20))) <= 3


def test_a_cut_goes_across_the_longer_extent_of_the_points_not_of_the_cell():
    """Two columns of points: the left cell is wider than high, its points are not."""
    columns = np.array([[x, y] for x in (0.0, 10.0) for y in (0.0, 1.0, 2.0, 3.0)])
    wide = list(search_cells(columns, 1))
    width, height = wide[0][1] - wide[0][0]
    assert width > height
    halves = list(search_cells(columns, 2))
    assert len(halves) == 4
    assert {(low[0], high[0]) for low, high in halves} == {(low[0], high[0]) for low, high in wide}


@pytest.mark.parametrize("seed", range(3))
def test_the_nearest_point_lies_in_a_shaded_cell(ax, seed):
    query = np.random.default_rng(seed).uniform([-4.0, -1.0], [6.0, 3.0])
    plot_search_cells(ax, POINTS, 5, query)
    nearest = POINTS[nearest_by_brute_force(query[None], POINTS)[0]]
    shaded = [
        patch.get_bbox()
        for patch in ax.patches
        if isinstance(patch, Rectangle) and patch.get_facecolor() != to_rgba("none")
    ]
    assert 1 <= len(shaded) < 32
    assert any(box.contains(*nearest) for box in shaded)
    assert ax.get_title() == f"32 cells, {len(shaded)} to open"
    (circle,) = (patch for patch in ax.patches if isinstance(patch, Circle))
    assert circle.radius == pytest.approx(np.hypot(*(nearest - query)))


@pytest.mark.parametrize(
    ("points", "depth", "query", "error", "message"),
    [
        (POINTS, -1, None, InvalidParameterError, "`depth` must be a whole number"),
        (POINTS, 1, [1, 2, 3], InvalidPointsError, r"`query` must be one point .* shape \(3,\)"),
    ],
)
def test_what_cannot_be_meant(ax, points, depth, query, error, message):
    with pytest.raises(error, match=message):
        plot_search_cells(ax, points, depth, query)
