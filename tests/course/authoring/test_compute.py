"""Writing the assignment again gives what is committed, and poor cases are refused."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import labkit
from labkit.correspondences import Correspondences, distance_gate, huber_weights, overlap
from labkit.course.authoring.__main__ import main
from labkit.course.authoring.compute import confusion, draw_case, hidden_cases, visible_cases
from labkit.course.authoring.entries import readings
from labkit.course.authoring.write import cases_file, questions_file, read_questions
from labkit.course.grading.assignment import FOLDER
from labkit.course.grading.inside.data import plain
from labkit.course.grading.judging.compare import is_right
from labkit.neighbors import NearestNeighbors
from labkit.odometry.sanity import SanityLimits, complaints
from labkit.result import step_length
from labkit.support.errors import LabkitError

TITLE, QUESTIONS = read_questions()
BY_ID = {question.id: question for question in QUESTIONS}


def best_translation(R, p, q):
    """By numpy's least squares over all coordinates at once."""
    return np.linalg.lstsq(np.tile(np.eye(2), (len(p), 1)), (q - p @ R.T).ravel())[0]


def of_kept(measure):
    """A measure of `Correspondences`, of a mask and distances alone."""
    return lambda *given: getattr(Correspondences, measure).fget(
        SimpleNamespace(kept=given[-1], inlier_count=given[-1].sum(), distances=given[0])
    )


def has_converged(dT, cost_change, iteration, eps_t, eps_psi, eps_cost, k_max):
    shift, turn = step_length(np.eye(3), dT)
    return (shift < eps_t and turn < eps_psi) or abs(cost_change) < eps_cost or iteration >= k_max


def icp(p, q, T, gate, ratio, delta, iterations=1):
    """ρ of all points, as labkit reads it."""
    limits = labkit.IcpParameters(
        gate, ratio, delta, iterations, translation_tolerance=1e-9, rotation_tolerance=1e-9
    )
    return labkit.icp(p, q, T, replace(limits, cost_tolerance=0.0)).T_target_source


def icp_of_gated(p, q, T, gate, ratio, delta, iterations=1):
    """ρ of what passes the gate, by labkit's stages."""
    for _ in range(iterations):
        moved = labkit.apply(T, p)
        index, d = NearestNeighbors(q).query(moved)
        kept = np.flatnonzero(distance_gate(d, gate))
        kept = kept[overlap(d[kept], ratio)]
        T = labkit.align(moved[kept], q[index[kept]], huber_weights(d[kept], delta)) @ T
    return T


def is_plausible(increment, ratio, rmse, shift, turn, least, most):
    limits = SanityLimits(
        max_translation=shift, max_rotation=turn, min_inlier_ratio=least, max_rmse=most
    )
    return not complaints(increment, ratio, rmse, limits)


ORACLES = {  # one for each reading; none of them knows the solution
    "rotation": [labkit.se2.rotation],
    "compose": [labkit.compose],
    "invert": [labkit.invert],
    "wrap": [labkit.wrap],
    "best_translation": [best_translation],
    "align": [labkit.align],
    "align_weighted": [labkit.align],
    "align_svd": [labkit.align_svd],
    "nearest_neighbors": [lambda p, q: NearestNeighbors(q).query(p)],
    "distance_gate": [distance_gate],
    "overlap": [overlap],
    "huber_weights": [huber_weights],
    "inlier_rmse": [of_kept("inlier_rmse")],
    "fitness": [of_kept("fitness")],
    "has_converged": [has_converged],
    "icp_step": [icp, icp_of_gated],
    "icp": [icp, icp_of_gated],
    "integrate": [labkit.odometry.integrate],
    "is_plausible": [is_plausible],
}


def same(a, b):
    """Whether two JSON trees agree, floats to ten digits: another BLAS rounds otherwise."""
    if isinstance(a, float) or isinstance(b, float):
        return math.isclose(a, b, rel_tol=1e-10, abs_tol=1e-10)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b


def test_the_texts_are_those_committed():
    assert questions_file(TITLE, QUESTIONS) == (FOLDER / "questions.json").read_text("utf-8")


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda one: one.id)
def test_the_stored_answers_are_those_of_the_references_and_of_an_oracle(assignment, question):
    """Of the visible cases and of one variant; buys that no stored answer is a relic."""
    for case in assignment.visible[question.id] + assignment.variants[3][question.id]:
        for found in (readings(question.id), ORACLES[question.id]):
            for wanted, function in zip(case.expected, found, strict=True):
                answer = plain(function(*case.arguments))
                assert is_right(question, replace(case, expected=(wanted,)), answer), case.about


def test_a_secret_and_a_number_lead_to_the_same_cases_again():
    """Cases that are cheap to draw; without the secret they are those committed."""
    for id in ("rotation", "distance_gate", "fitness"):
        visible = visible_cases(BY_ID[id])
        drawn = [
            json.loads(cases_file({id: hidden_cases(BY_ID[id], 0, visible, secret=secret)}))
            for secret in (b"", b"a secret", b"a secret")
        ]
        committed = json.loads((FOLDER / "hidden/variant_0.json").read_text("utf-8"))
        assert same(drawn[0]["cases"][id], committed["cases"][id])
        assert drawn[0] != drawn[1] == drawn[2]


def test_variants_try_the_same_with_other_numbers(assignment):
    for question in assignment.questions:
        sets = [hidden[question.id] for hidden in assignment.variants]
        assert len({tuple(case.about for case in cases) for cases in sets}) == 1
        drawn = {repr([case.arguments for case in cases]) for cases in sets}
        assert len(drawn) > len(sets) // 2  # whole turns leave few choices


def test_no_case_gives_its_answer_away(assignment):
    """A constant gets half of the flags and no more."""
    for id in ("has_converged", "is_plausible"):
        for hidden in assignment.variants:
            right = [case.expected[0] for case in assignment.visible[id] + hidden[id]]
            assert right.count(True) == right.count(False)


def test_cases_that_do_not_tell_mistakes_apart_are_refused():
    question = BY_ID["overlap"]
    all_kept = visible_cases(question)[1:]
    assert "is taken for" in confusion(question, all_kept)
    assert confusion(question, hidden_cases(question, 0, visible_cases(question))) == ""


def test_a_case_that_hangs_on_a_rounding_is_not_used():
    """The distance is the gate but for its last digits."""
    tie = (np.array([0.3]), 0.3 + 1e-9)
    with pytest.raises(LabkitError, match=r"no draw of distance_gate, 'a tie', is stable"):
        draw_case(BY_ID["distance_gate"], "v1", "a tie", tie, np.random.default_rng(0))


def test_a_mistake_at_the_command_line_is_named(capsys):
    assert main(["--notebook", "nowhere/a.ipynb"]) == 2
    assert "cannot write nowhere/a.ipynb" in capsys.readouterr().err
