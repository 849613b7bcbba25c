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
