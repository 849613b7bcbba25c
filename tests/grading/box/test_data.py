"""Plain data crosses the wall and comes back as it was; what is none stays on its side."""

import numpy as np
import pytest

from labkit.grading.box.inside.data import (
    NoAnswerError,
    describe_error,
    from_json,
    plain,
)
from labkit.grading.box.inside.limits import MAX_NESTING


def nested(depth, wrap):
    value = 1.0
    for _ in range(depth):
        value = wrap(value)
    return value


@pytest.mark.parametrize(
    ("value", "comes_back"),
    [
        (2**63 - 1, 2**63 - 1),
        (2**63, 2.0**63),  # JSON's whole numbers end there
        (-(2**70), -(2.0**70)),
        (np.uint8(200), 200),
        (np.array([200], np.uint8), np.array([200])),
        (np.float32(0.5), 0.5),
        (np.bool_(True), True),
        ([1, (2, "a")], (1, (2, "a"))),
        (range(3), (0, 1, 2)),
        ({1: None}, {"1": None}),
        (float("-inf"), float("-inf")),
        (np.array([np.inf, 1.0]), np.array([np.inf, 1.0])),
    ],
    ids=repr,
)
def test_a_value_comes_back_as_plain_data(value, comes_back):
    found = plain(value)

    assert type(found) is type(comes_back)
    np.testing.assert_equal(found, comes_back)
    assert getattr(found, "dtype", None) == getattr(comes_back, "dtype", None)


@pytest.mark.parametrize("wrap", [lambda x: (x,), lambda x: {"a": x}], ids=["tuples", "dicts"])
def test_what_is_nested_too_deeply_crosses_in_neither_direction(wrap):
    assert plain(nested(MAX_NESTING, wrap)) == nested(MAX_NESTING, wrap)

    with pytest.raises(NoAnswerError):
        plain(nested(MAX_NESTING + 1, wrap))
    kind, held = ("tuple", list) if wrap(1) == (1,) else ("dict", lambda held: {"a": held[0]})
    tree = nested(MAX_NESTING + 2, lambda x: {kind: held((x,))})
    with pytest.raises(ValueError, match="nested too deeply"):
        from_json(tree)


def test_an_error_says_no_more_than_a_page_can_show():
    assert len(describe_error(ValueError("a" * 10**6))) < 1000


FORGED = {  # no value has these forms
    "a large number": 2**63,
    "a list": [1.0],
    "another word": {"float": "1.0"},
    "another kind": {"dtype": "object", "shape": [1], "data": [1.0]},
    "another shape": {"dtype": "float64", "shape": [3], "data": [1.0]},
    "a shape of words": {"dtype": "float64", "shape": ["a"], "data": [1.0]},
    "a text in an array": {"dtype": "float64", "shape": [1], "data": ["a"]},
}


@pytest.mark.parametrize("form", FORGED)
def test_what_no_value_can_have_written_is_refused(form):
    tree = FORGED[form]

    for forged in (tree, {"tuple": [tree]}, {"dict": {"a": tree}}):
        with pytest.raises(ValueError, match=r"no data|could not|cannot reshape"):
            from_json(forged)
