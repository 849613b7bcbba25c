"""Sanity checks: each limit has its own complaint, and a good step has none."""

import math

import numpy as np
import pytest

from labkit.errors import InvalidParameterError
from labkit.odometry import OdometryParameters, SanityLimits
from labkit.odometry.sanity import motion_complaints, quality_complaints

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
    assert motion_complaints(np.array(increment), prior, LIMITS) == complaints


def test_the_distance_to_the_prior_is_measured_across_the_cut_at_pi():
    wide = SanityLimits(max_rotation=4.0, max_prior_rotation=0.1)
    increment, prior = np.array([0.0, 0.0, math.pi]), np.array([0.0, 0.0, -math.pi + 0.05])
    assert motion_complaints(increment, prior, wide) == []


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
    assert quality_complaints(ratio, rmse, LIMITS) == complaints


@pytest.mark.parametrize(
    ("measured", "beside", "beyond"),
    [
        (lambda value: ([value, 0.0, 0.0], None), 1.95, 2.05),  # m of a robot in a tenth second
        (lambda value: ([0.0, 0.0, math.radians(value)], None), 89.0, 91.0),
        (lambda value: ([value, 0.0, 0.0], np.zeros(3)), 0.74, 0.76),
        (lambda value: ([0.0, 0.0, math.radians(value)], np.zeros(3)), 29.5, 30.5),
    ],
)
def test_the_limits_of_a_motion_by_default(measured, beside, beyond):
    for value, count in ((beside, 0), (-beside, 0), (beyond, 1), (-beyond, 1)):
        increment, prior = measured(value)
        assert len(motion_complaints(np.array(increment), prior, SanityLimits())) == count


def test_the_limits_of_a_match_by_default():
    """A third of the points must find partners, and closer ones than chance would give."""
    gate = 8.0 * OdometryParameters().icp.huber_delta  # closed
    by_chance = gate / math.sqrt(3.0)
    for ratio, rmse, count in ((0.34, 0.49 * gate, 0), (0.32, 0.0, 1), (1.0, by_chance, 1)):
        assert len(quality_complaints(ratio, rmse, SanityLimits(), gate)) == count
    for rmse, count in ((0.19, 0), (0.21, 1), (math.inf, 1)):
        assert len(quality_complaints(1.0, rmse, SanityLimits(), 0.5)) == count
    assert quality_complaints(1.0, 0.081, SanityLimits(), gate) == [
        "RMSE 0.081 m > 0.080 m, as by chance"
    ]


@pytest.mark.parametrize(
    ("name", "value", "interval"),
    [
        ("max_translation", 0.0, "(0, inf] m"),
        ("max_rotation", -1.0, "(0, inf] rad"),
        ("max_prior_translation", math.nan, "(0, inf] m"),
        ("max_prior_rotation", 0.0, "(0, inf] rad"),
        ("max_rmse", 0.0, "(0, inf] m"),
        ("max_rmse_share", 1.1, "(0, 1]"),
        ("min_inlier_ratio", 1.1, "[0, 1]"),
        ("min_inlier_ratio", -0.1, "[0, 1]"),
        ("min_information", 0.6, "[0, 0.5]"),
        ("min_information", -0.1, "[0, 0.5]"),
    ],
)
def test_limits_out_of_range(name, value, interval):
    with pytest.raises(InvalidParameterError) as caught:
        SanityLimits(**{name: value})
    assert str(caught.value) == f"`{name}` must be in {interval}, got {value!r}"
