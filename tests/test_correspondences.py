"""Matching, rejecting, weighting: each against the plainest way to say the same."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from labkit.correspondences import (
    MIN_PAIRS,
    distance_gate,
    huber_loss,
    huber_weights,
    overlap,
)

distances = arrays(
    float, st.integers(1, 40), elements=st.sampled_from([*np.arange(9) / 4, math.inf])
)
ratios = st.integers(1, 32).map(lambda k: k / 32)  # exact, so that ⌊ρN⌋ is beyond doubt


@pytest.mark.parametrize("gate", [0.25, 0.5, 2.0, math.inf])
def test_the_gate_is_in_metres_and_includes_its_edge(gate):
    d = np.array([0.0, 0.2, 0.25, 0.3, 0.5, 0.6, 2.0, 2.1, 1e9])
    np.testing.assert_array_equal(distance_gate(d, gate), [x <= gate for x in d])


@given(distances, ratios)
def test_overlap_keeps_an_exact_count_of_the_closest_first_of_ties(d, ratio):
    kept = overlap(d, ratio)
    count = min(len(d), max(MIN_PAIRS, math.floor(Fraction(ratio) * len(d))))
    by_rank = sorted(range(len(d)), key=lambda i: (d[i], i))[:count]
    np.testing.assert_array_equal(np.flatnonzero(kept), sorted(by_rank))


@given(st.floats(1e-6, 1e3), st.floats(1e-3, 1e3))
def test_huber_weight_is_half_the_slope_of_the_loss_over_the_residual(r, delta):
    h = 1e-6 * min(r, delta)
    ahead, behind = huber_loss([r + h, r - h], delta)
    slope = (ahead - behind) / (2.0 * h)
    assert huber_weights([r], delta)[0] == pytest.approx(slope / (2.0 * r), rel=1e-4)


def test_huber_by_hand():
    np.testing.assert_array_equal(
        huber_weights([0.0, 0.1, 0.2, 0.4, 2.0], 0.2), [1, 1, 1, 0.5, 0.1]
    )
    np.testing.assert_allclose(huber_loss([0.0, 0.1, 0.2, 0.4], 0.2), [0, 0.01, 0.04, 0.12])


@pytest.mark.parametrize("r", [[0.0, 1.0, 1e6], [0, 1, 1_000_000]])
def test_an_infinite_delta_is_least_squares(r):
    weights, loss = huber_weights(r, math.inf), huber_loss(r, math.inf)
    np.testing.assert_array_equal(weights, np.ones(3), strict=True)
    np.testing.assert_array_equal(loss, [0.0, 1.0, 1e12], strict=True)
