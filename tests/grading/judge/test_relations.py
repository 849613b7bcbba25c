"""A wrong answer that has one relation to every right one is told by it; no other is."""

import math

import numpy as np
import pytest

from labkit.grading.judge.compare import assess
from labkit.grading.judge.verdict import Outcome
from labkit.grading.questions import Answer, Case, Question

APART = np.zeros((2, 2)), np.arange(8.0).reshape(4, 2)  # points: no two are as near


def told(answer, rights, wrongs, arguments=APART):
    """What a student reads whose answers are these."""
    question = Question(
        id="f", title="F", points=1.0, function="f", signature="(x)", answer=answer
    )  # fmt: skip
    cases = [
        Case(id=f"{k}", hidden=False, about="a case", arguments=arguments, expected=(right,),
             tolerance=1e-6, mistaken={})
        for k, right in enumerate(rights)
    ]  # fmt: skip
    return assess(question, cases, [Outcome(value=wrong) for wrong in wrongs]).message


def transform(angle, x, y):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


POSES = np.array([[0.0, 0.0, 0.1], [1.0, 0.5, 0.3], [2.0, 0.4, -0.2]])
RIGHT = {  # two answers of each kind
    Answer.NUMBER: [2.3, 3.7],
    Answer.VECTOR: [np.array([2.3, 0.7, 1.9]), np.array([1.2, 3.1, 0.4])],
    Answer.MASK: [np.array([True, False, True]), np.array([False, False, True])],
    Answer.FLAG: [True, False],
    Answer.TRANSFORM: [transform(0.3, 1.0, 2.0), transform(-0.8, 0.5, -1.0)],
    Answer.POSES: [POSES, POSES + 0.05],
    Answer.MATCHES: [(np.array([2, 0]), np.array([0.5, 0.3])), (np.array([1, 2]), np.ones(2) / 3)],
    Answer.NUMBERS: [(np.array([1.5, 2.2]), 0.7), (np.array([0.4, 2.9]), 0.3)],
}
RELATED = [
    (Answer.NUMBER, lambda x: -x, "has the wrong sign"),
    (Answer.NUMBER, math.degrees, "is turned into degrees"),
    (Answer.NUMBER, math.radians, "is taken for degrees"),
    (Answer.NUMBER, lambda x: x**2, "is squared, or its root is missing"),
    (Answer.NUMBER, math.sqrt, "the square root is taken"),
    (Answer.NUMBER, lambda x: 1 / x, "one divided by the answer"),
    (Answer.NUMBER, lambda x: 2 * x, "is twice as large"),
    (Answer.NUMBER, lambda x: x / 2, "is half as large"),
    (Answer.NUMBER, lambda x: 1000 * x, "is turned into millimetres"),
    (Answer.NUMBER, lambda x: 100 * x, "a hundred times too large"),
    (Answer.NUMBER, lambda x: x + 1, "is one too large"),
    (Answer.NUMBER, lambda x: x - 1, "is one too small"),
    (Answer.VECTOR, sorted, "is sorted"),
    (Answer.VECTOR, lambda x: x[::-1], "is taken from its end"),
    (Answer.VECTOR, lambda x: x[[1, 0, 2]], "x and y of the answer are exchanged"),
    (Answer.VECTOR, lambda x: x.mean(), "is a mean; asked for is one number for each"),
    (Answer.MASK, lambda x: ~x, "True and False are swapped"),
    (Answer.MASK, lambda x: np.ones(3, bool), "is always True"),
    (Answer.MASK, lambda x: np.zeros(3, bool), "is always False"),
    (Answer.MASK, np.flatnonzero, "indices stand where a mask belongs"),
    (Answer.FLAG, lambda x: not x, "True and False are swapped"),
    (Answer.TRANSFORM, np.transpose, "is transposed"),
    (Answer.TRANSFORM, np.linalg.inv, "is inverted"),
    (Answer.POSES, lambda x: np.c_[x[:, :2], np.degrees(x[:, 2])], "the headings are in degrees"),
    (Answer.POSES, lambda x: x[1:], "the first pose is missing"),
    (Answer.MATCHES, lambda x: x[::-1], "the results are in the wrong order"),
    (Answer.MATCHES, lambda x: (x[0] + 1, x[1]), "result 1 is one too large"),
    (Answer.NUMBERS, lambda x: (x[0], -x[1]), "result 2 has the wrong sign"),
    (Answer.NUMBERS, lambda x: (x[0][::-1], x[1]), "result 1 is taken from its end"),
]
NAMES = [f"{kind.name}: {words}"[:40] for kind, _, words in RELATED]


@pytest.mark.parametrize(("kind", "change", "words"), RELATED, ids=NAMES)
def test_what_became_of_every_right_answer_is_told(kind, change, words):
    rights = RIGHT[kind]
    wrongs = [change(right) for right in rights]
    wrongs = [tuple(wrong) if isinstance(wrong, list) else wrong for wrong in wrongs]

    message = told(kind, rights, wrongs)

    assert words in message
    assert words not in told(kind, rights, [rights[0], wrongs[1]])  # one is right


def test_answers_in_whole_numbers_that_fit_two_relations_fit_none():
    """4 is the square of 2, and twice 2; 1 is the inverse of 1, its square and its root."""
    for right, wrong in ((2.0, 4.0), (3.0, 3.0), (1.0, 0.0)):
        message = told(Answer.NUMBER, [right, right], [wrong, wrong], arguments=())
        assert ("as if" in message) == (right == 1.0)


def test_the_right_numbers_in_another_form_have_lost_no_sign():
    """One (N, 2) array of positive numbers equals its absolute value."""
    source, target = np.zeros((3, 2)), np.arange(1.0, 9.0).reshape(4, 2)
    right = np.array([2, 0, 1]), np.array([0.5, 0.3, 0.2])

    message = told(Answer.MATCHES, [right], [np.column_stack(right)], (source, target))

    assert "expected two arrays" in message
    assert "as if" not in message


def test_no_relation_is_told_of_what_holds_no_number():
    """A division by zero: infinity is infinity's square, its half and its negative."""
    message = told(Answer.NUMBER, [2.3, 3.7], [np.inf, np.nan])

    assert message == "0 of 2 cases pass."
