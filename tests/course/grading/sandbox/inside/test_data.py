"""Data: every sort of number a student returns, no object, and frames that lie are refused."""

import io
import json
import struct
import tracemalloc
from collections import OrderedDict, namedtuple
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from labkit.course.grading.sandbox.inside import data
from labkit.course.grading.sandbox.inside.data import (
    HEAD,
    MAGIC,
    MAX_TREE,
    NotDataError,
    TooLargeError,
    TooMuchError,
    WireError,
    lengths,
    pack,
    plain,
    receive,
)
from labkit.course.grading.sandbox.inside.imports import StandIn


def unpack(frame):
    return receive(io.BytesIO(frame).read, len(frame))[0]


Motion = namedtuple("Motion", "R t")
MOST = 1 << 20
ARRAYS = hnp.arrays(
    st.sampled_from(["<f8", "<i8", "|b1"]), hnp.array_shapes(min_dims=0, max_dims=3, min_side=0)
)
NUMBERS = st.integers(-(2**63), 2**63 - 1) | st.floats() | st.booleans() | st.none()
VALUES = st.recursive(
    NUMBERS | st.text() | ARRAYS,
    lambda inner: st.lists(inner, max_size=4).map(tuple) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


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
    np.testing.assert_array_equal(unpack(data.pack(array)), array)


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


def frame(tree, raw=b"", head=None):
    text = tree if isinstance(tree, bytes) else json.dumps(tree).encode()
    return (head or HEAD.pack(MAGIC, len(text), len(raw))) + text + raw


def same(a, b):
    if isinstance(a, np.ndarray):
        return type(b) is np.ndarray and a.dtype == b.dtype and a.tobytes() == b.tobytes()
    if isinstance(a, tuple):
        return type(b) is tuple and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return type(a) is type(b) and (a == b or (a != a and b != b))


@given(VALUES)
def test_what_is_packed_comes_out_the_same(value):
    assert same(value, unpack(pack(value)))


def test_arrays_come_out_writable_and_apart():
    first, second = unpack(pack((np.zeros(3), np.zeros(3))))
    first[:] = 1.0
    assert second.tolist() == [0.0, 0.0, 0.0]
    assert first.flags.owndata
    assert first.flags.c_contiguous


def test_a_transposed_array_keeps_its_rows():
    points = np.arange(6.0).reshape(2, 3).T
    np.testing.assert_array_equal(unpack(pack(points)), points)


@given(st.binary(max_size=200))
def test_noise_is_no_frame(noise):
    with pytest.raises(WireError):
        unpack(noise)


@given(VALUES, st.data())
def test_a_changed_byte_gives_a_value_or_an_error_of_our_own(value, data):
    whole = bytearray(pack(value))
    place = data.draw(st.integers(0, len(whole) - 1))
    whole[place] = data.draw(st.integers(0, 255))
    with suppress(WireError):
        unpack(whole)


@given(st.recursive(NUMBERS | st.text(), lambda t: st.lists(t) | st.dictionaries(st.text(), t)))
@example({"a": ["<f8", [2]]})
@example({"a": [["<f8"], [0]]})
@example({"d": [["x"]]})
@example({"d": [[["x"], 1]]})
@example([2**70])
def test_any_json_gives_a_value_or_an_error_of_our_own(tree):
    with suppress(WireError):
        unpack(frame(tree))


@pytest.mark.parametrize(
    ("bad", "complaint"),
    [
        (b"", "a head of 0 bytes"),
        (frame(1, head=HEAD.pack(b"PK\x03\x04", 1, 0)), "no frame begins here"),
        (frame(1)[:-1], "a frame of 1 . 0 bytes; 16 fit"),
        (frame(b"[" * 100_000), "no JSON"),
        (frame(b"\xff"), "no JSON"),
        (frame(1, b"12345678"), "belong to no array"),
        (frame({"a": ["|O", [1]]}, bytes(8)), "no known dtype"),
        (frame({"a": ["<f8", [-1]]}), "no possible shape"),
        (frame({"a": ["<f8", [True]]}, bytes(8)), "no possible shape"),
        (frame({"a": ["<f8", [1] * 9]}, bytes(8)), "no possible shape"),
        (frame({"a": ["<f8", [2**40]]}, bytes(8)), "longer than the bytes sent"),
        (frame({"a": ["<f8", [2**62, 4]]}, bytes(8)), "no possible shape"),
        (frame({"b": 1}), "no known kind"),
        (frame({"d": [["x", 1, 2]]}), "no pair"),
        (frame(2**63), "more than 64 bits"),
        (frame(json.loads("[" * 20 + "]" * 20)), "nested deeper"),
    ],
)
def test_a_frame_that_lies_is_refused(bad, complaint):
    with pytest.raises(WireError, match=complaint):
        unpack(bad)


def test_a_length_is_refused_before_anything_is_made_of_it():
    tracemalloc.start()
    for tree, raw in ((MAX_TREE + 1, 0), (0, 2**63), (20, 5000)):
        with pytest.raises(TooLargeError, match="fit"):
            lengths(struct.pack("<4sIQ", MAGIC, tree, raw), most=4096)
    with pytest.raises(WireError):
        unpack(frame({"a": ["<f8", [2**44, 0, 2**40]]}, b"1"))
    assert tracemalloc.get_traced_memory()[1] < 1 << 20
    tracemalloc.stop()


def test_a_lone_surrogate_cannot_break_who_writes_it_to_a_file():
    assert unpack(frame(b'"\\ud800x"')).encode() == b"?x"


@pytest.mark.parametrize(
    ("value", "error"),
    [
        (np.array([1j]), TypeError),
        (np.float64(1.0), TypeError),
        ([1.0], TypeError),
        ({1: 2}, TypeError),
        (object(), TypeError),
        (2**63, TooLargeError),
        ("x" * (MAX_TREE + 1), TooLargeError),
    ],
)
def test_only_plain_data_is_packed(value, error):
    with pytest.raises(error):
        pack(value)
