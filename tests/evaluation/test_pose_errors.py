"""Summaries: numpy's statistics, and NaN or a refusal where there is nothing."""

import math

import numpy as np
import pytest

from labkit.evaluation import ate, compare, rpe
from labkit.support.errors import DegenerateAlignmentError


@pytest.mark.parametrize("unit", ["steps", "metres"])
def test_a_trajectory_that_is_too_short_has_no_number(unit):
    straight = np.column_stack([np.arange(11.0), np.zeros(11), np.zeros(11)])

    errors = rpe(straight, straight, delta=50, unit=unit)

    assert errors.pairs.shape == (0, 2)
    assert errors.translation.count == errors.rotation.count == 0
    assert math.isnan(errors.translation.mean)
    assert math.isnan(errors.rotation.rmse)


STILL = pytest.mark.parametrize("poses", [np.zeros((1, 3)), np.zeros((5, 3)), np.full((7, 3), 0.1)])


def straight_path(count):
    return np.column_stack([np.arange(count), np.ones(count), np.full(count, 2.0)])


@STILL
def test_a_robot_that_stays_has_no_rigid_alignment(poses):
    with pytest.raises(DegenerateAlignmentError, match=r'leave the rotation .* align="origin"'):
        ate(poses, straight_path(len(poses)))


@STILL
def test_a_robot_that_stays_is_compared_by_its_first_pose(poses):
    errors = compare({"still": poses}, straight_path(len(poses)))

    by_first_pose = errors["still, ATE, first poses aligned"]
    assert by_first_pose.translation_errors[0] + by_first_pose.rotation_errors[0] < 1e-9
