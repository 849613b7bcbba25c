"""Sanity checks: each limit has its own complaint, and a good step has none."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.odometry import SanityLimits
from labkit.odometry.sanity import fit_failures, limit_failures
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
