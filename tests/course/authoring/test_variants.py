"""Variants: right submissions of all kinds get full marks in each, wrong ones the same points."""

from copy import deepcopy

import numpy as np
import pytest
from right_answers import RIGHT, solution

from labkit.course.exercises.checking import tried
from labkit.course.exercises.entries import ENTRIES
from labkit.course.grading.inside.data import plain
from labkit.course.grading.judging.compare import assess, is_right
from labkit.course.grading.judging.verdict import Outcome

WITHOUT_WHOLE_NUMBERS = {"rotation", "wrap", "fitness", "inlier_rmse", "icp_step", "icp"} | {
    "has_converged",
    "is_plausible",
}


def answer(function, case, *, single=False):
    """The outcome of a call; `single` hands the numbers over in single precision."""
    arguments = [to_single(a) if single else deepcopy(a) for a in case.arguments]
    value = plain(function(*arguments))
    return Outcome(value=value)


def to_single(value):
    kinds = {"f": np.float32, "i": np.int32, "b": np.bool_}
    return np.array(value, kinds[np.array(value).dtype.kind])[()]


def everything(assignment):
    """Each question with all cases of each student's variant."""
    for question in assignment.questions:
        for hidden in assignment.variants:
            yield question, assignment.visible[question.id] + hidden[question.id]


@pytest.mark.parametrize("single", [False, True], ids=["double", "single precision"])
@pytest.mark.parametrize("variant", RIGHT)
def test_a_right_submission_gets_full_marks(assignment, variant, single):
    for question, cases in everything(assignment):
        function = getattr(variant, question.function, getattr(solution, question.function))
        verdict = assess(question, cases, [answer(function, case, single=single) for case in cases])
        assert verdict.passed, [case.reason for case in verdict.cases if case.reason]
        assert verdict.misconception is None
        assert verdict.message == "All cases pass."


def test_whole_numbers_are_among_the_cases(assignment):
    """Every question on arrays of numbers has a hidden case in integers."""
    for question, cases in everything(assignment):
        arrays = [a for case in cases for a in case.arguments if isinstance(a, np.ndarray)]
        if question.id not in WITHOUT_WHOLE_NUMBERS:
            assert any(a.dtype == np.int64 for a in arrays), question.id


def test_both_readings_of_the_trimming_differ_and_pass(assignment):
    """The tests of the two readings would be empty if they gave the same answers."""
    for id in ("icp_step", "icp"):
        question = assignment.question(id)
        for hidden in assignment.variants:
            apart = [
                np.abs(np.subtract(*case.expected)).max() > 3 * case.tolerance
                for case in hidden[id]
            ]
            assert any(apart)
            assert all(is_right(question, case, v) for case in hidden[id] for v in case.expected)


PAIRS = "    kept = distance_gate(d, max_distance)"
UNNAMED = {  # wrong loops that no known mistake names
    "pairs that are mutual": {
        PAIRS: "    back = nearest_neighbors(target, moved)[0]\n" + PAIRS
        + " & (back[indices] == np.arange(len(d)))"},
    "a target point pairs once": {
        PAIRS: "    once = np.zeros(len(d), dtype=bool)\n"
        "    once[np.unique(indices, return_index=True)[1]] = True\n" + PAIRS + " & once"},
    "a gate of nine tenths": {"distance_gate(d, ": "distance_gate(d, 0.9 * "},
    "a gate of eleven tenths": {"distance_gate(d, ": "distance_gate(d, 1.1 * "},
    "a share of its own": {"overlap(d, overlap_ratio)": "overlap(d, 0.8)"},
    "roots of weights": {"huber_weights(d[kept], delta)": "huber_weights(d[kept], delta) ** 0.5"},
}  # fmt: skip


@pytest.mark.parametrize("question", ["icp_step", "icp"])
@pytest.mark.parametrize("wrong", UNNAMED)
def test_a_wrong_loop_costs_the_same_in_every_variant(assignment, question, wrong):
    asked, function = assignment.question(question), ENTRIES[question].edited(UNNAMED[wrong])[0]
    scores = []
    for hidden in assignment.variants[::3]:
        with np.errstate(all="ignore"):
            scores.append(tried(asked, hidden[question], function).score)
    assert max(scores) < asked.points
    assert max(scores) - min(scores) < 2.0
