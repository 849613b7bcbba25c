"""SE(2): a group, at every angle, in every batch."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.se2 import (
    apply,
    compose,
    from_xytheta,
    invert,
    relative,
    rotation,
    to_xytheta,
    transform,
    wrap,
)

PI = math.pi
INSIDE = [math.nextafter(-PI, 0.0), math.nextafter(PI, 0.0), 1e-300, -1e-300, 1e-16, -1e-12]
ANGLES = [*INSIDE, *np.linspace(-PI, PI, 17)]

angles = st.floats(-PI, PI)
metres = st.floats(-1e3, 1e3)
poses = st.tuples(metres, metres, angles).map(np.array)


def test_wrap_leaves_an_angle_inside_the_interval_bit_for_bit():
    inside = np.array([angle for angle in ANGLES if angle != -PI])

    one_by_one = np.array([wrap(angle) for angle in inside])

    assert wrap(inside).tobytes() == inside.tobytes()
    assert one_by_one.tobytes() == inside.tobytes()


def test_wrap_takes_the_half_turn_as_plus_pi_and_keeps_nan():
    wrapped = wrap([-PI, PI, 3 * PI, -3 * PI, math.nan])

    np.testing.assert_array_equal(wrapped, [PI, PI, PI, PI, math.nan])


@pytest.mark.parametrize("towards", [-math.inf, math.inf])
def test_wrap_lands_in_the_interval_around_every_cut(towards):
    cuts = (2 * np.array([*range(-50, 51), 10**6, -(10**6)]) + 1) * PI
    for _ in range(5):
        wrapped = wrap(cuts)
        assert ((wrapped > -PI) & (wrapped <= PI)).all()
        cuts = np.nextafter(cuts, towards)


@given(st.floats(-1e6, 1e6))
def test_wrap_takes_away_whole_turns(angle):
    wrapped = float(wrap(angle))
    assert -PI < wrapped <= PI
    turns = (angle - wrapped) / (2 * PI)
    assert turns == pytest.approx(round(turns), abs=1e-9)
    assert wrap(wrapped) == wrapped


@pytest.mark.parametrize("angle", ANGLES)
def test_a_rotation_is_proper_and_counter_clockwise(angle):
    R = rotation(angle)

    np.testing.assert_array_equal(R[:, 0], [math.cos(angle), math.sin(angle)])
    np.testing.assert_allclose(R @ R.T, np.eye(2), atol=1e-15)
    assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_an_angle_comes_back_from_a_transform(angle):
    theta = to_xytheta(transform(0.0, 0.0, angle))[2]

    assert -PI < theta <= PI
    assert abs(wrap(theta - angle)) <= np.spacing(PI)


def assert_same(actual, expected, *rows):
    """Equal but for rounding, which grows with the numbers in the rows (x, y, θ)."""
    size = 1.0 + max(np.abs(row).max() for row in rows)
    np.testing.assert_allclose(actual, expected, atol=1e-14 * size)


@given(poses, poses, poses)
def test_composition_is_associative(row_a, row_b, row_c):
    A, B, C = map(from_xytheta, (row_a, row_b, row_c))

    assert_same((A @ B) @ C, A @ (B @ C), row_a, row_b, row_c)
    np.testing.assert_array_equal(compose(A, B, C), A @ B @ C)


def test_nothing_composed_is_the_identity():
    np.testing.assert_array_equal(compose(), np.eye(3))


@given(poses)
def test_a_transform_and_its_inverse_make_the_identity(row):
    A = from_xytheta(row)

    assert_same(invert(A) @ A, np.eye(3), row)
    assert_same(A @ invert(A), np.eye(3), row)
    np.testing.assert_array_equal(invert(invert(A))[:2, :2], A[:2, :2])


@given(poses, poses)
def test_the_inverse_of_a_product_is_the_product_of_the_inverses_in_reverse(row_a, row_b):
    A, B = from_xytheta(row_a), from_xytheta(row_b)

    assert_same(invert(A @ B), invert(B) @ invert(A), row_a, row_b)


@given(poses, poses)
def test_a_relative_pose_leads_from_the_first_to_the_second(row_a, row_b):
    A, B = from_xytheta(row_a), from_xytheta(row_b)

    assert_same(A @ relative(A, B), B, row_a, row_b)


POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [-2.5, 7.0]])


@given(poses, poses)
def test_applying_two_transforms_applies_their_product(row_a, row_b):
    A, B = from_xytheta(row_a), from_xytheta(row_b)

    assert_same(apply(A, apply(B, POINTS)), apply(A @ B, POINTS), row_a, row_b, 10.0)


@given(poses)
def test_to_apply_is_to_multiply_homogeneous_coordinates(row):
    A = from_xytheta(row)
    homogeneous = np.column_stack([POINTS, np.ones(3)])

    assert_same(apply(A, POINTS), (homogeneous @ A.T)[:, :2], row, 10.0)


def test_the_identity_moves_no_point():
    np.testing.assert_array_equal(apply(np.eye(3), POINTS), POINTS)


@pytest.mark.parametrize("shape", [(), (1,), (5,), (2, 3), (0,)])
def test_a_stack_goes_through_every_function(shape):
    rows = np.random.default_rng(1).uniform(-3.0, 3.0, (*shape, 3))
    T = from_xytheta(rows)

    assert {stack.shape for stack in (T, invert(T), relative(T, T), compose(T, T))} == {
        (*shape, 3, 3)
    }
    assert to_xytheta(T).shape == (*shape, 3)
    assert rotation(rows[..., 2]).shape == (*shape, 2, 2)
    assert wrap(rows[..., 2]).shape == shape
    assert apply(T, POINTS).shape == (*shape, 3, 2)


@pytest.mark.parametrize("shape", [(5,), (2, 3)])
def test_a_stack_is_its_entries_one_by_one(shape):
    rows = np.random.default_rng(1).uniform(-3.0, 3.0, (*shape, 3))
    T = from_xytheta(rows)

    for place in np.ndindex(shape):
        np.testing.assert_array_equal(T[place], transform(*rows[place]))
        np.testing.assert_array_equal(invert(T)[place], invert(T[place]))
        np.testing.assert_array_equal(to_xytheta(T)[place], to_xytheta(T[place]))
        np.testing.assert_array_equal(rotation(rows[..., 2])[place], rotation(rows[place][2]))
        np.testing.assert_allclose(apply(T, POINTS)[place], apply(T[place], POINTS), atol=1e-14)


@pytest.mark.parametrize("kind", [np.float32, np.int64, np.longdouble])
def test_numbers_of_any_kind_become_float64(kind):
    rows = np.array([[1, 2, 0], [3, 4, 1]], dtype=kind)
    T = np.array([[0, -1, 5], [1, 0, 6], [0, 0, 1]], dtype=kind)
    for row in (rows, rows[0]):
        results = from_xytheta(row), rotation(row), wrap(row)
        assert {each.dtype for each in results} == {np.dtype(float)}
    results = to_xytheta(T), compose(T), invert(T), relative(T, T), apply(T, rows[:, :2])
    assert {each.dtype for each in results} == {np.dtype(float)}
