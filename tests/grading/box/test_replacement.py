"""A replaceable function is the student's in all but its calls."""

import copy
import functools
import inspect
import types

import numpy as np
import pytest

from labkit.grading.box.inside.replacement import Replaceable, Replacement, in_form


def own(x, gain=2.0):
    return -gain * x


def right(x):
    return 3.0 * x


class Own(np.ndarray):
    """Arrays that calculate in another way."""


@pytest.fixture
def replacements():
    return {}


@pytest.fixture
def replaceable(replacements):
    return Replaceable("f", own, replacements)


def test_it_looks_like_the_student_s_function(replaceable):
    assert isinstance(replaceable, types.FunctionType)
    assert inspect.isfunction(replaceable)
    assert inspect.signature(replaceable) == inspect.signature(own)
    assert functools.wraps(replaceable)(lambda: 0).__name__ == "own"
    assert copy.deepcopy({"f": replaceable})["f"] is replaceable


def test_what_is_written_on_it_stands_on_the_student_s(replaceable):
    replaceable.calls = 7

    assert own.calls == replaceable.calls == 7


def test_it_is_bound_as_a_method_like_a_function():
    holder = type("Holder", (), {"f": Replaceable("f", lambda self, x: (self, x), {})})()

    assert holder.f(1.0) == (holder, 1.0)


@pytest.mark.parametrize(
    ("positional", "named"),
    [((5.0,), {}), ((), {"x": 5.0}), ((5.0, 4.0), {}), ((5.0,), {"gain": 4.0})],
)
def test_a_right_function_takes_the_arguments_of_the_student_s(
    positional, named, replaceable, replacements
):
    replacements["f"] = Replacement(right, None)

    assert replaceable(*positional, **named) == 15.0


def test_a_right_function_has_the_student_s_defaults(replaceable, replacements):
    replacements["f"] = Replacement(lambda x, gain: gain * x, None)

    assert replaceable(5.0) == replaceable(x=5.0) == 10.0


@pytest.mark.parametrize("form", [np.zeros(2, int), np.zeros(2).view(Own), np.zeros(2)])
def test_an_answer_in_another_form_calculates_like_it(form):
    answer = in_form(np.array([True, False]), form)

    assert type(answer) is type(form)
    assert answer.dtype == form.dtype


@pytest.mark.parametrize(
    "form",
    [[], [0.0], (0.0, 0.0), [np.zeros(2)], np.zeros((2, 1)), np.zeros((1, 2)), np.zeros(2, int)],
)
def test_an_answer_in_another_form_has_the_same_numbers(form):
    answer = in_form(np.array([0.5, 1.5]), form)

    assert type(answer) is type(form)
    assert np.ravel(answer).tolist() == [0.5, 1.5]


@pytest.mark.parametrize("form", ["text", object(), {"R": 1.0}, {1, 2}])
def test_a_form_that_cannot_hold_the_answer_changes_nothing(form, replaceable, replacements):
    replacements["f"] = Replacement(lambda _: np.ones(2), form)

    assert np.array_equal(replaceable(0.5), np.ones(2))


def test_a_transform_keeps_what_stands_beside_it():
    form = {"T": np.eye(3), "rmse": 0.5}

    answer = in_form((np.eye(2), np.array([3.0, 4.0])), form)

    assert answer["T"].tolist() == [[1.0, 0.0, 3.0], [0.0, 1.0, 4.0], [0.0, 0.0, 1.0]]
    assert answer["rmse"] == 0.5
