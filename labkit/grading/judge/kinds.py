"""The kinds of answers: how each is parsed, in every accepted form, and how far off it is.

An answer may come as an array, as nested tuples, as whole numbers; a transform as (R, t),
as a homogeneous matrix or as a dict of either. `read` brings all of them to one float array, or
says what it could not read; `sentences` say of a visible case what is wrong with one that it could.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np

from labkit.grading.box.inside.data import Value
from labkit.grading.questions import Answer, Case, Question
from labkit.support.arrays import FloatArray

EXPECTED = {
    Answer.MATRIX: "a square matrix of numbers",
    Answer.VECTOR: "a one-dimensional array of numbers",
    Answer.NUMBERS: "the numbers that the docstring names, in their order",
    Answer.TRANSFORM: "(R, t) with shapes (2, 2) and (2,), or one (3, 3) matrix",
    Answer.MATCHES: "two arrays (indices, distances), one number each for every source point",
    Answer.MASK: "one True or False for every pair, an array of shape (N,)",
    Answer.POSES: "rows (x, y, ψ), an array of shape (K + 1, 3)",
    Answer.NUMBER: "one number",
    Answer.FLAG: "True or False",
}
ANGLE = 1e-5  # rad; below it a rotation is called right in a text
FEW = 9  # entries of an argument that are shown


class Unreadable(Exception):
    """A value that is no answer of the kind asked for; the text tells the student why."""


def read(answer: Answer, value: Value) -> FloatArray:
    """The answer as a float array; `Unreadable` where the value is of another kind.

    MATRIX gives (n, n), VECTOR, NUMBERS and MASK (N,), TRANSFORM (3, 3), or (4, 4) in space,
    MATCHES (N, 2), POSES (K, 3), NUMBER and FLAG ().

    >>> read(Answer.TRANSFORM, (((1, 0), (0, 1)), (2, 3))).tolist()
    [[1.0, 0.0, 2.0], [0.0, 1.0, 3.0], [0.0, 0.0, 1.0]]
    """
    if value is None:
        raise Unreadable(f"it returned None (is a `return` missing?), not {EXPECTED[answer]}")
    if answer is Answer.TRANSFORM:
        return _read_transform(value)
    if answer is Answer.MATCHES:
        return _read_matches(value)
    if answer is Answer.NUMBERS:
        parts = value if isinstance(value, tuple) and value else (value,)
        return np.concatenate([_floats(part, answer).ravel() for part in parts])
    array = _floats(value, answer)
    if answer in (Answer.NUMBER, Answer.FLAG):
        if array.size != 1:
            raise Unreadable(f"it returned {_kind(value)} of several numbers, not one")
        if answer is Answer.FLAG and array.item() not in (0.0, 1.0):
            raise Unreadable("it returned a number, not True or False")
        return array.reshape(())
    dimensions = 1 if answer in (Answer.VECTOR, Answer.MASK) else 2
    if answer is Answer.VECTOR and array.ndim == 2 and 1 in array.shape:
        return array.ravel()  # a row or a column; a mask of another shape would select wrongly
    if array.ndim != dimensions:
        axes = f"{array.ndim} ax{'i' if array.ndim == 1 else 'e'}s"
        raise Unreadable(f"it returned {_kind(value)} with {axes}, expected {EXPECTED[answer]}")
    return array


def _read_transform(value: Value) -> FloatArray:
    if isinstance(value, dict):
        value = value["T"] if "T" in value else (value.get("R"), value.get("t"))
    if isinstance(value, tuple) and len(value) == 2:
        R, t = (_floats(part, Answer.TRANSFORM) for part in value)
        if t.ndim == 2 and R.size == len(t) == t.shape[1]:
            raise Unreadable("it returned (t, R), expected (R, t)")
        if R.shape in ((2, 2), (3, 3)) and t.size == len(R):
            T = np.eye(len(R) + 1)
            T[:-1, :-1], T[:-1, -1] = R, t.ravel()
            return T
    else:
        T = _floats(value, Answer.TRANSFORM)
        if T.shape in ((3, 3), (4, 4)):
            return T
        if T.shape == (2, 2):
            raise Unreadable("it returned R alone, expected (R, t)")
    raise Unreadable(f"it returned arrays of other shapes, expected {EXPECTED[Answer.TRANSFORM]}")


def _read_matches(value: Value) -> FloatArray:
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
    with suppress(ValueError, OverflowError):
        if _is_numeric(value):
            return np.asarray(value).astype(np.float64)
    description = f"{_kind(value)}{' that is no array of numbers' * isinstance(value, tuple)}"
    raise Unreadable(f"it returned {description}, expected {EXPECTED[answer]}")


def _is_numeric(value: Value) -> bool:
    """True if it is numbers alone: of many texts numpy would give each the room of the longest."""
    if isinstance(value, tuple):
        return bool(value) and all(map(_is_numeric, value))
    return isinstance(value, np.ndarray | float | int)


def _kind(value: Value) -> str:
    names = {"ndarray": "an array", "tuple": "a list or tuple", "bool": "True or False",
             "str": "a text", "dict": "a dict", "NoneType": "None"}  # fmt: skip
    return names.get(type(value).__name__, "a number")


def numbers(answer: Answer, value: Value) -> FloatArray | str:
    """The numbers of a value, be it an answer or not; of one without, why it is no answer."""
    try:
        return read(answer, value)
    except Unreadable as error:
        is_numeric = isinstance(value, np.ndarray | float | int)
        return np.asarray(value).astype(np.float64) if is_numeric else str(error)


def sentences(
    question: Question, case: Case, got: FloatArray, expected: FloatArray
) -> Iterator[str]:
    """Sentences on an answer that is not the wanted one; the last shows what went in and out."""
    names = [name.strip() for name in question.signature.strip("()").split(",")]
    arguments = [_format(argument) for argument in case.arguments]
    inputs = ", ".join(f"{name} = {value}" for name, value in zip(names, arguments, strict=False))
    if got.shape != expected.shape:
        surplus = len(got) - len(expected) if got.ndim == expected.ndim > 0 else 0
        if question.answer is Answer.TRANSFORM and surplus == -1:
            yield "it returned R alone, expected (R, t)."
        elif surplus and got.shape[1:] == expected.shape[1:]:
            side = "long" if surplus > 0 else "short"
            yield f"the result is too {side} by {abs(surplus)}."
        yield f"for {inputs}: got shape {got.shape}, expected {expected.shape}."
        return
    with np.errstate(all="ignore"):  # 1e300 is an answer, too
        if np.isnan(expected).any():
            yield "when no pair is kept, return NaN."
        elif (~np.isfinite(got) & np.isfinite(expected)).any():
            yield "the result holds NaN or infinity; look for a division by zero."
        else:
            yield from _TEXTS.get(question.answer, _numbers)(question, case, got, expected)
        is_right = (
            (np.abs(got - expected) <= case.tolerance) | (got == expected) | np.isnan(expected)
        )
    entry = np.unravel_index(np.argmin(is_right), got.shape)
    is_truth = question.answer in (Answer.FLAG, Answer.MASK) and not np.isnan(got[entry])
    as_shown = bool if is_truth else float
    got_text, expected_text = (_format(as_shown(array[entry])) for array in (got, expected))
    place = _place(question, case, [int(axis) for axis in entry])
    yield f"for {inputs}:{place} got {got_text}, expected {expected_text}."


def _place(question: Question, case: Case, entry: list[int]) -> str:
    """Place of an entry; of several results, counted within its own."""
    if question.answer is Answer.NUMBERS and isinstance(case.expected[0], tuple):
        sizes = [read(Answer.NUMBERS, part).size for part in case.expected[0]]
        part = int(np.searchsorted(np.cumsum(sizes), entry[0], side="right"))
        within = f" at [{entry[0] - sum(sizes[:part])}]" if sizes[part] > 1 else ""
        return f" in result {part + 1}{within}"
    return f" at [{', '.join(map(str, entry))}]" if entry else ""


def _format(value: object) -> str:
    """A few numbers, or the shape of many."""
    if isinstance(value, np.ndarray) and value.size > FEW:
        return f"an array {value.shape}"
    if isinstance(value, np.ndarray):
        line = np.array2string(
            value,
            separator=", ",
            max_line_width=999,
            formatter={"float_kind": lambda number: f"{number:.5g}"},
        )
        return line.replace("\n", "").replace("  ", " ")
    if isinstance(value, tuple | list):
        numeric = all(isinstance(entry, float | int) for entry in value)
        return f"({', '.join(map(_format, value))})" if numeric else f"{len(value)} entries"
    if isinstance(value, bool):
        return str(value)
    return f"{value:.5g}" if isinstance(value, float | int) else f"a {type(value).__name__}"


def _matrix(question: Question, case: Case, got: FloatArray, expected: FloatArray) -> Iterator[str]:
    size = len(expected) - 1
    if size > 1 and np.array_equal(expected[-1], np.eye(size + 1)[-1]):
        if not np.allclose(got[-1], expected[-1]):
            yield f"the last row of a transform is {'0, ' * size}1."
            return
        yield from _rotation(got[:size, :size], expected[:size, :size])
        shift = float(np.linalg.norm(got[:size, -1] - expected[:size, -1]))
        error = "is right" if shift <= case.tolerance else f"is off by {_size(shift, ' m')}"
        yield f"the translation {error}."
    elif np.allclose(expected.T @ expected, np.eye(size + 1), atol=1e-3):
        yield from _rotation(got, expected)
    else:
        yield from _numbers(question, case, got, expected)


def _rotation(got: FloatArray, expected: FloatArray) -> Iterator[str]:
    if not np.allclose(got.T @ got, np.eye(len(got)), atol=1e-3):
        yield "the matrix is no rotation: its columns are not orthonormal."
    elif np.linalg.det(got) < 0.0:
        yield "the matrix is a reflection, its determinant is −1; a rotation has +1."
    else:
        half = float(np.linalg.norm(got - expected)) / math.sqrt(8.0)  # sin of half the angle
        angle = 2.0 * math.asin(min(1.0, half))
        error = "is right" if angle < ANGLE else f"is off by {_size(math.degrees(angle), '°')}"
        yield f"the rotation {error}."


def _numbers(
    question: Question, case: Case, got: FloatArray, expected: FloatArray
) -> Iterator[str]:
    error = np.abs(got - expected)[np.isfinite(expected)]
    low, high = question.low, question.high
    if low is not None and high is not None and (outside := (got < low) | (got > high)).any():
        yield f"{outside.sum()} of {got.size} numbers lie outside [{low:g}, {high:g}]."
    if got.size > 1:
        largest = _size(float(error.max(initial=0.0)), f" {question.unit}".rstrip())
        yield f"{(error > case.tolerance).sum()} of {got.size} numbers are off, by up to {largest}."


def _mask(question: Question, case: Case, got: FloatArray, expected: FloatArray) -> Iterator[str]:
    if not np.isin(got, (0.0, 1.0)).all():
        yield "the result holds other numbers than True and False; expected a mask."
        return
    for pairs, does, do in ((got > expected, "keeps", "go"), (got < expected, "rejects", "stay")):
        if count := np.count_nonzero(pairs):
            yield f"it {does} {count} pair{'' if count == 1 else 's'} that should {do}."


def _poses(question: Question, case: Case, got: FloatArray, expected: FloatArray) -> Iterator[str]:
    shift = float(np.linalg.norm(got[:, :2] - expected[:, :2], axis=1).max())
    turn = np.abs(got[:, 2] - expected[:, 2])
    whole = np.allclose(np.round(turn / (2 * np.pi)) * 2 * np.pi, turn, atol=1e-4)
    if shift < 1e-4 and whole:
        yield "the poses are right, but some headings lie outside (−π, π]: wrap them."
        return
    turned = _size(math.degrees(turn.max()), "°")
    yield f"the positions are off by up to {_size(shift, ' m')}, the headings by up to {turned}."


def _size(number: float, unit: str) -> str:
    """A size that can be read: 180° and not 1.8e+02°."""
    return f"{float(f'{number:.2g}'):g}{unit}"


_TEXTS: dict[Answer, Callable[[Question, Case, FloatArray, FloatArray], Iterator[str]]] = {
    Answer.MATRIX: _matrix,
    Answer.TRANSFORM: _matrix,
    Answer.MASK: _mask,
    Answer.POSES: _poses,
}  # of all others `_numbers`
