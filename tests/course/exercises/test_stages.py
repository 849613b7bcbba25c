"""A wrong function is asked by stages; the law: what is said is what its answers show."""

import numpy as np
import pytest
from scipy.sparse import identity

from labkit import Target, align, apply, transform
from labkit.correspondences import huber_weights
from labkit.course.assignment import load_assignment, load_plain_answers
from labkit.course.exercises import check, exercises
from labkit.course.exercises.checking import judge_exercise
from labkit.course.exercises.entries import source_of
from labkit.course.exercises.misreadings import misreadings_of
from labkit.course.exercises.parts import names_of
from labkit.course.exercises.stages import Plain, plain_form, stages_of
from tests.course.authoring.right_answers import solution

LOOP = source_of(exercises()["robust_icp"].right)
LOSSY = ("**2", "root of", "x and y")  # signs, and the turn of a pose, are not undone
NAMES = {"np": np, "Target": Target, "align": align, "apply": apply, "huber_weights": huber_weights}


def told(source, name):
    """The message on a function of the source."""
    names = dict(NAMES)
    exec(source, names)
    return check(names[name]).verdict.message


@pytest.mark.parametrize(
    ("right", "wrong", "says"),
    [
        ("d <= gate", "d**2 <= gate", "right if it gets `gate**2` for `gate`"),
        ("range(rounds)", "range(1, rounds)", "right if it gets `rounds + 1` for `rounds`"),
        ("gate=0.3, delta=0.05", "delta=0.05, gate=0.3", "gets `gate` and `delta` exchanged"),
        ("apply(T, source)", "apply(T, source[:-1])", "another last row of `source`"),
        ("d <= gate", "d <= 0.3", "stays the same with `gate=inf`"),
        ("T_init, Target", "np.eye(3), Target", "stays the same with `T_init` the identity"),
        ("range(rounds)", "range(15)", "stays the same with `rounds=1`"),
        ("huber_weights(d[near], delta)", "None", "stays the same with `delta=inf`"),
        (
            "huber_weights(d[near]",
            "huber_weights(d[near] ** 2",
            "With `delta=inf` it is right: so look at the residuals, and the weights",
        ),
        ("    return T", "        return T", "does a `return` inside the loop end it"),
        ("query(p)", "query(source)", "does each round search with moved points?"),
        ("@ T\n", "@ T\n        source = apply(T, source)\n", "With `rounds=1`"),
        (
            "align(p[near], q[near], w)",
            "align(q[near], p[near], w)",
            "the answer is inverted",
        ),
        (
            "align(p[near], q[near], w)",
            "align(source[near], q[near], w)",
            "together it is right, and wrong as soon as `T_init` or `rounds` is as given",
        ),
    ],
)
def test_a_wrong_loop_is_led_to_its_cause(right, wrong, says):
    assert right in LOOP

    assert says in told(LOOP.replace(right, wrong), "robust_icp")


@pytest.mark.parametrize(
    ("right", "wrong"),
    [("apply(T, p)", "p"), ("apply(T, p)", "p @ T[:2, :2].T"), ("(r, delta)", "(r, delta) ** 0.5")],
)
def test_a_plain_form_that_hides_a_fault_does_not_blame_its_argument_alone(right, wrong):
    source = source_of(exercises()["align_robustly"].right)

    message = told(source.replace(right, wrong), "align_robustly")

    assert "With `delta=inf` it is right: so look at the residuals, and the weights" in message


@pytest.mark.parametrize(
    ("right", "wrong", "is_told"),
    [
        ("range(30)", "range(2)", True),
        ("x[1:] += step", "x[1:] += 0.1 * step", True),
        ("(J.T @ J)", "(J.T @ J + 300.0 * identity(J.shape[1]))", True),
        ("-J.T @ error", "-J.T @ np.abs(error)", False),
        ("x[1:] += step", "x[1:] += 2.5 * step", False),
    ],
)
def test_a_solver_that_ends_too_early_is_told_that_it_becomes_right(right, wrong, is_told):
    entry = exercises()["solve_graph"]
    source = source_of(entry.right)
    assert right in source
    names = {**entry.right.__globals__, "identity": identity}
    exec(source.replace(right, wrong), names)

    message = judge_exercise(entry, names["solve_graph"]).message

    assert ("goes on from its own answer as `poses`, it becomes right" in message) == is_told


@pytest.mark.parametrize("name", exercises())
def test_an_argument_that_is_misread_is_named(name):
    """Each way of reading it wrongly is undone by another: degrees by radians, + 1 by − 1."""
    entry = exercises()[name]
    question, cases = entry.asked
    misreadings = dict(misreadings_of(names_of(question), cases[0].arguments))
    for words in misreadings:
        if any(sign in words for sign in LOSSY):
            continue

        def misread(*arguments, words=words):
            return entry.right(*dict(misreadings_of(names_of(question), arguments))[words])

        verdict = judge_exercise(entry, misread)

        assert verdict.passed or verdict.misconception or "right if it gets" in verdict.message


@pytest.mark.parametrize("name", exercises())
def test_the_right_answer_to_a_stage_is_not_the_answer_to_the_call(name):
    """Each plain form changes its argument, and nothing but that."""
    question, cases = exercises()[name].asked
    for case in cases:
        for stage in stages_of(question, case.arguments):
            pairs = zip(stage.arguments, case.arguments, strict=True)
            changed = sum(new is not old for new, old in pairs)
            assert changed == 1 or stage.plain in (Plain.ALL, Plain.ALL_BUT_ONE, Plain.ROW)


@pytest.mark.parametrize("question", load_assignment(hidden=False).questions, ids=lambda q: q.id)
def test_the_plain_answers_of_the_assignment_are_those_of_its_stages(question):
    stored = load_plain_answers()[question.id]
    for case in load_assignment(hidden=False).cases(question.id):
        words = [stage.phrase for stage in stages_of(question, case.arguments)]
        assert set(stored[case.id]) <= set(words)


def test_the_assignments_visible_cases_are_asked_by_stages():
    def integrate(increments, start):
        return solution.integrate(increments, np.zeros(3))

    assert "`start`" in check(integrate).verdict.message


def test_a_mask_that_is_wrong_beyond_a_limit_says_where():
    def distance_gate(distances, max_distance):
        return distances <= 0.77 * max_distance

    shown = check(distance_gate).verdict.message

    assert "With `max_distance=inf` it is right" in shown


def test_a_name_that_does_not_fit_the_stages_is_not_said():
    """The cases alone look as if the views behind were forgotten; a stage shows no."""

    def shared_view(turn, field):
        return (max(0.0, field - abs(turn)) + max(0.0, field - 2 * np.pi)) / field

    verdict = check(shared_view).verdict

    assert not verdict.passed
    assert verdict.misconception is None


def test_an_argument_without_a_plain_form_has_none():
    assert plain_form("clean", object())[0] == ""
    assert plain_form("T_k", transform(1.0, 2.0, 0.3))[1].tolist() == np.eye(3).tolist()
