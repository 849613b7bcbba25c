"""What a student's value says, whatever clothes it wears.

An answer may come as an array, as nested tuples, as whole numbers; a transform as (R, t),
as a (3, 3) or as a dict of either. `read` brings all of them to one float array, and says
in the student's words what it could not read.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labkit.arrays import FloatArray
from labkit.grading.assignment.questions import Answer
from labkit.grading.contract import Value

EXPECTED = {
    Answer.MATRIX: "a square matrix of numbers",
    Answer.VECTOR: "a one-dimensional array of numbers",
    Answer.TRANSFORM: "(R, t) with shapes (2, 2) and (2,), or one (3, 3) matrix",
    Answer.MATCHES: "two arrays (indices, distances), one number each for every source point",
    Answer.MASK: "one True or False for every pair, an array of shape (N,)",
    Answer.POSES: "rows (x, y, ψ), an array of shape (K + 1, 3)",
    Answer.NUMBER: "one number",
    Answer.FLAG: "True or False",
}


class Unreadable(Exception):
    """A value that is no answer of the kind asked for; the text tells the student why."""


def read(answer: Answer, value: Value) -> FloatArray:
    """The answer as a float array.

    Parameters
    ----------
    answer : Answer
        What was asked for.
    value : Value
        What came.

    Returns
    -------
    ndarray
        MATRIX (n, n), VECTOR and MASK (N,), TRANSFORM (3, 3), MATCHES (N, 2), POSES (K, 3),
        NUMBER and FLAG (). Lengths are not judged here.

    Raises
    ------
    Unreadable
        Where the value is of another kind.

    Examples
    --------
    >>> read(Answer.TRANSFORM, (((1, 0), (0, 1)), (2, 3))).tolist()
    [[1.0, 0.0, 2.0], [0.0, 1.0, 3.0], [0.0, 0.0, 1.0]]
    """
    if value is None:
        raise Unreadable(f"it returned None (is a `return` missing?), not {EXPECTED[answer]}")
    if answer is Answer.TRANSFORM:
        return _transform(value)
    if answer is Answer.MATCHES:
        return _matches(value)
    array = _floats(value, answer)
    if answer in (Answer.NUMBER, Answer.FLAG):
        if array.size != 1:
            raise Unreadable(f"it returned {_kind(value)} of several numbers, not one")
        array = array.reshape(())
        if answer is Answer.FLAG and array not in (0.0, 1.0):
            raise Unreadable("it returned a number, not True or False")
        return array
    if answer in (Answer.VECTOR, Answer.MASK) and array.ndim == 2 and 1 in array.shape:
        array = array.ravel()  # a row or a column
    dimensions = 1 if answer in (Answer.VECTOR, Answer.MASK) else 2
    if array.ndim != dimensions:
        axes = f"{array.ndim} ax{'i' if array.ndim == 1 else 'e'}s"
        raise Unreadable(f"it returned {_kind(value)} with {axes}, expected {EXPECTED[answer]}")
    return array


def _transform(value: Value) -> FloatArray:
    if isinstance(value, dict):
        value = _of_dict(value)
    if isinstance(value, tuple) and len(value) == 2:
        R, t = (_floats(part, Answer.TRANSFORM) for part in value)
        if R.shape in ((2,), (2, 1), (1, 2)) and t.shape == (2, 2):
            raise Unreadable("it returned (t, R), expected (R, t)")
        if R.shape == (2, 2) and t.shape in ((2,), (2, 1), (1, 2)):
            T = np.eye(3)
            T[:2, :2], T[:2, 2] = R, t.ravel()
            return T
    else:
        T = _floats(value, Answer.TRANSFORM)
        if T.shape == (3, 3):
            return T
    raise Unreadable(f"it returned arrays of other shapes, expected {EXPECTED[Answer.TRANSFORM]}")


def _of_dict(value: dict[str, Value]) -> Value:
    """The transform in a dict like the lesson's: {"R": R, "t": t, ...} or {"T": T}."""
    if "R" in value and "t" in value:
        return (value["R"], value["t"])
    if "T" in value:
        return value["T"]
    raise Unreadable('it returned a dict without "R" and "t", or "T"')


def _matches(value: Value) -> FloatArray:
    if isinstance(value, np.ndarray) and value.ndim == 2 and len(value) == 2:
        value = tuple(value)
    if not isinstance(value, tuple) or len(value) != 2:
        raise Unreadable(f"it returned {_kind(value)}, expected {EXPECTED[Answer.MATCHES]}")
    index, distance = (_floats(part, Answer.MATCHES) for part in value)
    index, distance = (part.ravel() if 1 in part.shape[1:] else part for part in (index, distance))
    if index.ndim != 1 or index.shape != distance.shape:
        raise Unreadable(f"its two results differ in shape, expected {EXPECTED[Answer.MATCHES]}")
    return np.column_stack([index, distance])


def _floats(value: Value, answer: Answer) -> FloatArray:
    if isinstance(value, str | dict) or (isinstance(value, Sequence) and len(value) == 0):
        raise Unreadable(f"it returned {_kind(value)}, expected {EXPECTED[answer]}")
    try:
        if not _is_numeric(value):
            raise ValueError
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            raise ValueError
        return array.astype(np.float64)
    except (ValueError, TypeError, OverflowError):
        raise Unreadable(
            f"it returned {_kind(value)} that is no array of numbers, expected {EXPECTED[answer]}"
        ) from None


def _is_numeric(value: Value) -> bool:
    """Whether it is numbers alone: of many texts numpy would give each the room of the longest."""
    if isinstance(value, tuple):
        return all(map(_is_numeric, value))
    return isinstance(value, np.ndarray | float | int)


def _kind(value: Value) -> str:
    if isinstance(value, np.ndarray):
        return "an array"
    if isinstance(value, tuple):
        return "a list or tuple"
    names = {bool: "True or False", int: "a number", float: "a number", str: "a text"}
    return names.get(type(value), "a dict")
