"""Wheel odometry: exact without noise, and as noisy as it says."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.se2 import compose, matrices_of, rotation
from labkit.simulation import WheelNoise, wheel_increments

NO_NOISE = WheelNoise(along=0.0, across=0.0, turn=0.0, drift=0.0)
COUNT = 4_000  # steps: their spread is known to 1.1 %, their mean to 1.6 % of it
coordinate = st.floats(-50.0, 50.0)
trajectories = st.lists(
    st.tuples(coordinate, coordinate, st.floats(-10.0, 10.0)), min_size=2, max_size=8
)


@given(trajectories)
def test_without_noise_the_increments_lead_along_the_trajectory(poses):
    T = matrices_of(np.array(poses))
    steps = matrices_of(wheel_increments(poses, NO_NOISE, rng=0))

    for k in range(len(poses)):
        np.testing.assert_allclose(compose(T[0], *steps[:k]), T[k], atol=1e-10)


@pytest.fixture(scope="module")
def errors():
    """Errors along the travel, across it and of the heading, in units of the stated spread."""
    d, turn = np.array([3.0, 4.0]), 2.0  # 5 m
    noise = WheelNoise(along=0.1, across=0.04, turn=0.05, drift=0.02)
    spread = [0.1 * 5.0, 0.04 * 5.0, math.hypot(0.05 * turn, 0.02 * 5.0)]
    there_and_back = np.tile([[0.0, 0.0, 0.0], [*d, turn]], (COUNT, 1))
    error = wheel_increments(there_and_back, noise, rng=0)[::2] - [*d, turn]
    error[:, :2] @= rotation(math.atan2(d[1], d[0]))
    return error / spread


def test_errors_have_the_stated_spread(errors):
    np.testing.assert_allclose(errors.std(axis=0), 1.0, rtol=4.0 / math.sqrt(2.0 * COUNT))


def test_errors_are_centred(errors):
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=4.0 / math.sqrt(COUNT))


def test_errors_are_independent(errors):
    correlation = np.corrcoef(errors.T)
    np.testing.assert_allclose(correlation, np.eye(3), atol=4.0 / math.sqrt(COUNT))
