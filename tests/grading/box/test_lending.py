"""A slot is the student's function in all but its calls."""

import copy
import functools
import inspect
import types

import numpy as np
import pytest

from labkit.grading.box.inside.lending import RightFunction, Slot, in_form


def own(x, gain=2.0):
    return -gain * x


def right(x):
    return 3.0 * x


class Own(np.ndarray):
    """Arrays that calculate in another way."""


@pytest.fixture
def lent():
    return {}


@pytest.fixture
def slot(lent):
    return Slot("f", own, lent)


def test_it_looks_like_the_student_s_function(slot):
    assert isinstance(slot, types.FunctionType)
    assert inspect.isfunction(slot)
    assert inspect.signature(slot) == inspect.signature(own)
    assert functools.wraps(slot)(lambda: 0).__name__ == "own"
    assert copy.deepcopy({"f": slot})["f"] is slot


def test_what_is_written_on_it_stands_on_the_student_s(slot):
    slot.calls = 7

    assert own.calls == slot.calls == 7


def test_it_is_bound_as_a_method_like_a_function():
    holder = type("Holder", (), {"f": Slot("f", lambda self, x: (self, x), {})})()

    assert holder.f(1.0) == (holder, 1.0)


@pytest.mark.parametrize(
    ("positional", "named"),
    [((5.0,), {}), ((), {"x": 5.0}), ((5.0, 4.0), {}), ((5.0,), {"gain": 4.0})],
)
def test_a_right_function_takes_the_arguments_of_the_student_s(positional, named, slot, lent):
    lent["f"] = RightFunction(right)

    assert slot(*positional, **named) == 15.0


def test_a_right_function_has_the_student_s_defaults(slot, lent):
    lent["f"] = RightFunction(lambda x, gain: gain * x)

    assert slot(5.0) == slot(x=5.0) == 10.0


@pytest.mark.parametrize(
    "form",
    [np.zeros(2, int), np.zeros(2).view(Own), np.zeros(2), np.zeros((2, 1)), np.zeros((1, 2))],
)
def test_an_answer_in_another_form_calculates_like_it(form):
    answer = in_form(np.array([True, False]), form)

    assert type(answer) is type(form)
    assert (answer.dtype, answer.shape) == (form.dtype, form.shape)


@pytest.mark.parametrize(
    "form",
    [[], [0.0], (0.0, 0.0), [np.zeros(2)], np.zeros((2, 1)), np.zeros((1, 2)), np.zeros(2, int)],
)
def test_an_answer_in_another_form_has_the_same_numbers(form):
    answer = in_form(np.array([0.5, 1.5]), form)

    assert type(answer) is type(form)
    assert np.ravel(answer).tolist() == [0.5, 1.5]


def test_the_student_s_function_shows_its_form_once_on_a_copy(lent):
    asked = []
    given = np.ones(2)

    def own(x):
        asked.append(x)
        x[:] = 0.0
        return [0, 0]

    slot = Slot("f", own, lent)
    lent["f"] = RightFunction(right, asks_form=True)

    assert slot(given) == slot(given) == [3.0, 3.0]
    assert len(asked) == 1


@pytest.mark.parametrize("ends", [ValueError, SystemExit])
def test_who_shows_no_form_gets_the_answer_as_it_is(ends, lent):
    def own(x):
        raise ends

    lent["f"] = RightFunction(right, asks_form=True)

    assert Slot("f", own, lent)(5.0) == 15.0


@pytest.mark.parametrize("form", ["text", object(), {"R": 1.0}, {1, 2}])
def test_a_form_that_cannot_hold_the_answer_changes_nothing(form, slot, lent):
    lent["f"] = RightFunction(lambda _: np.ones(2))
    lent["f"].form = form

    assert np.array_equal(slot(0.5), np.ones(2))


def test_a_transform_keeps_what_stands_beside_it():
    form = {"T": np.eye(3), "rmse": 0.5}

    answer = in_form((np.eye(2), np.array([3.0, 4.0])), form)

    assert answer["T"].tolist() == [[1.0, 0.0, 3.0], [0.0, 1.0, 4.0], [0.0, 0.0, 1.0]]
    assert answer["rmse"] == 0.5
