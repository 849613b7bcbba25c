"""Sanity checks: each limit has its own complaint, and a good step has none."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.odometry import SanityLimits
from labkit.odometry.sanity import (
    COMPARED,
    FAR,
    LEAST,
    MISSED,
    WATCHED,
    Trust,
    fit_failures,
    grown,
    limit_failures,
    pace,
)
from labkit.support.errors import InvalidParameterError

LIMITS = SanityLimits(
    max_translation=1.0,
    max_rotation=math.radians(45.0),
    max_prior_translation=0.2,
    max_prior_rotation=math.radians(10.0),
    min_inlier_ratio=0.5,
    max_rmse=0.1,
)
STILL = np.zeros(3)
HALF = math.radians(180.0)
motions = st.tuples(*(st.floats(-most, most) for most in (2.0, 2.0, HALF)))


@given(motions)
def test_a_motion_has_one_complaint_for_each_limit_that_it_exceeds(motion):
    x, y, turn = motion
    found = limit_failures(np.array(motion), LIMITS.window, " from here")
    told = " ".join(found)
    assert ("translation from here" in told) == (math.hypot(x, y) > 1.0)
    assert ("rotation from here" in told) == (abs(turn) > LIMITS.max_rotation)
    assert len(found) <= 2


def test_no_number_passes_no_limit():
    nan = np.array([math.nan, 0.0, 0.0])
    assert limit_failures(nan, LIMITS.window) == ["translation nan m > 1.00 m"]
    assert limit_failures(nan[[1, 2, 0]], LIMITS.prior_window) == ["rotation nan° > 10.0°"]
    assert fit_failures(math.nan, math.nan, LIMITS) == [
        "inlier ratio nan < 0.500",
        "RMSE nan m > 0.100 m",
    ]
    assert (
        fit_failures(0.5, 0.1, LIMITS)
        == limit_failures(np.array([1.0, 0.0, -HALF / 4]), LIMITS.window)
        == []
    )


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


@given(st.lists(st.sampled_from([True, True, True, False]), max_size=3 * WATCHED))
def test_the_wheels_lead_from_many_misses_until_a_long_row_of_matches(matches):
    """They lead if, since the last `WATCHED` matches in a row, `WATCHED` steps had `MISSED`."""
    trust = Trust()
    for matched in matches:
        trust = trust.after(STILL, STILL, matched=matched, doubtful=True)
    missed = [not each for each in matches]
    ends = [k for k in range(WATCHED, len(missed) + 1) if not any(missed[k - WATCHED : k])]
    since = missed[max(ends, default=0) :]
    windows = [since[max(0, k - WATCHED) : k] for k in range(1, len(since) + 1)]
    assert trust.wheels_lead == any(sum(each) >= MISSED for each in windows)


@given(
    st.lists(st.tuples(*[st.floats(-0.3, 0.3)] * 3), max_size=2 * COMPARED),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3),
)
def test_a_doubtful_match_lies_as_near_to_the_wheels_as_sure_ones_do(offsets, prior):
    """Within `FAR` times their median, over the pace of the steps; never beyond the limits."""
    trust = Trust()
    for k, off in enumerate(offsets):
        told = np.array([0.1, 0.0, 0.02]) * (k % 3)  # errors grow with the way
        increment = told + np.array(off) * pace(told)
        trust = trust.after(increment, told, matched=True, doubtful=False)
        trust = trust.after(increment + 9.0, told, matched=True, doubtful=True)
    far, (most, most_turn) = [math.hypot(x, y) for x, y, _ in offsets], LIMITS.prior_window
    shift, turn = trust.window(LIMITS, np.array(prior))
    assert turn == most_turn
    if 4 * len(far) < COMPARED:
        assert shift == most
    else:
        grown_by = 1.0 + math.hypot(*prior[:2]) / 0.5 + abs(prior[2]) / math.radians(20.0)
        usual = grown_by * np.median(far[-COMPARED:])
        assert shift == pytest.approx(np.clip(FAR * usual, LEAST, most))


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
    for turn in ("max_rotation", "max_prior_rotation"):
        with pytest.raises(InvalidParameterError, match=f"`{turn}` must be radians.*degrees"):
            SanityLimits(**{turn: 30.0})
        assert getattr(SanityLimits(**{turn: math.inf}), turn) == math.inf
