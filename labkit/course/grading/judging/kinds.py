"""The kinds of answers: how each is read, whatever clothes it wears, and how far off it is.

An answer may come as an array, as nested tuples, as whole numbers; a transform as (R, t),
as a homogeneous matrix or as a dict of either. `read` brings all of them to one float array, and
says in the student's words what it could not read. `how_wrong` says what is wrong with one that
it could, and `difference` shows of a visible case what went in, what came out and what should.

Of a hidden case no text holds an input, an expected value, a shape or a digit: who returns zeros
would read the answer off the difference. There they say the kind of the error and its power of ten.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from labkit.arrays import FloatArray
from labkit.course.grading.assignment.questions import Answer, Case, Question
from labkit.course.grading.contract import Value

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
LEAST_POWER, MOST_POWER = -6, 3  # beyond them a size could be made to spell out an input
ANGLE = 1e-5  # rad; below it a rotation is called right in a text
FEW = 9  # entries of an argument that are shown


class Unreadable(Exception):
    """A value that is no answer of the kind asked for; the text tells the student why."""


def read(answer: Answer, value: Value) -> FloatArray:
    """The answer as a float array, whose length is not judged here.

    MATRIX gives (n, n), VECTOR, NUMBERS and MASK (N,), TRANSFORM (3, 3), or (4, 4) in space,
    MATCHES (N, 2), POSES (K, 3), NUMBER and FLAG ().

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
    if answer is Answer.NUMBERS:
        parts = value if isinstance(value, tuple) and value else (value,)
        return np.concatenate([_floats(part, answer).ravel() for part in parts])
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
        if "T" not in value and not {"R", "t"} <= value.keys():
            raise Unreadable('it returned a dict without "R" and "t", or "T"')
        value = value["T"] if "T" in value else (value["R"], value["t"])
    if isinstance(value, tuple) and len(value) == 2:
        R, t = (_floats(part, Answer.TRANSFORM) for part in value)
        if R.size == len(t) and t.ndim == 2 and len(t) == t.shape[1]:
            raise Unreadable("it returned (t, R), expected (R, t)")
        if R.shape in ((2, 2), (3, 3)) and t.size == len(R):
            T = np.eye(len(R) + 1)
            T[:-1, :-1], T[:-1, -1] = R, t.ravel()
            return T
    else:
        T = _floats(value, Answer.TRANSFORM)
        if T.shape in ((3, 3), (4, 4)):
            return T
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
    if isinstance(value, str | dict) or (isinstance(value, tuple) and len(value) == 0):
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


def difference(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> str:
    """What went in and, at the first entry that is wrong, what came out and what should.

    Examples
    --------
    >>> from labkit.course.grading.assignment import load_assignment
    >>> assignment = load_assignment(hidden=False)
    >>> case = assignment.cases("wrap")[0]
    >>> difference(assignment.question("wrap"), case, np.array(4.712), np.array(-1.571))
    'For angle = 4.7124: got 4.712, expected -1.571.'
    """
    names = [name.strip() for name in question.signature.strip("()").split(",")]
    shown = ", ".join(map("{} = {}".format, names, map(_shown, case.arguments)))
    place, numbers = "", (got, wanted)
    if got.shape != wanted.shape:
        return f"For {shown}: got shape {got.shape}, expected {wanted.shape}."
    if got.ndim:
        with np.errstate(all="ignore"):
            off = ~(np.abs(got - wanted) <= case.tolerance) & ~((got == wanted) | np.isnan(wanted))
        first = tuple(int(i) for i in np.argwhere(off)[0]) if off.any() else (0,) * got.ndim
        place = f" at [{', '.join(map(str, first))}]"
        numbers = got[first], wanted[first]
    if question.answer in (Answer.FLAG, Answer.MASK):
        texts = [str(bool(number)) for number in numbers]
    else:
        texts = [_shown(float(number)) for number in numbers]
    return f"For {shown}:{place} got {texts[0]}, expected {texts[1]}."


def _shown(value: object) -> str:
    """A few numbers, or the shape of many."""
    if isinstance(value, np.ndarray) and value.size > FEW:
        return f"an array {value.shape}"
    if isinstance(value, float | int):
        return f"{value:.5g}"
    if isinstance(value, np.ndarray):
        text = np.array2string(np.asarray(value), precision=4, separator=", ", max_line_width=999)
        return text.replace("\n", "").replace("  ", " ")
    if isinstance(value, tuple | list) and all(isinstance(one, float | int) for one in value):
        return f"({', '.join(map(_shown, value))})"
    return f"a {type(value).__name__}"


def how_wrong(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> str:
    """One or two sentences on an answer, as `read` returns it, that is not the wanted one."""
    if got.shape != wanted.shape:
        return _shape(question, case, got, wanted)
    if np.isnan(wanted).any():
        return "where nothing is left there is no number: NaN is expected."
    if (~np.isfinite(got) & np.isfinite(wanted)).any():
        return "the result holds NaN or infinity; look for a division by zero."
    with np.errstate(all="ignore"):  # 1e300 is an answer, too
        texts = _TEXTS[question.answer](question, case, got, wanted)
        sentences = [*_out_of_range(question, case, got), *texts][:2]
    first = sentences[0][:1].lower() + sentences[0][1:]
    return " ".join([first, *(sentence[:1].upper() + sentence[1:] for sentence in sentences[1:])])


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
    size = len(wanted) - 1
    if size > 1 and np.array_equal(wanted[-1], np.eye(size + 1)[-1]):
        if not np.allclose(got[-1], wanted[-1]):
            yield f"the last row of a transform is {'0, ' * size}1."
            return
        yield from _rotation(case, got[:size, :size], wanted[:size, :size])
        shift = float(np.linalg.norm(got[:size, -1] - wanted[:size, -1]))
        right = shift <= case.tolerance
        off = "is right" if right else f"is off by {_size(shift, ' m', case)}"
        yield f"the translation {off}."
    elif np.allclose(wanted.T @ wanted, np.eye(size + 1), atol=1e-3):
        yield from _rotation(case, got, wanted)
    else:
        yield from _vector(question, case, got, wanted)


def _rotation(case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    if not np.allclose(got.T @ got, np.eye(len(got)), atol=1e-3):
        yield "the matrix is no rotation: its columns are not orthonormal."
    elif np.linalg.det(got) < 0.0:
        yield "the matrix is a reflection, its determinant is −1; a rotation has +1."
    else:
        half = float(np.linalg.norm(got - wanted)) / math.sqrt(8.0)  # sin of half the angle
        angle = 2.0 * math.asin(min(1.0, half))
        off = "is right" if angle < ANGLE else f"is off by {_size(math.degrees(angle), '°', case)}"
        yield f"the rotation {off}."


def _vector(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    error = np.abs(got - wanted)[np.isfinite(wanted)]
    wrong = int(np.count_nonzero(error > case.tolerance))
    unit = f" {question.unit}" if question.unit else ""
    share, most = _share(wrong, error.size, case), _most(float(error.max(initial=0)), unit, case)
    yield f"{share} of the numbers are off, by {most}."


def _matches(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> Iterator[str]:
    wrong = int(np.count_nonzero(got[:, 0] != wanted[:, 0]))
    if wrong:
        yield f"{_share(wrong, len(got), case)} of the indices are wrong."
    error = float(np.abs(got[:, 1] - wanted[:, 1]).max())
    if error > ANGLE:
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


_TEXTS: dict[Answer, Callable[[Question, Case, FloatArray, FloatArray], Iterator[str]]] = {
    Answer.MATRIX: _matrix,
    Answer.VECTOR: _vector,
    Answer.NUMBERS: _vector,
    Answer.TRANSFORM: _matrix,
    Answer.MATCHES: _matches,
    Answer.MASK: _mask,
    Answer.POSES: _poses,
    Answer.NUMBER: _number,
    Answer.FLAG: _flag,
}
