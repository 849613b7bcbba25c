"""From increments to poses: the matrix product, and its own inverse."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from labkit.odometry import MapOdometry, increments_between, integrate, integrate_step
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


NAN = math.nan


@pytest.mark.parametrize(
    "rows", [[1, 2, 3], [[1, 2]], [["a", 0, 0]], [[0, 0, 0], [1]], [[NAN, 0, 0]]]
)
@pytest.mark.parametrize(
    ("name", "function"), [("increments", integrate), ("poses", increments_between)]
)
def test_rows_of_another_shape_are_refused_by_name(function, name, rows):
    with pytest.raises(InvalidPointsError, match=f"`{name}` "):
        function(rows)


@pytest.mark.parametrize("row", [[0, 0], [0, 0, math.inf], [[0, 0, 0]], "ahead"])
@pytest.mark.parametrize(
    ("name", "function"),
    [
        ("start", lambda row: integrate([[0, 0, 0]], row)),
        ("pose", lambda row: integrate_step(row, [0, 0, 0])),
        ("increment", lambda row: integrate_step([0, 0, 0], row)),
        ("prior", lambda row: MapOdometry().update([[1.0, 0.0]] * 3, row)),
    ],
)
def test_a_row_of_another_shape_is_refused_by_name(function, name, row):
    with pytest.raises(InvalidPointsError, match=f"`{name}` must"):
        function(row)
