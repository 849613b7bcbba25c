"""The second measurement of a step: two scans alone."""

import math

import numpy as np
import pytest

from labkit import Target, icp
from labkit.odometry.check import check_step
from labkit.parameters import ACCURATE
from labkit.se2 import from_xytheta
from labkit.simulation import Lidar, cast, room

MOTION = np.array([0.1, 0.05, math.radians(3.0)])
NEWER, OLDER = (cast(room(), from_xytheta(pose), Lidar(), rng=0) for pose in (MOTION, 0.0 * MOTION))


@pytest.mark.parametrize("off", [[0.15, 0.0, 0.0], [0.0, -0.12, 0.0], [0.0, 0.0, 0.1]])
def test_two_scans_tell_their_motion_wherever_the_step_was_taken_to_lead(off):
    check = check_step(NEWER, Target(OLDER), MOTION + off, None, ACCURATE)

    np.testing.assert_allclose(check.increment, MOTION, atol=0.01)


def test_a_step_too_far_off_for_a_match_is_told_from_the_wheels():
    taken = MOTION + np.array([0.0, 0.0, math.pi / 2.0])

    alone = check_step(NEWER, Target(OLDER), taken, None, ACCURATE)
    beside_wheels = check_step(NEWER, Target(OLDER), taken, MOTION, ACCURATE)

    assert abs(alone.increment[2] - taken[2]) < 0.2
    np.testing.assert_allclose(beside_wheels.increment, MOTION, atol=0.01)


def test_a_match_that_ends_higher_than_the_step_taken_does_not_count(monkeypatch):
    """With few pairs ICP may slide away to where its cost is higher."""
    poor = icp(NEWER, Target(OLDER), from_xytheta([0.0, 0.0, 1.6]), ACCURATE)
    monkeypatch.setattr("labkit.odometry.check.icp", lambda *_: poor)

    check = check_step(NEWER, Target(OLDER), MOTION, None, ACCURATE)

    np.testing.assert_allclose(check.increment, MOTION, atol=1e-12)


def test_two_scans_that_share_nothing_tell_nothing():
    far = np.array([90.0, 0.0, 0.0])

    check = check_step(NEWER, Target(OLDER), far, None, ACCURATE)

    assert np.isnan(check.increment).all()
