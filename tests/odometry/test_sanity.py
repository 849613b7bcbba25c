"""Sanity checks: each limit has its own complaint, and a good step has none."""

import math

import numpy as np
import pytest

from labkit.odometry import SanityLimits
from labkit.odometry.sanity import beyond, conflicts, grown, poor
from labkit.support.errors import InvalidParameterError

LIMITS = SanityLimits(
    max_translation=1.0,
    max_rotation=math.radians(45.0),
    max_prior_translation=0.2,
    max_prior_rotation=math.radians(10.0),
    min_inlier_ratio=0.5,
    max_rmse=0.1,
)
GOOD = np.array([0.6, -0.6, math.radians(-40.0)])


@pytest.mark.parametrize(
    ("increment", "prior", "complaints"),
    [
        (GOOD, None, []),
        (GOOD, GOOD, []),
        ([1.0, 0.0, math.radians(45.0)], None, []),  # the limit itself is allowed
        ([0.2, 0.0, math.radians(10.0)], [0.0, 0.0, 0.0], []),  # and this one
        ([0.0, -1.1, 0.0], None, ["translation 1.10 m > 1.00 m"]),
        ([0.8, 0.8, 0.0], None, ["translation 1.13 m > 1.00 m"]),
        ([0.0, 0.0, math.radians(-50.0)], None, ["rotation 50.0° > 45.0°"]),
        ([math.nan, 0.0, 0.0], None, ["translation nan m > 1.00 m"]),
        ([0.5, 0.0, 0.0], [0.2, 0.0, 0.0], ["0.30 m from the prior > 0.20 m"]),
        ([0.2, 0.4, 0.0], [0.2, 0.0, 0.0], ["0.40 m from the prior > 0.20 m"]),
        ([0.0, 0.0, math.radians(-6)], [0, 0, math.radians(6)], ["12.0° from the prior > 10.0°"]),
        (
            [2.0, 0.0, math.radians(50.0)],
            [0.0, 0.0, 0.0],
            [
                "translation 2.00 m > 1.00 m",
                "rotation 50.0° > 45.0°",
                "2.00 m from the prior > 0.20 m",
                "50.0° from the prior > 10.0°",
            ],
        ),
    ],
)
def test_motion(increment, prior, complaints):
    prior = None if prior is None else np.array(prior, dtype=float)
    increment = np.array(increment)
    against = conflicts(increment, prior, LIMITS)
    assert beyond(increment, LIMITS) + against == complaints


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
    ("ratio", "rmse", "complaints"),
    [
        (0.5, 0.1, []),
        (1.0, 0.0, []),
        (0.49, 0.1, ["inlier ratio 0.490 < 0.500"]),
        (0.5, 0.101, ["RMSE 0.101 m > 0.100 m"]),
        (0.0, math.nan, ["inlier ratio 0.000 < 0.500", "RMSE nan m > 0.100 m"]),
        (math.nan, 0.0, ["inlier ratio nan < 0.500"]),
    ],
)
def test_quality(ratio, rmse, complaints):
    assert poor(ratio, rmse, LIMITS) == complaints


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
