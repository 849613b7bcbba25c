"""Right submissions of all kinds get full marks."""

from copy import deepcopy

import numpy as np
import pytest

from labkit.grading.box.inside.data import plain
from labkit.grading.judge.compare import assess, is_right
from labkit.grading.judge.verdict import Outcome
from tests.course.authoring.right_answers import RIGHT, solution


def answer(function, case, *, single=False):
    """The outcome of a call; `single` hands the numbers over in single precision."""
    arguments = [to_single(a) if single else deepcopy(a) for a in case.arguments]
    value = plain(function(*arguments))
    return Outcome(value=value)


def to_single(value):
    kinds = {"f": np.float32, "i": np.int32, "b": np.bool_}
    return np.array(value, kinds[np.array(value).dtype.kind])[()]


@pytest.mark.parametrize("single", [False, True], ids=["double", "single precision"])
@pytest.mark.parametrize("submission", RIGHT)
def test_a_right_submission_gets_full_marks(assignment, submission, single):
    for question in assignment.questions:
        function = getattr(submission, question.function, getattr(solution, question.function))
        cases = assignment.cases(question.id)
        verdict = assess(question, cases, [answer(function, case, single=single) for case in cases])
        assert verdict.passed, [case.reason for case in verdict.cases if case.reason]
        assert verdict.misconception is None
        assert verdict.message == "All cases pass."


def test_both_readings_of_the_trimming_differ_and_pass(assignment):
    """The tests of the two readings would be empty if they gave the same answers."""
    for id in ("icp_step", "icp"):
        question = assignment.question(id)
        hidden = assignment.hidden[id]
        apart = [np.abs(np.subtract(*case.expected)).max() > 3 * case.tolerance for case in hidden]
        assert any(apart)
        assert all(is_right(question, case, value) for case in hidden for value in case.expected)
