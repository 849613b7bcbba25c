"""Known mistakes and wrong functions: each is called by its name, and none pays."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from labkit.course.authoring import solution as right
from labkit.course.authoring.compute import answers_of, outcomes_of
from labkit.course.authoring.edits import edited
from labkit.course.authoring.misconceptions import MISTAKES
from labkit.course.authoring.misconceptions.loop import WIDER
from labkit.course.grading.check import tried
from labkit.course.grading.judging.compare import assess, is_answer_of

ROOT = Path(__file__).parents[3]
NAMES = [f"{one.question}-{one.id}" for one in MISTAKES]


@pytest.mark.parametrize("one", MISTAKES, ids=NAMES)
def test_a_mistake_has_its_name_and_its_price_in_every_variant(assignment, one):
    """Its credit is never below the share of the cases that pass, so no second slip pays.

    By the examples alone, which are fewer, it may stay unnamed; it is never misnamed.
    """
    question = assignment.question(one.question)
    price = round(question.points * one.credit, 2)
    assert exists(question.misconception(one.id).chapter)
    for hidden in assignment.variants:
        cases = assignment.visible[question.id] + hidden[question.id]
        for outcomes in outcomes_of(one.id, cases):
            verdict = assess(question, cases, outcomes)
            assert verdict.misconception == one.id
            assert one.says in verdict.message
            assert verdict.score <= price < question.points
            if all(one.id in case.mistaken for case in hidden[question.id]):
                assert verdict.score == price
    for outcomes in outcomes_of(one.id, assignment.visible[question.id]):
        told = assess(question, assignment.visible[question.id], outcomes).misconception
        assert told in (one.id, None)


@pytest.mark.parametrize("one", MISTAKES, ids=NAMES)
def test_the_stored_answers_are_those_of_the_mistake(assignment, one):
    """On any processor: what ends elsewhere on another one is not stored."""
    question = assignment.question(one.question)
    for case in assignment.visible[question.id] + assignment.variants[5][question.id]:
        if one.id in case.mistaken:
            with np.errstate(all="ignore"):
                answers = answers_of(one, case.arguments)
            assert len(answers) == len(case.mistaken[one.id])
            assert all(is_answer_of(one.id, question, case, answer) for answer in answers)


def test_an_edit_of_what_the_solution_does_not_hold_is_told():
    with pytest.raises(AssertionError, match=r"the solution holds no \['np.sin\(angle'\], .* wrap"):
        edited("wrap", {"np.sin(angle": "np.cos(angle"})


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


def looping(ends):
    """An `icp` that ends as `ends` says of the step's shift and turn, the change of the RMSE and
    the count of pairs."""

    def icp(source, target, T_init, gate, ratio, delta, iterations):
        T, rmse, shift, turn = T_init, np.inf, 1.0, 1.0
        for _ in range(iterations):
            d = right.nearest_neighbors(source @ T[:2, :2].T + T[:2, 2], target)[1]
            kept = (right.distance_gate(d, gate) & right.overlap(d, ratio)).sum()
            change, rmse = rmse - np.sqrt(np.mean(d**2)), np.sqrt(np.mean(d**2))
            if ends(shift, turn, abs(change), kept):
                break
            before, T = T, right.icp_step(source, target, T, gate, ratio, delta)
            dT = T @ right.invert(before)
            shift, turn = np.hypot(*dT[:2, 2]), abs(np.arctan2(dT[1, 0], dT[0, 0]))
        return T

    return icp


LOOPS = {  # full marks once, or marks that hung on the variant
    "without the rotation test": looping(lambda s, t, c, n: s < 1e-6),
    "without the translation test": looping(lambda s, t, c, n: t < 1e-6),
    "a translation below 1e-2": looping(lambda s, t, c, n: s < 1e-2 and t < 1e-6),
    "a translation below 1e-3": looping(lambda s, t, c, n: s < 1e-3 and t < 1e-6),
    "a rotation below 1e-3": looping(lambda s, t, c, n: s < 1e-6 and t < 1e-3),
    "a step below 1e-4": looping(lambda s, t, c, n: s < 1e-4 and t < 1e-4),
    "either test": looping(lambda s, t, c, n: s < 1e-6 or t < 1e-6),
    "an RMSE that hardly changes": looping(lambda s, t, c, n: c < 1e-6),
    "six pairs at least": looping(lambda s, t, c, n: n < 6 or (s < 1e-6 and t < 1e-6)),
    "ten pairs at least": looping(lambda s, t, c, n: n < 10 or (s < 1e-6 and t < 1e-6)),
}
GATE = "distance_gate(d, max_distance)"
EDITED = {
    ("icp", "the pose before the last"): {"break\n    return T": "break\n    return T_before"},
    ("icp", "a budget of 20 at most"): {"range(max_iterations)": "range(min(20, max_iterations))"},
    ("icp_step", "a gate that is 1 mm wider"): {GATE: "distance_gate(d, max_distance + 0.001)"},
}
WRONG = {("icp", name): loop for name, loop in LOOPS.items()}
WRONG |= {key: edited(key[0], edits)[0] for key, edits in EDITED.items()}


@pytest.mark.parametrize(("question", "name"), WRONG)
def test_a_wrong_function_that_looks_right_loses_points_alike_in_every_variant(
    assignment, question, name
):
    """And the examples show it, where the rule that it breaks is one of the text's."""
    asked, function = assignment.question(question), WRONG[question, name]
    visible = assignment.visible[question]
    scores = [
        tried(asked, visible + hidden[question], function).score for hidden in assignment.variants
    ]
    assert max(scores) < asked.points
    assert max(scores) - min(scores) <= 2.0
    if question != "icp":
        assert not tried(asked, visible, function).passed


@pytest.mark.parametrize("wider", [*WIDER, 1.1, 1.75, 2.5])
@pytest.mark.parametrize("question", ["icp_step", "icp"])
def test_a_gate_that_is_too_wide_is_called_so_or_nothing(assignment, question, wider):
    """Usual ones by their name, and for the same points in every variant and reading."""
    asked, visible = assignment.question(question), assignment.visible[question]
    verdicts = [
        tried(asked, visible + hidden[question], function)
        for function in edited(question, {GATE: f"distance_gate(d, {wider} * max_distance)"})
        for hidden in assignment.variants
    ]
    names = {verdict.misconception for verdict in verdicts}
    assert names <= {"wide_gate", None}
    if wider in WIDER:
        assert names == {"wide_gate"}
        assert len({verdict.score for verdict in verdicts}) == 1


@pytest.mark.parametrize(
    "ends",
    [
        lambda s, t, c, n: s < 1e-6 and t < 1e-6,
        lambda s, t, c, n: s < 1e-5 and t < 1e-5,
        lambda s, t, c, n: False,
    ],
    ids=["both", "ten times earlier", "the budget"],
)
def test_a_loop_may_end_by_any_usual_rule(assignment, ends):
    question, visible = assignment.question("icp"), assignment.visible["icp"]
    for hidden in assignment.variants:
        assert tried(question, visible + hidden["icp"], looping(ends)).passed
