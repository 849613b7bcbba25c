"""Scans: which beams make points, and what is refused at the door."""

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit import Scan
from labkit.scan import scanner_poses
from labkit.se2 import from_xytheta
from labkit.support.errors import InvalidParameterError, InvalidPointsError

NAN, INF = math.nan, math.inf


def test_points_stand_where_the_beams_ended():
    angles = np.radians([-90.0, 0.0, 30.0, 90.0])
    scan = Scan.from_ranges([2.0, 3.0, 2.0, 1.0], angles, stamp=7.5)
    expected = [[0.0, -2.0], [3.0, 0.0], [math.sqrt(3.0), 1.0], [0.0, 1.0]]
    np.testing.assert_allclose(scan.points, expected, atol=1e-15)
    assert (scan.stamp, len(scan)) == (7.5, 4)


@pytest.mark.parametrize(
    ("lost", "band"),
    [
        *((lost, {"range_min": 0.5, "range_max": 8.0}) for lost in (NAN, INF, -INF, 0.5, 8.0)),
        *((lost, {}) for lost in (0.0, 1e5, np.finfo(np.float32).max)),  # the last are codes
    ],
)
def test_a_range_not_strictly_inside_the_band_is_no_return(lost, band):
    scan = Scan.from_ranges([1.0, lost, 2.0], [0.0, 0.1, 0.2], **band)
    np.testing.assert_array_equal(scan.beams, [0, 2])
    np.testing.assert_array_equal(scan.ranges, [1.0, lost, 2.0])


@pytest.mark.parametrize("dtype", [float, int])
def test_a_masked_range_is_no_return(dtype):
    ranges = np.ma.array([1, 9, 2], mask=[False, True, False], dtype=dtype)
    scan = Scan.from_ranges(ranges, [0.0, 0.1, 0.2])
    np.testing.assert_array_equal(scan.beams, [0, 2])
    np.testing.assert_array_equal(scan.ranges, [1.0, NAN, 2.0])


def test_what_lies_under_a_mask_is_no_point():
    points = np.ma.array([[1.0, 2.0], [1e9, 3.0]], mask=[[False, False], [True, False]])
    with pytest.raises(InvalidPointsError, match=r"`points` .* masked first at \[1, 0\]; drop"):
        Scan.from_points(points)
    assert Scan.from_points(points[:1]).points.tolist() == [[1.0, 2.0]]


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=20))
def test_points_and_beams_go_together(ranges):
    angles = np.linspace(-2.0, 2.0, len(ranges))
    scan = Scan.from_ranges(ranges, angles, range_max=1e3)
    assert len(scan) == len(scan.beams) == sum(0.0 < r < 1e3 for r in ranges)
    np.testing.assert_allclose(np.hypot(*scan.points.T), scan.ranges[scan.beams], rtol=1e-14)


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=20))
def test_a_scan_from_ranges_passes_the_checks_of_a_scan_made_by_its_parts(ranges):
    scan = Scan.from_ranges(ranges, np.linspace(-2.0, 2.0, len(ranges)), stamp=2.5)

    made_by_parts = Scan(**vars(scan))

    for name, values in vars(scan).items():
        np.testing.assert_array_equal(getattr(made_by_parts, name), values)


def test_select_takes_points_with_their_beams():
    scan = Scan.from_ranges([1.0, INF, 2.0, 3.0], [0.0, 0.1, 0.2, 0.3], stamp=1.0)
    for kept in (np.array([False, True, True]), np.array([1, 2])):
        part = scan.select(kept)
        np.testing.assert_array_equal(part.points, scan.points[1:])
        np.testing.assert_array_equal(part.beams, [2, 3])
        assert part.ranges is scan.ranges
        assert part.stamp == 1.0
    assert Scan.from_points([[1.0, 2.0], [3.0, 4.0]]).select(np.array([1])).beams is None


ARRAYS = ("points", "beams", "ranges", "angles")


def test_the_arrays_that_a_scan_is_made_of_may_change():
    arrays = {
        "points": np.ones((2, 2)),
        "beams": np.array([0, 2]),
        "ranges": np.ones(3),
        "angles": np.zeros(3),
    }
    scan = Scan(**arrays)

    for name, values in arrays.items():
        values[:] = 7
        assert not (getattr(scan, name) == 7).any()


def test_nobody_changes_a_scan_through_a_read_only_view():
    ranges = np.ones(3)
    view = ranges[:]
    view.flags.writeable = False
    scan = Scan(points=[[1.0, 0.0]], ranges=view)

    ranges[:] = 7

    assert scan.ranges.tolist() == [1.0, 1.0, 1.0]


MEASURED = Scan.from_ranges([1.0, 2.0], [0.0, 0.1])


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize(
    "scan",
    [
        MEASURED,
        Scan(**vars(MEASURED)),
        MEASURED.select(np.array([0])),
        pickle.loads(pickle.dumps(MEASURED)),
        copy.deepcopy(MEASURED),
    ],
    ids=["from ranges", "by parts", "selected", "unpickled", "copied"],
)
def test_nobody_writes_to_the_arrays_of_a_scan(scan, name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(scan, name)[...] = 7


@pytest.mark.parametrize("name", ARRAYS)
def test_an_unpickled_scan_holds_what_was_pickled(name):
    unpickled = pickle.loads(pickle.dumps(MEASURED))

    np.testing.assert_array_equal(getattr(unpickled, name), getattr(MEASURED, name))


def test_a_scan_says_what_it_is_in_a_line():
    scan = Scan.from_ranges([1.0, INF], [0.0, 0.1], stamp=2.5)
    assert repr(scan) == "Scan(1 points of 2 beams, 2.5 s)"
    assert repr(Scan.from_points([[1.0, 2.0]])) == "Scan(1 points)"
    for stamp in (None, "now", [1.0]):
        with pytest.raises(InvalidParameterError, match="`stamp` must be a time in seconds"):
            Scan(points=[[1.0, 2.0]], stamp=stamp)


@given(
    robot=st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-3, 3)),
    offset=st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3)),
)
def test_poses_of_the_scanner_are_composed_on_the_right(robot, offset):
    (pose,) = scanner_poses([robot], offset)
    T = from_xytheta(robot) @ from_xytheta(offset)
    np.testing.assert_allclose(from_xytheta(pose), T, atol=1e-12)
    np.testing.assert_array_equal(scanner_poses([robot], (0, 0, 0)), [robot])
