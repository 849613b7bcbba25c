"""Surveyed relations: exact for the truth, blind to the map's frame."""

import math

import numpy as np
import pytest

from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.evaluation import Relations, relation_errors
from labkit.se2 import from_xytheta, relative, to_xytheta

RNG = np.random.default_rng(0)
POSES = np.column_stack([RNG.uniform(-9.0, 9.0, (20, 2)), RNG.uniform(-4.0, 4.0, 20)])
STAMPS = 1000.0 + 0.2 * np.arange(20)
ENDS = np.array([[0, 1], [3, 2], [7, 19], [2, 7]])


def survey(ends=ENDS, by_stamp=False):
    T = from_xytheta(POSES)
    increments = to_xytheta(relative(T[ENDS[:, 0]], T[ENDS[:, 1]]))
    return Relations(ends=ends, by_stamp=by_stamp, increments=increments)


def test_the_truth_has_no_error_in_any_frame():
    moved = to_xytheta(from_xytheta([5.0, 6.0, 2.0]) @ from_xytheta(POSES))
    for poses in (POSES, moved):
        errors = relation_errors(survey(), poses)
        assert errors.translation.max < 1e-13
        assert errors.rotation.max < 1e-13
        assert errors.unmatched == 0
        np.testing.assert_array_equal(errors.pairs, ENDS)


def test_stamps_find_the_nearest_pose_in_any_order():
    order = RNG.permutation(20)
    relations = survey(STAMPS[ENDS] + 0.03, by_stamp=True)
    errors = relation_errors(relations, POSES[order], STAMPS[order])
    assert errors.translation.max < 1e-13
    np.testing.assert_array_equal(order[errors.pairs], ENDS)


def test_an_error_is_the_relation_undone():
    relations = Relations(ends=[[0, 1]], by_stamp=False, increments=[[1.0, 0.0, 0.1]])
    errors = relation_errors(relations, [[0.0, 0.0, 0.0], [1.0, 2.0, -0.2]])
    np.testing.assert_allclose(errors.translation_errors, [2.0])
    np.testing.assert_allclose(errors.rotation_errors, [0.3])


def test_what_the_trajectory_does_not_cover_is_counted():
    by_index = relation_errors(survey(), POSES[:6])
    np.testing.assert_array_equal(by_index.found, [True, True, False, False])
    relations = survey(STAMPS[ENDS], by_stamp=True)
    by_stamp = relation_errors(relations, POSES[:6], STAMPS[:6])
    np.testing.assert_array_equal(by_stamp.found, by_index.found)
    assert by_index.unmatched == by_stamp.unmatched == 2
    assert len(by_stamp) == 2


@pytest.mark.parametrize("beyond", [20, 2.0**31, 2.0**63, 1e19, 1e30, 1e300])
def test_no_index_is_too_large_to_be_missing(beyond):
    ends = np.array([[0, 1], [beyond, 2], [7, beyond], [beyond, beyond]])
    np.testing.assert_array_equal(
        relation_errors(survey(ends), POSES).found, [True, False, False, False]
    )


def test_without_a_match_there_is_no_number():
    relations = survey(STAMPS[ENDS] + 0.1, by_stamp=True)
    errors = relation_errors(relations, POSES, STAMPS, tolerance=0.01)
    assert errors.unmatched == len(relations) == 4
    assert errors.translation.count == 0
    assert math.isnan(errors.translation.mean)


@pytest.mark.parametrize(
    ("stamps", "message"),
    [
        (None, "these relations name times; give the `stamps` of the poses"),
        (STAMPS[:3], r"`stamps` must have shape \(20,\), one per pose, got \(3,\)"),
        ([math.nan] * 20, "`stamps` must be finite, got nan at index 0"),
    ],
)
def test_stamps_that_cannot_be_meant(stamps, message):
    with pytest.raises(InvalidPointsError, match=message):
        relation_errors(survey(STAMPS[ENDS], by_stamp=True), POSES, stamps)


def test_tolerance_out_of_range():
    with pytest.raises(InvalidParameterError, match=r"`tolerance` must be in \[0, inf\] s, got -1"):
        relation_errors(survey(), POSES, tolerance=-1)


@pytest.mark.parametrize(
    ("ends", "message"),
    [
        ([[0, 1]], r"`ends` must be finite and of shape \(4, 2\), one row per increment, got"),
        (ENDS + 0.5, "`ends` must be 0-based scan indices; give by_stamp=True"),
        (ENDS - 1, "`ends` must be 0-based scan indices; give by_stamp=True"),
    ],
)
def test_ends_that_cannot_be_meant(ends, message):
    with pytest.raises(InvalidPointsError, match=message):
        survey(ends)
