"""Relations of a wrong answer to the right one, which hold for every question.

An angle in degrees, a lost sign, an inverse: where all answers are so related to the right ones,
the sentence is true, whatever the student's code looks like.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np

from labkit.grading.box.inside.data import Value
from labkit.grading.judge.kinds import read
from labkit.grading.questions import Answer, Case
from labkit.support.arrays import FloatArray

Change = tuple[str, Callable[[Any], Any]]  # the words for it, and what becomes of the right thing

OF_NUMBERS: list[Change] = [
    ("{} has the wrong sign", np.negative),
    ("{} has lost its sign", np.abs),
    ("{} is taken for degrees; it is in radians", np.deg2rad),
    ("{} is turned into degrees; keep radians", np.rad2deg),
    ("{} is squared, or its root is missing", np.square),
    ("the square root is taken of {}", lambda x: np.sqrt(np.abs(x))),
    ("one divided by {} stands where {} belongs", lambda x: 1.0 / x),
    ("{} is twice as large as it should be", lambda x: 2 * x),
    ("{} is half as large as it should be", lambda x: 0.5 * x),
    ("{} is turned into millimetres; keep metres", lambda x: 1000.0 * x),
    ("{} is a hundred times too large, as in percent or centimetres", lambda x: 100.0 * x),
    ("{} is one too large, as where one counts from 1", lambda x: x + 1),
    ("{} is one too small, as where one counts from 0", lambda x: x - 1),
]
OF_ROWS: list[Change] = [
    ("{} is sorted, so that its entries lose their places", lambda x: np.sort(x, 0)),
    ("{} is taken from its end", lambda x: x[::-1]),
    ("{} is a mean; asked for is one number for each entry", np.mean),
    ("x and y of {} are exchanged", lambda x: np.append(x[1::-1], x[2:])),
]
OF_MATRICES: list[Change] = [
    ("{} is transposed", np.transpose),
    ("{} is inverted, or that of two frames which are swapped", np.linalg.inv),
]
OF_MOTIONS: list[Change] = [  # of (R, t)
    ("the rotation is transposed: it turns the other way", lambda T: (T[0].T, T[1])),
    ("the translation has the wrong sign", lambda T: (T[0], -T[1])),
    ("the translation is left out", lambda T: (T[0], 0 * T[1])),
    ("the translation is in the other frame: turned by Rᵀ", lambda T: (T[0], T[0].T @ T[1])),
]
OF_FLAGS: list[Change] = [
    ("True and False are swapped", lambda x: 1.0 - x),
    ("{} is always True", np.ones_like),
    ("{} is always False", np.zeros_like),
    ("indices stand where a mask belongs, one entry a pair", np.flatnonzero),
]
OF_POSES: list[Change] = [
    ("the headings are in degrees; keep radians", lambda x: x * (1.0, 1.0, 180.0 / np.pi)),
    ("the first pose is missing", lambda x: x[1:]),
]
BY_KIND: dict[Answer, list[Change]] = {
    Answer.TRANSFORM: OF_MATRICES,
    Answer.MATRIX: OF_MATRICES + OF_NUMBERS,
    Answer.VECTOR: OF_NUMBERS + OF_ROWS,
    Answer.NUMBERS: OF_NUMBERS + OF_ROWS,
    Answer.MASK: OF_FLAGS,
    Answer.FLAG: OF_FLAGS,
    Answer.POSES: OF_POSES,
}  # of all others those of numbers


@cache
def relations(answer: Answer, case: Case) -> dict[str, list[FloatArray]]:
    """Wrong answers to a case by the sentence on how they are related to a right one."""
    answers = dict[str, list[FloatArray]]()
    for value in case.expected:
        with np.errstate(all="ignore"):
            for relation, related in _derive_answers(answer, case, value):
                sentence = f"{relation.replace('{}', 'the answer')}."
                answers.setdefault(sentence, []).append(np.asarray(related, dtype=np.float64))
    return answers


def _derive_answers(answer: Answer, case: Case, value: Value) -> Iterator[tuple[str, Any]]:
    expected = read(answer, value)
    if isinstance(value, tuple) and answer in (Answer.NUMBERS, Answer.MATCHES):
        join = np.concatenate if answer is Answer.NUMBERS else np.column_stack
        parts = [read(Answer.NUMBERS, part) for part in value]
        yield "the results are in the wrong order", join(parts[::-1])
        for place, part in enumerate(parts):
            for relation, changed in _apply_changes(part, BY_KIND[Answer.NUMBERS]):
                with suppress(ValueError):
                    results = [*parts[:place], np.ravel(changed), *parts[place + 1 :]]
                    yield relation.replace("{}", f"result {place + 1}"), join(results)
    yield from _apply_changes(expected, BY_KIND.get(answer, OF_NUMBERS))
    if answer is Answer.TRANSFORM or (
        expected.ndim == 2 and expected[-1].tolist() == [0.0, 0.0, 1.0]
    ):
        for relation, (R, t) in _apply_changes((expected[:-1, :-1], expected[:-1, -1]), OF_MOTIONS):
            T = expected.copy()
            T[:-1, :-1], T[:-1, -1] = R, t
            yield relation, T


def _apply_changes(value: Any, changes: Sequence[Change]) -> Iterator[tuple[str, Any]]:
    """The right thing with each of the changes that it can have."""
    for relation, change in changes:
        with suppress(ValueError):
            yield relation, change(value)
