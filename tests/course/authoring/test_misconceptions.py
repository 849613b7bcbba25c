"""Known mistakes and wrong functions: each is called by its name, and none pays."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from labkit.course.authoring import fairness
from labkit.course.authoring.compute import outcomes_of
from labkit.course.authoring.fairness import refuse_slow_cases, refuse_unseen_mistakes
from labkit.course.authoring.questions import QUESTIONS
from labkit.course.authoring.questions.loop import WIDER
from labkit.course.exercises.checking import judge_function
from labkit.course.exercises.entries import ENTRIES, answers
from labkit.grading.judge.compare import assess, is_answer_of
from labkit.support.errors import LabkitError
from tests.course.authoring.right_answers import solution as right

ROOT = Path(__file__).parents[3]
MISTAKES = [(entry, one) for entry in QUESTIONS for one in entry.known]
NAMES = [f"{entry.right.__name__}-{one.id}" for entry, one in MISTAKES]


def edited(question, edits):
    return ENTRIES[question].apply_edits(edits)


@pytest.mark.parametrize(("entry", "one"), MISTAKES, ids=NAMES)
def test_a_mistake_has_its_name_and_loses_points(assignment, entry, one):
    """By the examples alone, which are fewer, it may stay unnamed; it is never misnamed."""
    question, visible = assignment.question(entry.right.__name__), assignment.visible
    cases = assignment.cases(question.id)

    verdicts = [assess(question, cases, outcomes) for outcomes in outcomes_of(one.id, cases)]
    by_examples = [
        assess(question, visible[question.id], outcomes)
        for outcomes in outcomes_of(one.id, visible[question.id])
    ]

    assert {verdict.misconception for verdict in verdicts} == {one.id}
    assert all(one.says in verdict.message for verdict in verdicts)
    assert max(each.score for each in verdicts) < question.points
    assert {verdict.misconception for verdict in by_examples} <= {one.id, None}
    assert exists(one.chapter or question.chapter)


ONE_CONDITION = {  # mistakes that leave all other conditions of their question as they are
    "has_converged": "signed_turn signed_cost each_axis x_alone closed one_more one_less "
    "budget_met_exactly no_budget no_cost no_turn",
    "is_plausible": "signed_turn each_axis squared_shift x_alone nan_passes strict no_shift "
    "no_turn no_ratio no_residual",
    "integrate": "not_wrapped wrapped_to_full_turn half_open from_zero",
    "align_svd": "all_signs first_sign",
    "overlap": "no_minimum",
    "distance_gate": "strict",
    "huber_weights": "whole_numbers",
    "icp_step": "no_weights weights_of_squares gate_on_squares wide_gate no_gate strict_gate "
    "no_trimming",
    "icp": "no_weights weights_of_squares gate_on_squares wide_gate no_gate no_trimming "
    "gate_or_trimming no_rotation_test no_translation_test x_alone",
    "inlier_rmse": "zero_for_none",
}


@pytest.mark.parametrize("name", ONE_CONDITION)
def test_a_condition_that_is_dropped_costs_its_own_group_alone(assignment, name):
    question, cases = assignment.question(name), assignment.cases(name)
    groups = {case.group or case.id for case in cases if case.hidden}

    scores = {
        mistake: min(assess(question, cases, outcomes).score for outcomes in ways)
        for mistake in ONE_CONDITION[name].split()
        if (ways := outcomes_of(mistake, cases))
    }

    kept = pytest.approx(question.points * (1.0 - 1.0 / len(groups)), abs=0.01)
    assert scores == dict.fromkeys(ONE_CONDITION[name].split(), kept)


@pytest.mark.parametrize(("entry", "one"), MISTAKES, ids=NAMES)
def test_the_stored_answers_are_those_of_the_mistake(assignment, entry, one):
    """On any processor: what ends elsewhere on another one is not stored."""
    question = assignment.question(entry.right.__name__)
    for case in assignment.cases(question.id):
        if one.id in case.mistaken:
            found = answers(entry.ways(one), case.arguments)
            assert len(found) == len(case.mistaken[one.id])
            assert all(is_answer_of(one.id, question, case, answer) for answer in found)


@pytest.mark.parametrize("entry", QUESTIONS, ids=lambda entry: entry.right.__name__)
def test_whatever_loses_hidden_points_fails_a_visible_case(assignment, entry):
    """Law 3, over all known mistakes and a pool of slips; nothing here computes a case."""
    name = entry.right.__name__

    refuse_unseen_mistakes(entry, assignment.visible[name], assignment.hidden[name])


def test_a_mistake_that_no_visible_case_shows_is_refused(assignment):
    entry = ENTRIES["best_translation"]
    exact = assignment.visible["best_translation"][:2]

    with pytest.raises(LabkitError, match=r"best_translation: .* 'first_pair' passes"):
        refuse_unseen_mistakes(entry, exact, assignment.hidden["best_translation"])


def test_cases_that_take_plain_loops_long_are_refused(assignment, monkeypatch):
    """Law 1."""
    entry, cases = ENTRIES["icp_step"], assignment.hidden["icp_step"]
    refuse_slow_cases(entry, cases)
    monkeypatch.setattr(fairness, "SECONDS", 1e-4)

    with pytest.raises(LabkitError, match=r"icp_step, '.*': plain loops take .* s of 0.0001"):
        refuse_slow_cases(entry, cases)


def test_an_edit_of_what_the_solution_does_not_hold_is_told():
    with pytest.raises(AssertionError, match=r"wrap does not hold \['np.sin\(angle'\]"):
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


SHIFT, TURN = "np.hypot(*dT[:2, 2])", "abs(np.arctan2(dT[1, 0], dT[0, 0]))"
ENDS, ROUND = f"{SHIFT} < 1e-13 and {TURN} < 1e-13", "for _ in range(max_iterations):\n"
DISTANCES = "nearest_neighbors(source @ {0}[:2, :2].T + {0}[:2, 2], target)[1]"
RMSE = f"np.linalg.norm({DISTANCES}) / np.sqrt(len(source))"
FEW = f"""        d = {DISTANCES.format("T")}
        if (distance_gate(d, max_distance) & overlap(d, overlap_ratio)).sum() < {{}}:
            break
"""
GATE = "distance_gate(d, max_distance)"
KEPT = f"    kept = {GATE}"
UNNAMED = {  # wrong loops that no known mistake names
    "pairs that are mutual": {
        KEPT: "    back = nearest_neighbors(target, moved)[0]\n" + KEPT
        + " & (back[indices] == np.arange(len(d)))"},
    "a target point pairs once": {
        KEPT: "    once = np.zeros(len(d), dtype=bool)\n"
        "    once[np.unique(indices, return_index=True)[1]] = True\n" + KEPT + " & once"},
    "a gate of nine tenths": {"distance_gate(d, ": "distance_gate(d, 0.9 * "},
    "a gate of eleven tenths": {"distance_gate(d, ": "distance_gate(d, 1.1 * "},
    "a share of its own": {"overlap(d, overlap_ratio)": "overlap(d, 0.8)"},
    "roots of weights": {"huber_weights(d[kept], delta)": "huber_weights(d[kept], delta) ** 0.5"},
}  # fmt: skip
WRONG = {  # full marks once
    ("icp", "without the rotation test"): {ENDS: f"{SHIFT} < 1e-6"},
    ("icp", "without the translation test"): {ENDS: f"{TURN} < 1e-6"},
    ("icp", "a shift along x alone"): {ENDS: f"abs(dT[0, 2]) < 1e-6 and {TURN} < 1e-6"},
    ("icp", "a translation below 1e-2"): {ENDS: f"{SHIFT} < 1e-2 and {TURN} < 1e-6"},
    ("icp", "a translation below 1e-3"): {ENDS: f"{SHIFT} < 1e-3 and {TURN} < 1e-6"},
    ("icp", "a rotation below 1e-3"): {ENDS: f"{SHIFT} < 1e-6 and {TURN} < 1e-3"},
    ("icp", "a step below 1e-4"): {ENDS: f"{SHIFT} < 1e-4 and {TURN} < 1e-4"},
    ("icp", "either test"): {ENDS: f"{SHIFT} < 1e-6 or {TURN} < 1e-6"},
    ("icp", "an RMSE that hardly changes"): {
        ENDS: f"abs({RMSE.format('T')} - {RMSE.format('T_before')}) < 1e-6"
    },
    ("icp", "six pairs at least"): {ROUND: ROUND + FEW.format(6)},
    ("icp", "ten pairs at least"): {ROUND: ROUND + FEW.format(10)},
    ("icp", "the pose before the last"): {"break\n    return T": "break\n    return T_before"},
    ("icp", "a budget of 20 at most"): {"range(max_iterations)": "range(min(20, max_iterations))"},
    ("icp_step", "a gate that is 1 mm wider"): {GATE: "distance_gate(d, max_distance + 0.001)"},
    **{
        (question, name): edits
        for question in ("icp_step", "icp")
        for name, edits in UNNAMED.items()
    },
}


@pytest.mark.parametrize(("question", "name"), WRONG)
def test_a_wrong_function_that_looks_right_loses_points(assignment, question, name):
    """And the examples show it, where the rule that it breaks is one of the text's."""
    asked, function = assignment.question(question), edited(question, WRONG[question, name])[0]

    assert judge_function(asked, assignment.cases(question), function).score < asked.points
    if "1 mm" in name:
        assert not judge_function(asked, assignment.visible[question], function).passed


@pytest.mark.parametrize(
    ("question", "wider"),
    [
        *(("icp_step", wider) for wider in (*WIDER, 1.1, 1.75, 2.5)),
        *(("icp", wider) for wider in (WIDER[0], 1.75, WIDER[-1])),
    ],
)
def test_a_gate_that_is_too_wide_is_called_so_or_nothing(assignment, question, wider):
    asked = assignment.question(question)
    for function in edited(question, {GATE: f"distance_gate(d, {wider} * max_distance)"}):
        named = judge_function(asked, assignment.cases(question), function).misconception
        assert named == "wide_gate" if wider in WIDER else named in ("wide_gate", None)


@pytest.mark.parametrize("ends", [ENDS.replace("13", "6"), ENDS.replace("13", "5"), "False"])
def test_a_loop_may_end_by_any_usual_rule(assignment, ends):
    """Both steps are small, ten times larger ones suffice, or the budget alone counts."""
    for function in edited("icp", {ENDS: ends}):
        assert judge_function(assignment.question("icp"), assignment.cases("icp"), function).passed


ONE_LINERS = {
    "rotation": lambda theta: np.eye(2),
    "compose": lambda T, U: T * U,
    "invert": lambda T: T.T,
    "wrap": lambda angle: angle,
    "best_translation": lambda R, p, q: q.mean(0) - p.mean(0),
    "align": lambda p, q: (np.eye(2), q.mean(0) - p.mean(0)),
    "align_weighted": lambda p, q, w: right.align(p, q),
    "align_svd": lambda p, q: (np.eye(2), q.mean(0) - p.mean(0)),
    "nearest_neighbors": lambda p, q: (np.arange(len(p)), np.linalg.norm(p, axis=1)),
    "distance_gate": lambda d, gate: d < d.mean(),
    "overlap": lambda d, ratio: d <= ratio,
    "huber_weights": lambda r, delta: delta / r,
    "inlier_rmse": lambda d, kept: d.mean(),
    "fitness": lambda kept: kept.sum(),
    "icp_step": lambda p, q, T, *rest: T,
    "icp": lambda *arguments: right.icp_step(*arguments[:-1]),
    "has_converged": lambda dT, c, k, et, ep, ec, most: k >= most,
    "integrate": lambda steps, start: np.vstack([start, start + np.cumsum(steps, axis=0)]),
    "is_plausible": lambda step, ratio, rmse, *limits: rmse <= limits[3],
}


def test_nineteen_lines_without_an_idea_earn_next_to_nothing(assignment):
    with np.errstate(all="ignore"):
        scores = {
            id: judge_function(assignment.question(id), assignment.hidden[id], function).score
            for id, function in ONE_LINERS.items()
        }
    assert len(scores) == 19
    assert sum(scores.values()) < 5.0, scores
