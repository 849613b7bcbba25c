"""Writing the assignment again gives what is committed, and poor cases are refused."""

import json
import math

import numpy as np
import pytest

import labkit
from labkit.course.authoring.__main__ import main
from labkit.course.authoring.compute import confusion, draw_case, hidden_cases, visible_cases
from labkit.course.authoring.references import answers
from labkit.course.authoring.write import cases_file, questions_file, read_questions
from labkit.course.grading.assignment import FOLDER
from labkit.course.grading.judging.compare import is_right
from labkit.errors import LabkitError

TITLE, QUESTIONS = read_questions()
BY_ID = {question.id: question for question in QUESTIONS}
OF_LABKIT = {
    "rotation": labkit.se2.rotation,
    "compose": labkit.compose,
    "invert": labkit.invert,
    "wrap": labkit.wrap,
    "align": labkit.align,
    "align_weighted": labkit.align,
    "align_svd": labkit.align_svd,
    "distance_gate": labkit.correspondences.distance_gate,
    "overlap": labkit.correspondences.overlap,
    "huber_weights": labkit.correspondences.huber_weights,
    "integrate": labkit.odometry.integrate,
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
def test_the_stored_answers_are_those_of_the_references_and_of_labkit(assignment, question):
    """Of the visible cases and of one variant; buys that no stored answer is a relic."""
    for case in assignment.visible[question.id] + assignment.variants[3][question.id]:
        given = answers(question.id, case.arguments)
        assert len(given) == len(case.expected)
        if question.id in OF_LABKIT:
            given += (OF_LABKIT[question.id](*case.arguments),)
        assert all(is_right(question, case, answer) for answer in given), case.about


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
