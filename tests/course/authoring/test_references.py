"""The tolerance follows the conditioning of a case."""

import math

import numpy as np
import pytest

import labkit
from labkit.course.authoring.references import EPSILON, perturbed, round_up, tolerance
from labkit.course.grading.assignment.questions import Answer


def align(p, T):
    return tolerance("align", Answer.TRANSFORM, (p, labkit.apply(T, p)))


def test_a_short_lever_far_away_needs_a_wider_tolerance():
    """Points that span 2 cm at 50 m: the angle is 100 times less certain than at 2 m."""
    p = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 2))
    T = labkit.transform(0.3, 0.1, 0.5)
    assert align(p, T) < 2e-5
    assert align(0.01 * p + 50.0, T) > 100 * align(p, T)


def test_an_answer_that_a_rounding_turns_over_has_no_tolerance():
    tie = (np.array([0.3, 0.1]), 0.3 * (1.0 + EPSILON / 10))
    assert tolerance("distance_gate", Answer.MASK, tie) >= 1.0


def test_single_precision_itself_lies_within():
    rng = np.random.default_rng(1)
    for _ in range(20):
        p = rng.uniform(-3.0, 3.0, (10, 2)) + rng.uniform(-10.0, 10.0, 2)
        T = labkit.transform(0.3, 0.1, 2.0)
        q = labkit.apply(T, p)
        rounded = labkit.align(p.astype(np.float32), q.astype(np.float32))
        assert np.abs(rounded - labkit.align(p, q)).max() <= align(p, T)


@pytest.mark.parametrize(("number", "up"), [(0.00123, 0.0013), (3.0, 3.0), (math.inf, math.inf)])
def test_rounding_up_keeps_two_digits(number, up):
    assert round_up(number) == up


def test_only_floats_are_perturbed_and_by_no_more_than_asked():
    whole, real = np.array([1, 2]), np.array([0.0, 1.0, -4.0])
    moved = perturbed((whole, real, 0.5), np.random.default_rng(0))
    assert moved[0] is whole
    assert (np.abs(moved[1] - real) <= EPSILON * np.abs(real)).all()
    assert moved[1][1] != 1.0
    assert moved[2] == 0.5
