"""Known mistakes and wrong functions: each is called by its name, and none pays."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from labkit.course.authoring import solution as right
from labkit.course.authoring.compute import answers_of, outcomes_of
from labkit.course.authoring.misconceptions import MISTAKES
from labkit.course.authoring.references import step
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


def looping(
    ends=lambda k, s, t, c, n: s < 1e-6 and t < 1e-6,
    use=right.icp_step,
    most=lambda iterations: iterations,
    begin=lambda T: T,
    give=lambda T, before: T,
):
    """An `icp` that ends as `ends` says of the step's number, its shift and turn, the change of
    the RMSE and the count of pairs, with `use` for a step and `most` for its budget."""

    def icp(source, target, T_init, gate, ratio, delta, iterations):
        T, rmse = begin(T_init), np.inf
        before = T
        for k in range(most(iterations)):
            d = right.nearest_neighbors(source @ T[:2, :2].T + T[:2, 2], target)[1]
            kept = (right.distance_gate(d, gate) & right.overlap(d, ratio)).sum()
            change, rmse = rmse - np.sqrt(np.mean(d**2)), np.sqrt(np.mean(d**2))
            dT = T @ right.invert(before)
            turn = abs(np.arctan2(dT[1, 0], dT[0, 0]))
            if ends(k, np.hypot(*dT[:2, 2]) if k else 1, turn if k else 1, abs(change), kept):
                break
            before, T = T, use(source, target, T, gate, ratio, delta)
        return give(T, before)

    return icp


def gated(stays):
    """A right step but for its gate."""
    return lambda p, q, T, *rest: step(
        p, q, T, *rest, lambda d, gate, ratio: stays(d, gate) & right.overlap(d, ratio)
    )


WRONG = {  # full marks once, or marks that hung on the variant
    "icp": {
        "without the rotation test": looping(lambda k, s, t, c, n: s < 1e-6),
        "without the translation test": looping(lambda k, s, t, c, n: t < 1e-6),
        "a translation below 1e-2": looping(lambda k, s, t, c, n: s < 1e-2 and t < 1e-6),
        "a translation below 1e-3": looping(lambda k, s, t, c, n: s < 1e-3 and t < 1e-6),
        "a rotation below 1e-3": looping(lambda k, s, t, c, n: s < 1e-6 and t < 1e-3),
        "a step below 1e-4": looping(lambda k, s, t, c, n: s < 1e-4 and t < 1e-4),
        "either test": looping(lambda k, s, t, c, n: s < 1e-6 or t < 1e-6),
        "an RMSE that hardly changes": looping(lambda k, s, t, c, n: c < 1e-6),
        "six pairs at least": looping(lambda k, s, t, c, n: n < 6 or (s < 1e-6 and t < 1e-6)),
        "ten pairs at least": looping(lambda k, s, t, c, n: n < 10 or (s < 1e-6 and t < 1e-6)),
        "no guess": looping(begin=lambda T: np.eye(3)),
        "the pose before the last": looping(give=lambda T, before: before),
        "a gate twice as wide": looping(use=gated(lambda d, gate: d <= 2 * gate)),
        "a gate half as wide again": looping(use=gated(lambda d, gate: d <= 1.5 * gate)),
        "a budget of 20": looping(most=lambda iterations: 20),
        "a budget of 20 at most": looping(most=lambda iterations: min(20, iterations)),
        "gate or trimming": looping(use=lambda *a: step(*a, lambda d, gate, ratio: (
            right.distance_gate(d, gate) | right.overlap(d, ratio)))),
    },
    "icp_step": {
        "a strict gate": gated(lambda d, gate: d < gate),
        "a gate that is 1 mm wider": gated(lambda d, gate: d <= gate + 0.001),
        "a gate twice as wide": gated(lambda d, gate: d <= 2 * gate),
        "no gate": gated(lambda d, gate: d < np.inf),
    },
    "wrap": {
        "[-pi, pi)": lambda angle: (angle + np.pi) % (2 * np.pi) - np.pi,
        "one turn": lambda a: a - 2 * np.pi if a > np.pi else a + 2 * np.pi if a < -np.pi else a,
    },
    "integrate": {
        "[-pi, pi)": lambda steps, start: (
            right.integrate(steps, start) * [1, 1, 1]
            - [0, 0, 2 * np.pi] * (right.integrate(steps, start)[:, 2:] == np.pi)
        ),
    },
    "has_converged": {
        "closed": lambda dT, c, k, et, ep, ec, m: (
            np.hypot(*dT[:2, 2]) <= et and abs(np.arctan2(dT[1, 0], dT[0, 0])) <= ep
        ) or abs(c) <= ec or k >= m,
    },
}  # fmt: skip
NOT_SHOWN = {"a gate that is 1 mm wider", "[-pi, pi)", "closed"}


@pytest.mark.parametrize(("question", "name"), [(q, name) for q in WRONG for name in WRONG[q]])
def test_a_wrong_function_that_looks_right_loses_points_alike_in_every_variant(
    assignment, question, name
):
    """And the examples show it, where the rule that it breaks is one of the text's."""
    asked, function = assignment.question(question), WRONG[question][name]
    visible = assignment.visible[question]
    scores = [
        tried(asked, visible + hidden[question], function).score for hidden in assignment.variants
    ]
    assert max(scores) < asked.points
    assert max(scores) - min(scores) <= 2.0
    if question != "icp" and name not in NOT_SHOWN:
        assert not tried(asked, visible, function).passed


@pytest.mark.parametrize(
    "ends",
    [
        lambda k, s, t, c, n: s < 1e-6 and t < 1e-6,
        lambda k, s, t, c, n: s < 1e-5 and t < 1e-5,
        lambda k, s, t, c, n: False,
    ],
    ids=["both", "ten times earlier", "the budget"],
)
def test_a_loop_may_end_by_any_usual_rule(assignment, ends):
    question, visible = assignment.question("icp"), assignment.visible["icp"]
    for hidden in assignment.variants:
        assert tried(question, visible + hidden["icp"], looping(ends)).passed


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
    "distance_gate": lambda d, gate: d < gate,
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
    for hidden in assignment.variants:
        with np.errstate(all="ignore"):
            scores = {
                id: tried(assignment.question(id), hidden[id], function).score
                for id, function in ONE_LINERS.items()
            }
        assert len(scores) == 19
        assert sum(scores.values()) < 5.0, scores
