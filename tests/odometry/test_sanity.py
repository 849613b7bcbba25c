"""Sanity checks: each limit has its own complaint, and a good step has none."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.odometry import SanityLimits
from labkit.odometry.sanity import FULL, beyond, conflicts, grown, poor
from labkit.support.errors import InvalidParameterError

LIMITS = SanityLimits(
    max_translation=1.0,
    max_rotation=math.radians(45.0),
    max_prior_translation=0.2,
    max_prior_rotation=math.radians(10.0),
    min_inlier_ratio=0.5,
    max_rmse=0.1,
)
HALF = math.radians(180.0)
motions = st.tuples(*(st.floats(-most, most) for most in (2.0, 2.0, HALF)))


@given(motions, motions, st.floats(0.0, 1.0))
def test_a_motion_has_one_complaint_for_each_limit_that_it_exceeds(increment, prior, agreement):
    """The law; a match that agrees less than `FULL` must lie nearer to the prior."""
    (x, y, turn), share = increment, min(1.0, agreement / FULL)
    found = beyond(np.array(increment), LIMITS)
    told = " ".join(found)
    assert ("translation" in told) == (math.hypot(x, y) > 1.0)
    assert ("rotation" in told) == (abs(turn) > LIMITS.max_rotation)
    against = conflicts(np.array(increment), np.array(prior), LIMITS, agreement)
    far = math.dist(increment[:2], prior[:2]) > share * 0.2
    turned = abs(math.remainder(turn - prior[2], math.tau)) > share * LIMITS.max_prior_rotation
    assert len(found) <= 2
    assert len(against) == far + turned
    assert all("from the prior >" in each for each in against)


def test_no_number_passes_no_limit():
    increment = np.array([math.nan, 0.0, 0.0])
    assert beyond(increment, LIMITS) == ["translation nan m > 1.00 m"]
    assert conflicts(increment, np.zeros(3), LIMITS) == ["nan m from the prior > 0.20 m"]
    assert poor(math.nan, math.nan, LIMITS) == ["inlier ratio nan < 0.500", "RMSE nan m > 0.100 m"]
    assert poor(0.5, 0.1, LIMITS) == beyond(np.array([1.0, 0.0, -HALF / 4]), LIMITS) == []
    assert conflicts(increment, None, LIMITS) == []


def test_the_distance_to_the_prior_is_measured_across_the_cut_at_pi():
    wide = SanityLimits(max_rotation=4.0, max_prior_rotation=0.1)
    increment, prior = np.array([0.0, 0.0, math.pi]), np.array([0.0, 0.0, -math.pi + 0.05])
    assert beyond(increment, wide) + conflicts(increment, prior, wide) == []


def test_the_limits_follow_the_longest_of_the_last_motions_and_the_steps_that_were_lost():
    seen = np.array([[0.1, 0.0, 0.0], [0.0, -2.0, math.radians(60.0)]])
    for motions, lost, moved, turned in (
        (seen[:1], 0, 1.0, 45.0),
        (seen, 0, 3.0, 90.0),
        (seen[:1], 2, 3.0, 135.0),
        (seen, 5, 18.0, 180.0),
    ):
        limits = grown(LIMITS, motions, lost)
        assert limits.max_translation == pytest.approx(moved)
        assert limits.max_rotation == pytest.approx(math.radians(turned))


@pytest.mark.parametrize(
    ("name", "value", "interval"),
    [
        ("max_translation", 0.0, "(0, inf] m"),
        ("max_prior_translation", math.nan, "(0, inf] m"),
        ("max_prior_rotation", 0.0, "(0, inf] rad"),
        ("max_rmse", 0.0, "(0, inf] m"),
        ("min_inlier_ratio", 1.1, "[0, 1]"),
    ],
)
def test_limits_out_of_range(name, value, interval):
    with pytest.raises(InvalidParameterError) as caught:
        SanityLimits(**{name: value})
    assert str(caught.value) == f"`{name}` must be in {interval}, got {value!r}"
