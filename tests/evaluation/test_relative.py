"""Relative pose error: symmetries here, the comparison with evo in test_evo.py."""

import math

import numpy as np
import pytest

from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.evaluation import rpe

STRAIGHT = np.column_stack([np.arange(11.0), np.zeros(11), np.zeros(11)])


def scaled(factor):
    return STRAIGHT * [factor, 1.0, 1.0]


def test_metres_are_measured_along_the_reference():
    errors = rpe(scaled(2.0), STRAIGHT, delta=3.2, unit="metres")
    np.testing.assert_array_equal(errors.pairs, [[i, i + 3] for i in range(8)])
    np.testing.assert_allclose(errors.translation_errors, 3.0)


def test_a_stretch_out_of_tolerance_is_left_out():
    assert len(rpe(STRAIGHT, STRAIGHT, delta=3.4, unit="metres")) == 0
    assert len(rpe(STRAIGHT, STRAIGHT, delta=3.3, unit="metres")) == 8


def test_the_path_is_measured_around_corners():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]], dtype=float)
    np.testing.assert_array_equal(rpe(square, square, 4.0, "metres").pairs, [[0, 4]])


@pytest.mark.parametrize("unit", ["steps", "metres"])
def test_a_trajectory_that_is_too_short_has_no_number(unit):
    errors = rpe(STRAIGHT, STRAIGHT, delta=50, unit=unit)
    assert errors.pairs.shape == (0, 2)
    assert errors.translation.count == errors.rotation.count == 0
    assert math.isnan(errors.translation.mean)
    assert math.isnan(errors.rotation.rmse)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"delta": 0}, "`delta` must be a whole number of at least 1 step, got 0"),
        ({"delta": 1.5}, "`delta` must be a whole number of at least 1 step, got 1.5"),
        ({"delta": 0.0, "unit": "metres"}, r"`delta` must be in \(0, 1e\+09\] m, got 0.0"),
        ({"unit": "frames"}, '`unit` must be "steps" or "metres", got \'frames\''),
    ],
)
def test_parameters_out_of_range(settings, message):
    with pytest.raises(InvalidParameterError, match=message):
        rpe(STRAIGHT, STRAIGHT, **settings)


def test_lengths_must_agree():
    with pytest.raises(InvalidPointsError, match="same length, got 10 and 11 rows"):
        rpe(STRAIGHT[1:], STRAIGHT)
