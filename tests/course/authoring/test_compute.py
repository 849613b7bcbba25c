"""Writing the assignment again gives what is committed, and poor cases are refused."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from labkit.course.authoring.__main__ import main
from labkit.course.authoring.compute import confusion, draw_case, hidden_cases, visible_cases
from labkit.course.authoring.entries import Recipe
from labkit.course.authoring.write import cases_file, questions_file, read_texts
from labkit.course.grading.assignment import FOLDER
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


@pytest.mark.slow
def test_the_cases_are_those_committed():
    """Computes the visible cases and two variants; buys that no stored answer is a relic."""
    visible = {one.id: visible_cases(one) for one in QUESTIONS}
    first = {one.id: hidden_cases(one, 0, visible[one.id]) for one in QUESTIONS}
    other = {one.id: hidden_cases(one, 3, visible[one.id], like=first[one.id]) for one in QUESTIONS}
    files = {"visible": visible, "hidden/variant_0": first, "hidden/variant_3": other}
    for name, cases in files.items():
        committed = json.loads((FOLDER / f"{name}.json").read_text("utf-8"))
        assert same(json.loads(cases_file(cases)), committed), name


def test_variants_are_equally_hard_with_other_numbers(assignment):
    for question in assignment.questions:
        sets = [hidden[question.id] for hidden in assignment.variants]
        assert len({tuple(case.about for case in cases) for cases in sets}) == 1
        shapes = {tuple(np.shape(a) for case in cases for a in case.arguments) for cases in sets}
        assert len(shapes) == 1
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
    assert "passes for" in confusion(question, all_kept)
    assert confusion(question, hidden_cases(question, 0, visible_cases(question))) == ""


def test_a_mistake_that_is_none_is_found():
    question = BY_ID["rotation"]
    cases = [
        replace(case, mistaken={**case.mistaken, "transposed": case.expected})
        for case in visible_cases(question)
    ]
    assert confusion(question, cases) == "transposed passes for right"


def test_a_case_that_hangs_on_a_rounding_is_not_used():
    """Both target points are equally near, so the answer is a matter of the last bit."""
    tie = Recipe("a tie", lambda _: (np.array([[1.0, 0.3]]), np.array([[0.0, 0.1], [2.0, 0.1]])))
    with pytest.raises(LabkitError, match=r"no draw of nearest_neighbors, 'a tie', is stable"):
        draw_case(BY_ID["nearest_neighbors"], tie, "v1", False, np.random.default_rng(0))


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
