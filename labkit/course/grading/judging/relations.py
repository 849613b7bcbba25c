"""Families of mistakes in the answer: relations of a wrong answer to the right one.

Each sentence says how the answers are related, which is true wherever they are in all cases.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np

from labkit.course.grading.assignment.questions import Answer, Case, Misconception, Question
from labkit.course.grading.inside.data import Value
from labkit.course.grading.judging.kinds import Unreadable, read
from labkit.support.arrays import FloatArray

Relation = Callable[[FloatArray], Any]
Row = tuple[float, str, Relation]  # credit, sentence, and what becomes of the right answer


def _frames(change: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]) -> Relation:
    def relation(T: FloatArray) -> FloatArray:
        changed = T.copy()
        changed[:-1, :-1], changed[:-1, -1] = change(T[:-1, :-1], T[:-1, -1])
        return changed

    return relation


OF_MOTIONS: dict[str, Row] = {
    "inverse": (0.5, "This is the inverse: are source and target swapped, or two frames?",
        _frames(lambda R, t: (R.T, -R.T @ t))),
    "rotation_transposed": (0.5, "R is transposed: it turns the other way.",
        _frames(lambda R, t: (R.T, t))),
    "rotation_missing": (0.2, "There is no rotation.", _frames(lambda R, t: (np.eye(len(t)), t))),
    "translation_negated": (0.4, "The sign of the translation is turned round.",
        _frames(lambda R, t: (R, -t))),
    "translation_missing": (0.5, "The translation is left out.", _frames(lambda R, t: (R, 0 * t))),
    "translation_turned_back": (0.4, "The translation is in the other frame: turned by Rᵀ.",
        _frames(lambda R, t: (R, R.T @ t))),
    "axes_of_translation": (0.4, "x and y of the translation are exchanged.",
        _frames(lambda R, t: (R, t[::-1]))),
    "reflection": (0.25, "This is a reflection: an axis of the rotation has the wrong sign.",
        _frames(lambda R, t: (R * ([1.0] * (len(t) - 1) + [-1.0]), t))),
}  # fmt: skip
OF_MATRICES: dict[str, Row] = {
    "transposed": (0.5, "This is the transposed matrix.", np.transpose),
    "inverse_matrix": (0.4, "This is the inverse of the matrix.", np.linalg.inv),
}
OF_NUMBERS: dict[str, Row] = {
    "sign_turned": (0.5, "This is minus the answer: the sign is turned round.", np.negative),
    "sign_lost": (0, "The sign is lost: the size is right.", np.abs),
    "in_degrees": (0.5, "This is 180/π times the answer: give radians, not degrees.", np.rad2deg),
    "in_radians": (0, "This is π/180 times the answer.", np.deg2rad),
    "squared": (0.5, "This is the square of the answer: is a root missing?", np.square),
    "rooted": (0.5, "This is the square root of the answer.", lambda x: np.sqrt(np.abs(x))),
    "doubled": (0, "This is twice the answer.", lambda x: 2.0 * x),
    "halved": (0, "This is half of the answer.", lambda x: 0.5 * x),
    "complement": (0.4, "This is one minus the answer, the others' share.", lambda x: 1.0 - x),
    "percent": (0.5, "This is a hundred times the answer: give no percent.", lambda x: 100.0 * x),
    "millimetres": (0.5, "This is a thousand times the answer: give metres.", lambda x: 1000.0 * x),
    "upside_down": (0.4, "This is one divided by the answer: is it upside down?", lambda x: 1 / x),
    "one_more": (0.8, "This is one too much: counted from 1, or from 0?", lambda x: x + 1.0),
    "one_less": (0.8, "This is one too little: counted from 0, or from 1?", lambda x: x - 1.0),
}
OF_ROWS: dict[str, Row] = {
    "reversed": (0, "The numbers are right, but in reversed order.", lambda x: x[::-1]),
    "sorted": (0, "The numbers are right, but sorted: each belongs to its own entry.", np.sort),
    "mean": (0, "This is the mean; asked for is one number for each entry.", np.mean),
    "sum": (0, "This is the sum; asked for is one number for each entry.", np.sum),
    "axes_exchanged": (0, "x and y are exchanged.", lambda x: np.append(x[1::-1], x[2:])),
}
CONSTANTS: dict[str, Row] = {
    "always": (0, "It says True whatever it is given.", np.ones_like),
    "never": (0, "It says False whatever it is given.", np.zeros_like),
}
OF_FLAGS: dict[str, Row] = {"inverted": (0, "True and False are swapped.", lambda x: 1.0 - x)}
OF_MASKS: dict[str, Row] = {
    "mask_inverted": (0.4, "The mask is inverted: True is where False belongs.", lambda x: 1.0 - x),
    "indices": (0.7, "These are indices; asked for is a mask, one entry a pair.", np.flatnonzero),
}
OF_POSES: dict[str, Row] = {
    "headings_in_degrees": (0.5, "The headings are in degrees; angles are in radians.",
        lambda x: x * (1.0, 1.0, 180.0 / np.pi)),
    "headings_negated": (0.4, "The headings have the wrong sign.", lambda x: x * (1.0, 1.0, -1.0)),
    "axes_of_poses": (0.4, "x and y are exchanged.", lambda x: x[:, [1, 0, 2]]),
    "poses_transposed": (0.6, "The poses stand in columns; each is to be a row.", np.transpose),
    "first_pose_missing": (0.7, "The first pose is missing.", lambda x: x[1:]),
    "last_pose_missing": (0.7, "The last pose is missing.", lambda x: x[:-1]),
}  # fmt: skip
SCALED: dict[str, tuple[float, str]] = {
    "times_count": (0.5, "This is the answer times the number of entries: a sum for a mean?"),
    "over_count": (0.4, "This is the answer divided by the number of entries once too often."),
    "one_fewer": (0.4, "It is divided by one entry less than there are: N − 1 in place of N?"),
    "unchanged": (0.0, "The {} argument comes back as it came."),
    "order_of_results": (0.8, "The results are right, but in the wrong order."),
}
BY_KIND: Mapping[Answer, dict[str, Row]] = {
    Answer.TRANSFORM: OF_MOTIONS,
    Answer.MATRIX: OF_MATRICES | OF_MOTIONS | OF_NUMBERS,
    Answer.NUMBER: OF_NUMBERS,
    Answer.VECTOR: OF_NUMBERS | OF_ROWS,
    Answer.NUMBERS: OF_NUMBERS | OF_ROWS,
    Answer.MATCHES: OF_NUMBERS | OF_ROWS,
    Answer.MASK: OF_MASKS | CONSTANTS,
    Answer.FLAG: OF_FLAGS | CONSTANTS,
    Answer.POSES: OF_POSES,
}
PLACES = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh")


def general(id: str) -> Misconception:
    """The relation of that id as a mistake; ``squared@1`` is of the second result alone."""
    name, _, part = id.partition("@")
    rows = SCALED | {name: row[:2] for rows in BY_KIND.values() for name, row in rows.items()}
    credit, says = rows[name]
    said = f"Of the {PLACES[int(part)]} result: {says[0].lower()}{says[1:]}" if part else says
    if name == "unchanged":
        said = says.format(PLACES[int(part)])
    return Misconception(id=id, says=said, credit=credit)


def mistake(question: Question, id: str) -> Misconception:
    """The mistake of that id, of the question's own or of the families."""
    own = (known for known in question.misconceptions if known.id == id)
    return next(own, None) or general(id)


@cache
def relations(answer: Answer, case: Case) -> dict[str, list[FloatArray]]:
    """Wrong answers to a case by the relation that they have to a right one, of each reading."""
    found = dict[str, list[FloatArray]]()
    for value in case.expected:
        with np.errstate(all="ignore"):
            for id, wrong in _related(answer, case, value):
                found.setdefault(id, []).append(np.asarray(wrong, dtype=np.float64))
    return found


def _related(answer: Answer, case: Case, value: Value) -> Iterator[tuple[str, Any]]:
    wanted = read(answer, value)
    is_motion = answer is Answer.TRANSFORM or (
        answer is Answer.MATRIX and np.array_equal(wanted[-1], np.eye(3)[-1])
    )
    for id, (_, _, relation) in BY_KIND[answer].items():
        if (is_motion or id not in OF_MOTIONS) and (wanted.size > 1 or id not in OF_ROWS):
            with suppress(ValueError, IndexError):
                yield id, relation(wanted)
    yield from _of_entries(answer, case, wanted)
    if answer is Answer.MATCHES:
        yield from _of_parts(list(wanted.T), np.column_stack)
    elif isinstance(value, tuple) and answer is Answer.NUMBERS:
        yield from _of_parts([read(Answer.NUMBERS, part) for part in value], np.concatenate)


def _of_entries(answer: Answer, case: Case, wanted: FloatArray) -> Iterator[tuple[str, Any]]:
    """Relations by the number of entries of an argument, or by its entries."""
    for place, one in enumerate(case.arguments):
        if isinstance(one, np.ndarray | float | int) and np.shape(one) == wanted.shape:
            yield f"unchanged@{place}", one
        count = len(one) if isinstance(one, np.ndarray) and one.ndim else 0
        if answer in (Answer.NUMBER, Answer.VECTOR, Answer.MATRIX) and count > 1:
            yield "times_count", wanted * count
            yield "over_count", wanted / count
            yield "one_fewer", wanted * count / (count - 1)


def _of_parts(
    parts: list[FloatArray], join: Callable[[list[FloatArray]], Any]
) -> Iterator[tuple[str, Any]]:
    """The parts in another order, or one of them with a relation to the right one."""
    yield "order_of_results", join(parts[::-1])
    for place, part in enumerate(parts):
        for id, (_, _, relation) in (OF_NUMBERS | (OF_ROWS if part.size > 1 else {})).items():
            with suppress(ValueError):
                changed = [*parts[:place], np.ravel(relation(part)), *parts[place + 1 :]]
                yield f"{id}@{place}", join(changed)


def numbers(answer: Answer, value: Value) -> FloatArray | str:
    """The numbers of a value, be it an answer or not; of one without, why it is no answer."""
    try:
        return read(answer, value)
    except Unreadable as error:
        is_numeric = isinstance(value, np.ndarray | float | int)
        return np.asarray(value).astype(np.float64) if is_numeric else str(error)
