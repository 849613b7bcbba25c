"""From increments to poses: the matrix product, and its own inverse."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from labkit.odometry import increments_between, integrate, integrate_step
from labkit.se2 import from_xytheta, wrap
from labkit.support.errors import InvalidPointsError

PI = math.pi
rows = arrays(float, st.tuples(st.integers(0, 12), st.just(3)), elements=st.floats(-PI, PI))
poses = arrays(float, 3, elements=st.floats(-PI, PI))


def assert_same_poses(actual, expected, atol=1e-12):
    np.testing.assert_allclose(actual[..., :2], expected[..., :2], atol=atol)
    np.testing.assert_allclose(wrap(actual[..., 2] - expected[..., 2]), 0.0, atol=atol)


@given(rows, poses)
def test_integration_is_the_product_of_the_transforms(increments, start):
    T = from_xytheta(start)
    estimated = integrate(increments, start)
    assert estimated.shape == (len(increments) + 1, 3)
    for pose, increment in zip(estimated[1:], increments, strict=True):
        T = T @ from_xytheta(increment)
        np.testing.assert_allclose(from_xytheta(pose), T, atol=1e-12)
    assert ((estimated[1:, 2] > -PI) & (estimated[1:, 2] <= PI)).all()


@given(rows, poses)
def test_increments_come_back(increments, start):
    assert_same_poses(increments_between(integrate(increments, start)), increments)


def test_an_increment_is_in_the_robots_own_frame():
    """Turn left, then drive: the robot goes up. Drive, then turn: it went ahead."""
    turn, drive = [0.0, 0.0, PI / 2], [1.0, 0.0, 0.0]
    np.testing.assert_allclose(integrate([turn, drive])[-1], [0.0, 1.0, PI / 2], atol=1e-15)
    np.testing.assert_allclose(integrate([drive, turn])[-1], [1.0, 0.0, PI / 2], atol=1e-15)


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (integrate, ([1.0, 2.0, 3.0],), r"`increments` must be rows .*, got shape \(3,\)"),
        (integrate, ([[1.0, 2.0]],), r"`increments` must be rows .*, got shape \(1, 2\)"),
        (integrate, ([["a", 0, 0]],), r"`increments` must hold numbers, got \[\['a', 0, 0\]\]"),
        (integrate, ([[0, 0, 0], [1]],), "`increments` .*give rows"),
        (integrate, ([[math.nan, 0, 0]],), r"`increments` must be .* got \[nan, 0\.0, 0\.0\]"),
        (integrate, ([[0, 0, 0]], [0, 0]), r"`start` must have shape \(3,\), got \(2,\)"),
        (integrate_step, ([0, 0, math.inf], [0, 0, 0]), r"`pose` must be finite, got inf"),
        (
            integrate_step,
            ([0, 0, 0], [[0, 0, 0]]),
            r"`increment` must have shape \(3,\), got \(1, 3\)",
        ),
        (increments_between, ([0, 0, 0],), r"`poses` must be rows .*, got shape \(3,\)"),
        (increments_between, ([[0, 0, math.nan]],), "`poses` must be finite, .* at index 0"),
    ],
)
def test_bad_input(function, arguments, message):
    with pytest.raises(InvalidPointsError, match=message):
        function(*arguments)
