"""Writing the assignment again gives what is committed, and poor cases are refused."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from labkit.course.authoring.__main__ import main
from labkit.course.authoring.compute import confusion, draw_case, hidden_cases, visible_cases
from labkit.course.authoring.entries import Recipe
from labkit.course.authoring.references import REFERENCES
from labkit.course.authoring.write import cases_file, questions_file, read_texts
from labkit.course.grading.assignment import FOLDER
from labkit.course.grading.judging.compare import is_right
from labkit.errors import LabkitError

TITLE, QUESTIONS = read_texts()
BY_ID = {question.id: question for question in QUESTIONS}


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
def test_the_stored_answers_are_those_of_the_references(assignment, question):
    """Of the visible cases and of one variant; buys that no stored answer is a relic."""
    for case in assignment.visible[question.id] + assignment.variants[3][question.id]:
        answers = REFERENCES[question.id](*case.arguments)
        assert len(answers) == len(case.expected)
        assert all(is_right(question, case, answer) for answer in answers), case.about


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


def test_variants_are_equally_hard_with_other_numbers(assignment):
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


def test_a_mistake_that_is_none_is_found():
    question = BY_ID["rotation"]
    cases = [
        replace(case, mistaken={**case.mistaken, "transposed": case.expected})
        for case in visible_cases(question)
    ]
    assert confusion(question, cases) == "transposed is taken for none"


def test_a_case_that_hangs_on_a_rounding_is_not_used():
    """The distance is the gate but for its last digits."""
    tie = Recipe("a tie", lambda _: (np.array([0.3]), 0.3 + 1e-9))
    with pytest.raises(LabkitError, match=r"no draw of distance_gate, 'a tie', is stable"):
        draw_case(BY_ID["distance_gate"], tie, "v1", False, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--folder", "nowhere"], "there is no folder nowhere; make it first"),
        (["--variants", "0"], "`--variants` must be at least 1, got 0"),
        (["--notebook", "nowhere/a.ipynb"], "cannot write nowhere/a.ipynb"),
    ],
)
def test_a_mistake_at_the_command_line_is_named(options, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here").mkdir()
    assert main(["--folder", "here", *options]) == 2
    assert message in capsys.readouterr().err
    assert not list((tmp_path / "here").iterdir())
