"""Answers are read whatever form they come in, and refused in words."""

import numpy as np
import pytest

from labkit.grading.judge.kinds import Unreadable, read
from labkit.grading.questions import Answer

R = ((0.0, -1.0), (1.0, 0.0))
T = np.array([[0.0, -1.0, 2.0], [1.0, 0.0, 3.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    "value",
    [
        T,
        tuple(map(tuple, T.tolist())),
        (R, (2, 3)),
        (np.array(R), np.array([[2.0], [3.0]])),
        (R, ((2, 3),)),
        {"R": R, "t": (2.0, 3.0), "rmse": 0.1},
        {"T": T},
        T.astype(int),
    ],
)
def test_a_transform_is_read_in_any_form(value):
    assert np.array_equal(read(Answer.TRANSFORM, value), T)


def test_a_transform_in_space_is_read_too():
    T = read(Answer.TRANSFORM, (np.eye(3), (1, 2, 3)))

    assert T.tolist() == [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]


@pytest.mark.parametrize(
    ("answer", "value", "read_as"),
    [
        (Answer.MATRIX, R, [[0, -1], [1, 0]]),
        (Answer.VECTOR, (1, 2.5), [1, 2.5]),
        (Answer.VECTOR, np.array([[1], [2]]), [1, 2]),
        (Answer.MASK, (True, 0, 1.0), [1, 0, 1]),
        (Answer.MASK, np.array([True, False]), [1, 0]),
        (Answer.MATCHES, ((2, 0), (0.5, 0.25)), [[2, 0.5], [0, 0.25]]),
        (Answer.MATCHES, np.array([[2, 0], [0.5, 0.25]]), [[2, 0.5], [0, 0.25]]),
        (Answer.POSES, ((1, 2, 3), (4, 5, 6)), [[1, 2, 3], [4, 5, 6]]),
        (Answer.NUMBER, np.array([[0.5]]), 0.5),
        (Answer.NUMBER, 2, 2),
        (Answer.NUMBERS, (1.5, (2, 3)), [1.5, 2, 3]),
        (Answer.NUMBERS, np.array([[1], [2]]), [1, 2]),
        (Answer.FLAG, True, 1),
        (Answer.FLAG, 0, 0),
        (Answer.FLAG, np.array(True), 1),
    ],
)
def test_an_answer_is_read_in_any_form(answer, value, read_as):
    got = read(answer, value)
    assert got.dtype == np.float64
    assert np.array_equal(got, np.array(read_as, dtype=float))


@pytest.mark.parametrize(
    ("answer", "value", "why"),
    [
        (Answer.MATRIX, None, r"returned None \(is a `return` missing\?\)"),
        (Answer.TRANSFORM, ((2, 3), R), r"returned \(t, R\), expected \(R, t\)"),
        (Answer.TRANSFORM, (R, (1, 2, 3)), "other shapes"),
        (Answer.TRANSFORM, (0.0, 0.0), "other shapes"),
        (Answer.TRANSFORM, np.eye(5), "other shapes"),
        (Answer.MATRIX, ((1, 2), (3,)), "a list or tuple that is no array of numbers"),
        (Answer.VECTOR, "abc", "returned a text"),
        (Answer.VECTOR, np.eye(2), "an array with 2 axes"),
        (Answer.VECTOR, ("a", "b"), "no array of numbers"),
        (Answer.VECTOR, ("a" * 10_000, *[""] * 40_000), "no array of numbers"),  # 1.6 GB, if made
        (Answer.MASK, (), "returned a list or tuple"),
        (Answer.MASK, np.ones((3, 1)), r"with 2 axes, .* of shape \(N,\)"),  # `&` makes it (3, 3)
        (Answer.MATCHES, np.zeros(3), r"expected two arrays \(indices, distances\)"),
        (Answer.MATCHES, ((1, 2), (0.5,)), "differ in shape"),
        (Answer.NUMBER, np.zeros(3), "several numbers"),
        (Answer.NUMBERS, (), "expected the numbers that the docstring names"),
        (Answer.NUMBERS, (1.0, "a"), "returned a text"),
        (Answer.TRANSFORM, (np.eye(2), np.zeros(3)), "other shapes"),
        (Answer.FLAG, 0.5, "not True or False"),
        (Answer.FLAG, np.nan, "not True or False"),
        (Answer.POSES, np.zeros(3), r"with 1 axis, expected rows \(x, y, ψ\)"),
    ],
)
def test_what_is_no_answer_is_refused_in_words(answer, value, why):
    with pytest.raises(Unreadable, match=why):
        read(answer, value)


def test_a_transform_in_space_is_read_as_it_is():
    in_space = np.diag([1.0, 1.0, 1.0, 1.0])

    assert np.array_equal(read(Answer.TRANSFORM, in_space), in_space)


def test_a_rotation_without_its_translation_is_called_so():
    with pytest.raises(Unreadable, match=r"it returned R alone, expected \(R, t\)"):
        read(Answer.TRANSFORM, np.eye(2))
