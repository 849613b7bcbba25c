"""Values survive the way through JSON."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from labkit.course.grading.assignment.files import from_plain, to_plain
from labkit.errors import InvalidParameterError

numbers = st.floats() | st.integers(-(2**63), 2**63 - 1) | st.booleans() | st.none() | st.text()
anything = st.recursive(
    numbers
    | arrays.arrays(np.float64, arrays.array_shapes(min_dims=1, min_side=0, max_side=3))
    | arrays.arrays(np.int64, (2, 2))
    | arrays.arrays(np.bool_, 3),
    lambda inner: (
        st.lists(inner, max_size=3).map(tuple) | st.dictionaries(st.text(), inner, max_size=3)
    ),
    max_leaves=6,
)


def alike(a, b):
    if isinstance(a, np.ndarray):
        same = isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape
        return same and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(alike, a, b))
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(alike(a[k], b[k]) for k in a)
    if isinstance(a, float) and math.isnan(a):
        return isinstance(b, float) and math.isnan(b)
    return type(a) is type(b) and a == b


@given(anything)
def test_what_goes_in_comes_out(value):
    text = json.dumps(to_plain(value), allow_nan=False)
    assert alike(from_plain(json.loads(text)), value)


def test_arrays_come_back_read_only():
    array = from_plain(to_plain(np.eye(2)))
    with pytest.raises(ValueError, match="read-only"):
        array[0, 0] = 7.0


@pytest.mark.parametrize("value", [[1.0], np.zeros(2, dtype=complex), object(), {1, 2}])
def test_what_is_no_data_is_refused(value):
    with pytest.raises(InvalidParameterError, match="`value` must be plain data, got "):
        to_plain(value)
