"""What students return, as data: every sort of number, and no object."""

from collections import OrderedDict, namedtuple

import numpy as np
import pytest

from labkit.grading.sandbox.inside import data
from labkit.grading.sandbox.inside.data import NotDataError, TooMuchError, plain
from labkit.grading.sandbox.inside.imports import StandIn

Motion = namedtuple("Motion", "R t")
MOST = 1 << 20


@pytest.mark.parametrize(
    ("value", "data"),
    [
        (None, None),
        (True, True),
        (np.True_, True),
        (np.int8(-3), -3),
        (np.float32(0.5), 0.5),
        (np.longdouble(0.5), 0.5),
        ("inlier", "inlier"),
        (np.str_("inlier"), "inlier"),
        ([1, (2.0, [None])], (1, (2.0, (None,)))),
        (range(3), (0, 1, 2)),
        (Motion(1.0, 2.0), (1.0, 2.0)),
        (OrderedDict(R=1.0), {"R": 1.0}),
    ],
)
def test_plain_values(value, data):
    result = plain(value, MOST)
    assert result == data
    assert type(result) is type(data)


@pytest.mark.parametrize(
    "dtype", ["f2", "f4", "f8", ">f8", "g", "i1", "u2", "i4", "u8", ">i8", "?"]
)
def test_arrays_of_any_number_become_one_of_three_kinds(dtype):
    array = plain(np.arange(4).astype(dtype)[::-1], MOST)
    assert array.dtype.str == {"f": "<f8", "g": "<f8", "?": "|b1"}.get(
        np.dtype(dtype).char if dtype in "g?" else np.dtype(dtype).kind, "<i8"
    )
    np.testing.assert_array_equal(array, np.arange(4).astype(dtype)[::-1])
    np.testing.assert_array_equal(data.unpack(data.pack(array)), array)


def test_a_matrix_and_a_masked_array_are_arrays():
    assert type(plain(np.ma.masked_less(np.arange(3.0), 1.0), MOST)) is np.ndarray
    scalar = plain(np.array(2.0), MOST)
    assert scalar.shape == ()


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        (iter([]), "returned a list_iterator"),
        ({1.0}, "returned a set"),
        (print, "uncalled"),
        (lambda: 0, "uncalled"),
        (1j, "returned a complex"),
        (np.array([1j]), "complex numbers; return real ones"),
        (np.array([[1.0], [1.0, 2.0]], dtype=object), "rows of different length"),
        (np.array(["a"]), "holds no numbers"),
        (np.array(["2000-01-01"], dtype="M8[D]"), "holds no numbers"),
        (np.zeros((1,) * 9), "9 dimensions"),
        ({0: 1}, "its keys must be strings"),
        (StandIn("labkit.align"), "stands in for labkit.align"),
    ],
)
def test_what_is_no_data_is_named(value, complaint):
    with pytest.raises(NotDataError, match=complaint):
        plain(value, MOST)


def knot():
    a = []
    a.append(a)
    return a


@pytest.mark.parametrize(
    "value",
    [
        np.broadcast_to(np.zeros(1), (10**6, 10**6)),
        np.zeros(MOST // 8 + 1),
        [0.0] * (MOST // 8 + 1),
        knot(),
        "x" * 20_000,
        ["x" * 9_000] * 200,
        2**63,
        np.uint64(2**63),
        np.array([2**63], dtype=np.uint64),
    ],
)
def test_too_much_is_refused_before_it_is_copied(value):
    with pytest.raises(TooMuchError, match="returned"):
        plain(value, MOST)
