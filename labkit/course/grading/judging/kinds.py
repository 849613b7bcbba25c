"""The kinds of answers: how each is read, whatever clothes it wears, and how far off it is.

An answer may come as an array, as nested tuples, as whole numbers; a transform as (R, t),
as a (3, 3) or as a dict of either. `read` brings all of them to one float array, and says
in the student's words what it could not read. `how_wrong` says what is wrong with one that
it could.

The texts are built of fixed words and of differences with two digits. Of a hidden case
they hold no input, no expected value, no shape and no digit: who returns zeros would read
the answer off the difference. There they say the kind of the error and its power of ten.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from labkit.arrays import FloatArray
from labkit.course.grading.assignment.questions import Answer, Case, Question
from labkit.course.grading.contract import Value

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
LEAST_POWER, MOST_POWER = -6, 3  # beyond them a size could be made to spell out an input
ANGLE = 1e-5  # rad; below it a rotation is called right in a text


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
        return _read_transform(value)
    if answer is Answer.MATCHES:
        return _read_matches(value)
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


def _read_transform(value: Value) -> FloatArray:
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


def how_wrong(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> str:
    """One or two sentences on a readable answer that is not the expected one.

    Parameters
    ----------
    question, case
        What was asked.
    got, wanted : ndarray
        Both as `read` returns them.

    Returns
    -------
    str
    """
    if got.shape != wanted.shape:
        return _shape(question, case, got, wanted)
    if np.isnan(wanted).any():
        return "where nothing is left there is no number: NaN is expected."
    if not np.isfinite(got).all():
        return "the result holds NaN or infinity; look for a division by zero."
    with np.errstate(all="ignore"):  # 1e300 is an answer, too
        texts = _TEXTS[question.answer](question, case, got, wanted)
        sentences = [*_out_of_range(question, case, got), *texts]
    return " ".join(sentence[:1].lower() + sentence[1:] for sentence in sentences[:1]) + "".join(
        f" {sentence[:1].upper()}{sentence[1:]}" for sentence in sentences[1:2]
    )


def _shape(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> str:
    if got.ndim == wanted.ndim and got.shape[1:] == wanted.shape[1:]:
        surplus = len(got) - len(wanted)
        side = "too long" if surplus > 0 else "too short"
        amount = f" by {abs(surplus)}" if abs(surplus) == 1 or not case.hidden else ""
        return f"the result is {side}{amount}; expected {EXPECTED[question.answer]}."
    if case.hidden:
        return f"the result has another shape; expected {EXPECTED[question.answer]}."
    return f"the result has shape {got.shape}, expected {wanted.shape}."


def _out_of_range(question: Question, case: Case, got: FloatArray) -> Iterator[str]:
    low = -math.inf if question.low is None else question.low
    high = math.inf if question.high is None else question.high
    outside = int(np.count_nonzero((got < low) | (got > high)))
    if outside and question.answer is Answer.VECTOR:
        bounds = f"[{low:g}, {high:g}]" if high < math.inf else f"at least {low:g}"
        yield f"{_share(outside, got.size, case)} of the numbers lie outside {bounds}."


def _matrix(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    if len(got) == 3:
        yield from _transform(question, case, got, wanted)
    else:
        yield from _rotation(case, got, wanted)


def _transform(
    question: Question, case: Case, got: FloatArray, wanted: FloatArray
) -> Iterator[str]:
    if not np.allclose(got[2], (0.0, 0.0, 1.0)):
        yield "the last row of a transform is 0, 0, 1."
        return
    shift = math.hypot(*(got[:2, 2] - wanted[:2, 2]))
    yield from _rotation(case, got[:2, :2], wanted[:2, :2])
    if shift <= case.tolerance:
        yield "the translation is right."
    else:
        yield f"the translation is off by {_size(shift, ' m', case)}."


def _rotation(case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    gram = got.T @ got
    if not np.allclose(gram, np.eye(2), atol=1e-3):
        yield "the matrix is no rotation: its columns are not orthonormal."
    elif np.linalg.det(got) < 0.0:
        yield "the matrix is a reflection, its determinant is −1; a rotation has +1."
    else:
        turn = wanted.T @ got
        angle = abs(math.atan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]))
        if angle < ANGLE:
            yield "the rotation is right."
        else:
            yield f"the rotation is off by {_size(math.degrees(angle), '°', case)}."


def _vector(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    error = np.abs(got - wanted)
    wrong = int(np.count_nonzero(error > 1e-5 * max(1.0, float(np.abs(wanted).max()))))
    unit = f" {question.unit}" if question.unit else ""
    share, most = _share(wrong, error.size, case), _most(float(error.max()), unit, case)
    yield f"{share} of the numbers are off, by {most}."


def _matches(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    wrong = int(np.count_nonzero(got[:, 0] != wanted[:, 0]))
    if wrong:
        yield f"{_share(wrong, len(got), case)} of the indices are wrong."
    error = float(np.abs(got[:, 1] - wanted[:, 1]).max())
    if error > 1e-5:
        yield f"the distances are off by {_most(error, ' m', case)}."


def _mask(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    if not np.isin(got, (0.0, 1.0)).all():
        yield "the result holds other numbers than True and False; expected a mask."
        return
    kept, lost = int(np.count_nonzero(got > wanted)), int(np.count_nonzero(got < wanted))
    parts = ((kept, "keeps", "go"), (lost, "rejects", "stay"))
    said = [f"{does} {_pairs(count, case)} that should {do}" for count, does, do in parts if count]
    yield f"it {' and '.join(said)}."


def _poses(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    error = got - wanted
    turn = np.abs(error[:, 2])
    shift = float(np.hypot(error[:, 0], error[:, 1]).max())
    whole = np.allclose(np.round(turn / (2 * np.pi)) * 2 * np.pi, turn, atol=1e-4)
    if shift < 1e-4 and whole:
        yield "the poses are right, but some headings lie outside (−π, π]: wrap them."
        return
    yield (
        f"the positions are off by {_most(shift, ' m', case)}, "
        f"the headings by {_most(math.degrees(turn.max()), '°', case)}."
    )


def _number(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    unit = f" {question.unit}" if question.unit else ""
    yield f"the result is off by {_size(abs(float(got - wanted)), unit, case)}."


def _flag(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    yield f"it returned {bool(got)}; the rule says otherwise."


def _most(number: float, unit: str, case: Case) -> str:
    return f"{'' if case.hidden else 'up to '}{_size(number, unit, case)}"


def _size(number: float, unit: str, case: Case) -> str:
    """A size that can be read: 180° and not 1.8e+02°; of a hidden case its power of ten."""
    if case.hidden and 0.0 < number < math.inf:
        power = min(max(math.floor(math.log10(number)), LEAST_POWER), MOST_POWER)
        return f"more than {10.0**power:g}{unit}"
    return f"{float(f'{number:.2g}'):g}{unit}"


def _share(count: int, total: int, case: Case) -> str:
    """Of a hidden case a student may know how much is wrong, but not how long it is."""
    if count == total:
        return "all"
    if case.hidden:
        return "most" if 2 * count > total else "some"
    return f"about {max(1, round(100 * count / total))} %"


def _pairs(count: int, case: Case) -> str:
    return "some pairs" if case.hidden else f"{count} pair{'' if count == 1 else 's'}"


_TEXTS = {
    Answer.MATRIX: _matrix,
    Answer.VECTOR: _vector,
    Answer.TRANSFORM: _transform,
    Answer.MATCHES: _matches,
    Answer.MASK: _mask,
    Answer.POSES: _poses,
    Answer.NUMBER: _number,
    Answer.FLAG: _flag,
}
