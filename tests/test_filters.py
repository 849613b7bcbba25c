"""Filters: what stays, in which order, with which beams."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.distance import cdist

from labkit import Scan
from labkit.filters import Preprocessing, range_band, remove_isolated, voxel_downsample

clouds = arrays(float, st.tuples(st.integers(1, 30), st.just(2)), elements=st.floats(-5, 5))


def beam_scan(points):
    """A scan with beams, so that it shows which points survived."""
    return Scan(points=points, beams=np.arange(len(points)) + 100)


@given(clouds, st.floats(0.0, 3.0), st.floats(3.5, 8.0))
@example(np.array([[1.0, 0.0], [0.0, 2.0]]), 1.0, 2.0)
@example(np.empty((0, 2)), 1.0, 2.0)
def test_range_band_keeps_what_lies_within(points, low, high):
    kept = range_band(beam_scan(points), low, high)
    r = np.hypot(*points.T)
    np.testing.assert_array_equal(kept.beams - 100, np.flatnonzero((low <= r) & (r <= high)))
    np.testing.assert_array_equal(kept.points, points[kept.beams - 100])


@given(clouds, st.floats(0.05, 2.0))
@example(np.array([[-0.0, 0.01], [0.0, 0.02], [0.03, -0.0]]), 0.1)
@example(np.empty((0, 2)), 1.0)
def test_voxels_hold_one_centroid_each(points, size):
    thinned = voxel_downsample(beam_scan(points), size)
    cells = {}
    for beam, point in enumerate(points):
        cells.setdefault(tuple(np.floor(point / size)), []).append(beam)
    assert len(thinned) == len(cells)
    for row, members in enumerate(cells.values()):  # in the order of first entry
        np.testing.assert_allclose(thinned.points[row], points[members].mean(axis=0), atol=1e-14)
        assert thinned.beams[row] == 100 + members[0]


@pytest.mark.parametrize("far", [0.0, 9e8])
def test_voxels_of_no_extent_merge_only_equal_points(far):
    points = np.random.default_rng(4).uniform(far - 5.0, far + 5.0, (50, 2))
    thinned = voxel_downsample(beam_scan(np.vstack([points, points[7:9]])), 1e-20)
    np.testing.assert_array_equal(thinned.points, points)


def test_voxels_keep_the_measurement_and_the_stamp():
    scan = Scan.from_ranges([1.0, 1.0, 5.0], [0.0, 0.01, 1.0], stamp=3.0)
    thinned = voxel_downsample(scan, 0.6)
    assert len(thinned) == 2
    np.testing.assert_array_equal(thinned.beams, [0, 2])
    assert thinned.ranges is scan.ranges
    assert thinned.angles is scan.angles
    assert thinned.stamp == 3.0


@given(clouds, st.floats(0.05, 4.0))
@example(np.empty((0, 2)), 1.0)
def test_isolated_points_go(points, radius):
    kept = remove_isolated(beam_scan(points), radius)
    distances = cdist(points, points)
    np.fill_diagonal(distances, math.inf)
    assume((np.abs(distances - radius) > 1e-9).all())  # no verdict on a tie with the radius
    alone = (distances > radius).all(axis=1)
    np.testing.assert_array_equal(kept.beams - 100, np.flatnonzero(~alone))


STAGES = {
    "range_min": lambda scan: range_band(scan, 1.0),
    "range_max": lambda scan: range_band(scan, 0.0, 3.0),
    "voxel_size": lambda scan: voxel_downsample(scan, 0.2),
    "isolation_radius": lambda scan: remove_isolated(scan, 0.3),
}


@pytest.mark.parametrize("names", [*([name] for name in STAGES), [*STAGES]])
def test_preprocessing_is_the_filters_in_order_each_of_which_can_stand_alone(names):
    scan = beam_scan(np.random.default_rng(2).uniform(-4.0, 4.0, (300, 2)))
    values = {"range_min": 1.0, "range_max": 3.0, "voxel_size": 0.2, "isolation_radius": 0.3}
    at_once, by_hand = Preprocessing(**{name: values[name] for name in names})(scan), scan
    for name in names:
        bare, by_hand = STAGES[name](by_hand.points), STAGES[name](by_hand)
        np.testing.assert_array_equal(bare.points, by_hand.points)
    np.testing.assert_array_equal(at_once.points, by_hand.points)
    np.testing.assert_array_equal(at_once.beams, by_hand.beams)
    assert 0 < len(by_hand) < len(scan)
    assert Preprocessing()(scan) is scan
