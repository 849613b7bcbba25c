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


def test_wrap_leaves_an_angle_inside_bit_for_bit_takes_the_half_turn_as_plus_pi_and_keeps_nan():
    np.testing.assert_array_equal(wrap([-PI, PI, 3 * PI, -3 * PI, math.nan]), [PI] * 4 + [math.nan])
    inside = np.array([angle for angle in ANGLES if angle != -PI])
    assert wrap(inside).tobytes() == inside.tobytes()
    assert np.array([wrap(angle) for angle in inside]).tobytes() == inside.tobytes()


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


def test_a_rotation_is_proper_and_comes_back():
    """A rotation by θ takes (1, 0) to (cos θ, sin θ): counter-clockwise."""
    for angle in ANGLES:
        R = rotation(angle)
        np.testing.assert_array_equal(R[:, 0], [math.cos(angle), math.sin(angle)])
        np.testing.assert_allclose(R @ R.T, np.eye(2), atol=1e-15)
        assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-15)
        back = to_xytheta(transform(0.0, 0.0, angle))[2]
        assert -PI < back <= PI
        assert abs(wrap(back - angle)) <= np.spacing(PI)


@given(poses, poses, poses)
def test_the_group_laws(first, second, third):
    A, B, C = map(from_xytheta, (first, second, third))
    size = 1.0 + np.abs([first, second, third]).max()
    np.testing.assert_allclose((A @ B) @ C, A @ (B @ C), atol=1e-14 * size)
    np.testing.assert_allclose(invert(A) @ A, np.eye(3), atol=1e-14 * size)
    np.testing.assert_allclose(A @ invert(A), np.eye(3), atol=1e-14 * size)
    np.testing.assert_allclose(invert(A @ B), invert(B) @ invert(A), atol=1e-14 * size)
    np.testing.assert_array_equal(compose(A, B, C), A @ B @ C)
    np.testing.assert_array_equal(compose(), np.eye(3))
    np.testing.assert_allclose(A @ relative(A, B), B, atol=1e-14 * size)
    np.testing.assert_array_equal(invert(invert(A))[:2, :2], A[:2, :2])


@given(poses, poses)
def test_apply_is_an_action_of_the_group(first, second):
    A, B = from_xytheta(first), from_xytheta(second)
    points = np.array([[0.0, 0.0], [1.0, 0.0], [-2.5, 7.0]])
    size = 10.0 + np.abs([first, second]).max()
    np.testing.assert_allclose(apply(A, apply(B, points)), apply(A @ B, points), atol=1e-14 * size)
    np.testing.assert_array_equal(apply(np.eye(3), points), points)
    homogeneous = np.column_stack([points, np.ones(3)]) @ A.T
    np.testing.assert_allclose(apply(A, points), homogeneous[:, :2], atol=1e-14 * size)


@pytest.mark.parametrize("shape", [(), (1,), (5,), (2, 3), (0,)])
def test_stacks_go_through_every_function(shape):
    rng = np.random.default_rng(1)
    rows = rng.uniform(-3.0, 3.0, (*shape, 3))
    T = from_xytheta(rows)
    points = rng.uniform(-1.0, 1.0, (4, 2))
    for result in (T, invert(T), relative(T, T), compose(T, T)):
        assert result.shape == (*shape, 3, 3)
    assert to_xytheta(T).shape == (*shape, 3)
    assert rotation(rows[..., 2]).shape == (*shape, 2, 2)
    assert wrap(rows[..., 2]).shape == shape
    assert apply(T, points).shape == (*shape, 4, 2)
    for place in np.ndindex(shape):
        np.testing.assert_array_equal(T[place], transform(*rows[place]))
        np.testing.assert_array_equal(invert(T)[place], invert(T[place]))
        np.testing.assert_array_equal(to_xytheta(T)[place], to_xytheta(T[place]))
        np.testing.assert_array_equal(rotation(rows[..., 2])[place], rotation(rows[place][2]))
        np.testing.assert_allclose(apply(T, points)[place], apply(T[place], points), atol=1e-15)


@pytest.mark.parametrize("kind", [np.float32, np.int64, np.longdouble])
def test_numbers_of_any_kind_become_float64(kind):
    rows = np.array([[1, 2, 0], [3, 4, 1]], dtype=kind)
    T = np.array([[0, -1, 5], [1, 0, 6], [0, 0, 1]], dtype=kind)
    for row in (rows, rows[0]):
        results = from_xytheta(row), rotation(row), wrap(row)
        assert {each.dtype for each in results} == {np.dtype(float)}
    results = to_xytheta(T), compose(T), invert(T), relative(T, T), apply(T, rows[:, :2])
    assert {each.dtype for each in results} == {np.dtype(float)}
