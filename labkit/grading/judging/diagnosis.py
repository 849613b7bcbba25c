"""How far off a wrong answer is, in words for the student.

The texts are built of fixed words and of differences with two digits. Of a hidden case
they hold no input, no expected value, no shape and no digit: who returns zeros would read
the answer off the difference. There they say the kind of the error and its power of ten.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from labkit.arrays import FloatArray
from labkit.grading.assignment.questions import Answer, Case, Question
from labkit.grading.judging.reading import EXPECTED

LEAST_POWER, MOST_POWER = -6, 3  # beyond them a size could be made to spell out an input
ANGLE = 1e-5  # rad; below it a rotation is called right in a text


def how_wrong(question: Question, case: Case, got: FloatArray, wanted: FloatArray) -> str:
    """One or two sentences on a readable answer that is not the expected one.

    Parameters
    ----------
    question, case
        What was asked.
    got, wanted : ndarray
        Both as `labkit.grading.judging.reading.read` returns them.

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
