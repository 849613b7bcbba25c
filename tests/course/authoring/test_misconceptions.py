"""The catalogue of mistakes: each is recognised as itself, as no other, and never as right."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from labkit.course.authoring.compute import answers_of
from labkit.course.authoring.misconceptions import MISTAKES
from labkit.course.grading.contract import Outcome, OutcomeStatus
from labkit.course.grading.judging.compare import assess, is_answer_of

ROOT = Path(__file__).parents[3]
NAMES = [f"{one.question}-{one.id}" for one in MISTAKES]
RAISED = {"status": OutcomeStatus.RAISED, "error": "ValueError"}


def outcomes(cases, answers):
    """What the sandbox would bring of a mistake; where it has no answer, an error."""
    return [
        Outcome(id=case.id, status=OutcomeStatus.RETURNED, value=value)
        if value is not None
        else Outcome(id=case.id, **RAISED)
        for case, value in zip(cases, answers, strict=True)
    ]


def ways(one, cases):
    """The stored answers to the cases, for each way in which the mistake can come out."""
    count = max(len(case.mistaken.get(one.id, ())) for case in cases)
    for way in range(count):
        yield [case.mistaken[one.id][way] if one.id in case.mistaken else None for case in cases]


@pytest.mark.parametrize("one", MISTAKES, ids=NAMES)
def test_a_mistake_is_recognised_as_itself(assignment, one):
    question = assignment.question(one.question)
    for hidden in assignment.variants:
        cases = assignment.visible[question.id] + hidden[question.id]
        for answers in ways(one, cases):
            verdict = assess(question, cases, outcomes(cases, answers))
            assert verdict.misconception == one.id
            assert verdict.message.startswith(f"This looks like a known mistake: {one.says}")
            assert verdict.score == round(question.points * one.credit, 2), "its price"
            assert verdict.score < question.points
            wrong = [case for case in verdict.cases if not case.passed]
            assert wrong
            assert {case.misconception for case in wrong} == {one.id}


@pytest.mark.parametrize("one", MISTAKES, ids=NAMES)
def test_the_examples_name_no_other_mistake(assignment, one):
    """In the notebook there are fewer cases: a mistake may pass unnamed, never misnamed."""
    question = assignment.question(one.question)
    cases = assignment.visible[question.id]
    for answers in ways(one, cases):
        assert assess(question, cases, outcomes(cases, answers)).misconception in (one.id, None)


@pytest.mark.parametrize("one", MISTAKES, ids=NAMES)
def test_the_stored_answers_are_those_of_the_mistake(assignment, one):
    question = assignment.question(one.question)
    for case in assignment.visible[question.id] + assignment.variants[5][question.id]:
        with np.errstate(all="ignore"):
            answers = answers_of(one, case.arguments)
        assert len(answers) == len(case.mistaken.get(one.id, ()))
        assert all(is_answer_of(one.id, question, case, answer) for answer in answers)


def test_a_mistake_is_not_named_where_every_answer_that_came_is_right(assignment):
    """`zero_for_none` differs in one case alone; a crash there says nothing about it."""
    question = assignment.question("inlier_rmse")
    cases = assignment.cases("inlier_rmse", "ada")
    answers = [None if "no pair" in case.about else case.expected[0] for case in cases]
    verdict = assess(question, cases, outcomes(cases, answers))
    assert verdict.misconception is None
    assert 0.0 < verdict.score < question.points


def test_the_catalogue_holds_what_the_lab_warns_of():
    """Transposition, reflection, signs, units, squares, order: the mistakes of every year."""
    listed = {
        "rotation-transposed", "rotation-degrees", "align-sign_of_b", "align-swapped",
        "align_svd-reflection_kept", "align_weighted-ignored", "huber_weights-squared",
        "distance_gate-squared_distance", "overlap-worst_kept", "overlap-one_too_many",
        "icp-update_on_the_right", "icp_step-update_on_the_right", "integrate-world_frame",
        "integrate-not_wrapped", "inlier_rmse-over_all", "icp_step-swapped",
    }  # fmt: skip
    assert listed <= set(NAMES)
    assert len(set(NAMES)) == len(NAMES)


@pytest.mark.parametrize("one", MISTAKES, ids=NAMES)
def test_a_mistake_says_what_is_wrong_and_where_to_read(assignment, one):
    assert re.fullmatch(r"[A-ZΔ`ρ‖].{20,200}[.?)]", one.says), one.says
    assert 0.0 <= one.credit < 1.0
    assert exists(assignment.question(one.question).misconception(one.id).chapter)


def test_every_question_points_at_a_chapter(assignment):
    assert [one.id for one in assignment.questions if not exists(one.chapter)] == []


def exists(chapter):
    """Whether a pointer like "chapter 2, “The best translation”" leads somewhere."""
    where, _, heading = chapter.partition(", ")
    if where == "the errata":
        text = (ROOT / "book/errata.md").read_text("utf-8")
    else:
        (path,) = (ROOT / "notebooks").glob(f"{int(where.split()[1]):02}_*.ipynb")
        cells = json.loads(path.read_text("utf-8"))["cells"]
        text = "\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "markdown")
    return re.search(rf"^#+ {re.escape(heading.strip('“”'))}$", text, re.MULTILINE) is not None
