"""Wheel odometry: exact without noise, and as noisy as it says."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.se2 import compose, from_xytheta
from labkit.simulation import WheelNoise, wheel_increments

SILENT = WheelNoise(along=0.0, across=0.0, turn=0.0, drift=0.0)
coordinate = st.floats(-50.0, 50.0)
trajectories = st.lists(
    st.tuples(coordinate, coordinate, st.floats(-10.0, 10.0)), min_size=2, max_size=8
)


def repeated(step, count=20_000):
    """A trajectory that goes back to its start after every step, so each one is `step`."""
    return np.tile([[0.0, 0.0, 0.0], step], (count, 1))


def residuals(step, noise, rng=0):
    poses = repeated(step)
    return (wheel_increments(poses, noise, rng=rng) - wheel_increments(poses, SILENT, rng=0))[::2]


@given(trajectories)
def test_without_noise_the_increments_lead_along_the_trajectory(poses):
    T = from_xytheta(poses)
    steps = from_xytheta(wheel_increments(poses, SILENT, rng=0))
    for k in range(len(poses)):
        np.testing.assert_allclose(compose(T[0], *steps[:k]), T[k], atol=1e-10)


def test_errors_have_the_stated_spread_are_centred_and_independent():
    noise = WheelNoise(along=0.1, across=0.04, turn=0.05, drift=0.02)
    d, turn = np.array([3.0, 4.0]), 2.0
    error = residuals([*d, turn], noise)
    error[:, :2] = error[:, :2] @ np.array([[3.0, -4.0], [4.0, 3.0]]) / 5.0  # along and across
    spread = [0.1 * 5.0, 0.04 * 5.0, math.hypot(0.05 * 2.0, 0.02 * 5.0)]
    assert error.std(axis=0) == pytest.approx(spread, rel=0.03)
    assert (np.abs(error.mean(axis=0)) < 4.0 * error.std(axis=0) / math.sqrt(len(error))).all()
    correlation = np.corrcoef(error.T) - np.eye(3)
    assert np.abs(correlation).max() < 4.0 / math.sqrt(len(error))
